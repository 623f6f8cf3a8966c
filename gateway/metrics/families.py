"""A telemetry as families of metrics, named and in units as Prometheus's users expect.

What is not known has no sample: a graph then has a gap, where a 0 would look like good news.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import accumulate
from math import isfinite

from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, HistogramMetricFamily, InfoMetricFamily
from prometheus_client.metrics_core import Metric
from prometheus_client.utils import floatToGoString

from detectors.verdict import Level
from gateway.telemetry import LinkTelemetry, SubjectTelemetry, Telemetry

PREFIX = "gateway_"
LEVELS = ", ".join(f"{level.value} = {level.name}" for level in Level)
# labels, and the value
_Sample = tuple[Sequence[str], float]


@dataclass(frozen=True, slots=True)
class Quantity:
    """A value of a subject as a metric: its name, without the prefix, and what it is."""

    name: str
    what: str


# by the names of `SubjectTelemetry.values`
QUANTITIES: Mapping[str, Quantity] = {
    "command": Quantity("command_ratio", "Command, -1 = full astern to 1 = full ahead."),
    "speed_rpm": Quantity("speed_rpm", "Measured speed of the propeller."),
    "predicted_rpm": Quantity("predicted_rpm", "Speed that a healthy thruster would have."),
    "residual_rpm": Quantity("residual_rpm", "Measured less predicted speed."),
    "threshold_rpm": Quantity("threshold_rpm", "Residual beyond which a single sample is too far off."),
    "wear": Quantity("wear_ratio", "Drift from the commissioned curve, negative = slower."),
    "voltage_v": Quantity("supply_volts", "Supply of the motor controller."),
    "current_a": Quantity("current_amperes", "Current of the motor or its controller."),
    "speed_mps": Quantity("speed_meters_per_second", "Speed through the water along the bow."),
    "flow_north_mps": Quantity("flow_north_meters_per_second", "Velocity of the water to the north."),
    "flow_east_mps": Quantity("flow_east_meters_per_second", "Velocity of the water to the east."),
    "depth_m": Quantity("depth_meters", "Depth below the surface."),
    "isolated": Quantity("isolated", "Whether a navigation sensor is left out."),
}


def families(telemetry: Telemetry, version: str) -> Iterator[Metric]:
    """All of them, those without a sample as well.

    Args:
        telemetry: what is shown.
        version: of this program.
    """
    yield _info("build", "Version of the program.", {"version": version})
    yield _info("vehicle", "What is watched.", {"name": telemetry.vehicle})
    yield _gauge(
        "start_time_seconds", "Start of the run, unix time.", (), [((), telemetry.time_s - telemetry.running_s)]
    )
    yield from _of_subjects(telemetry.subjects)
    yield from _of_links(telemetry.links)
    yield _dropped(telemetry)
    yield _found(telemetry.findings)
    yield from _of_judging(telemetry)
    recorded = [] if telemetry.recorded_bytes is None else [((), telemetry.recorded_bytes)]
    yield _counter("recording_bytes", "Written to recordings by this run.", (), recorded)


def _of_subjects(subjects: Iterable[SubjectTelemetry]) -> Iterator[Metric]:
    listed, label = tuple(subjects), ("subject",)
    levels = [((one.subject,), float(one.level)) for one in listed]
    yield _gauge("level", f"What the pilot was told: {LEVELS}.", label, levels)
    scores = [((one.subject,), one.score) for one in listed]
    yield _gauge("score", "Evidence for a fault, 1 = the threshold.", label, scores)
    for key, quantity in QUANTITIES.items():
        values = [((one.subject,), one.values[key]) for one in listed if key in one.values]
        yield _gauge(quantity.name, quantity.what, label, values)


def _of_links(links: Iterable[LinkTelemetry]) -> Iterator[Metric]:
    listed, label = tuple(links), ("link",)
    up = [((one.name,), float(one.up)) for one in listed if one.up is not None]
    yield _gauge("link_up", "Whether a link is open, and frames can come.", label, up)
    loads = [((one.name,), one.load) for one in listed]
    yield _gauge("bus_load_ratio", "Share of its bit rate that a CAN bus carries.", label, loads)
    received = [((one.name,), one.received) for one in listed]
    yield _counter("frames", "Frames that were received; of MAVLink, readings.", label, received)
    errors = [((one.name, cause), count) for one in listed for cause, count in one.decode_errors.items()]
    yield _counter("decode_errors", "What the decoder of a link threw away, by cause.", ("link", "cause"), errors)


def _dropped(telemetry: Telemetry) -> Metric:
    places = {one.name: Counter(one.drops) - Counter(one.decode_errors) for one in telemetry.links}
    dropped = [
        ((place, cause), count)
        for place, causes in {**places, **telemetry.drops}.items()
        for cause, count in causes.items()
    ]
    return _counter(
        "dropped", "What was lost, refused or not sent elsewhere than in a decoder.", ("place", "cause"), dropped
    )


def _found(findings: Mapping[str, int]) -> Metric:
    """Of each level, from the beginning on: an alert on an increase wants a 0 before the first."""
    counts = [((level.name,), findings.get(level.name, 0)) for level in Level]
    return _counter("findings", "Changes of level that were found, by the new level.", ("level",), counts)


def _of_judging(telemetry: Telemetry) -> Iterator[Metric]:
    yield _gauge("behind_seconds", "How late the judging is.", (), [((), telemetry.behind_s)])
    yield _latencies(telemetry)
    refits = telemetry.refits.items()
    yield _counter(
        "refits", "How often a detector has learnt anew.", ("subject",), [((s,), one.count) for s, one in refits]
    )
    yield _counter(
        "refit_seconds", "Time that it took in all.", ("subject",), [((s,), one.seconds) for s, one in refits]
    )


def _latencies(telemetry: Telemetry) -> Metric:
    family = HistogramMetricFamily(
        f"{PREFIX}latency_seconds", "From a sample's instant until its judgement was told."
    )
    bounds = [*map(floatToGoString, telemetry.latency_bounds_s), "+Inf"]
    if telemetry.latency_counts:
        below = accumulate(telemetry.latency_counts)
        family.add_metric((), list(zip(bounds, below, strict=True)), telemetry.latency_sum_s)
    return family


def _info(name: str, what: str, value: Mapping[str, str]) -> Metric:
    return InfoMetricFamily(f"{PREFIX}{name}", what, value=dict(value))


def _gauge(name: str, what: str, labels: Sequence[str], samples: Iterable[_Sample]) -> Metric:
    family = GaugeMetricFamily(f"{PREFIX}{name}", what, labels=labels)
    for values, value in samples:
        if isfinite(value):
            family.add_metric(values, value)
    return family


def _counter(name: str, what: str, labels: Sequence[str], samples: Iterable[_Sample]) -> Metric:
    family = CounterMetricFamily(f"{PREFIX}{name}", what, labels=labels)
    for values, value in samples:
        family.add_metric(values, value)
    return family
