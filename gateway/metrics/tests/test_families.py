"""Metrics of a telemetry: what Prometheus reads is what the gateway knows, under names that its users expect."""

import re
from dataclasses import replace
from math import inf, nan

import pytest
from prometheus_client import CollectorRegistry, generate_latest
from prometheus_client.metrics_core import Metric
from prometheus_client.parser import text_string_to_metric_families
from prometheus_client.registry import Collector

from detectors.verdict import Level
from gateway.metrics.exposition import Exposition
from gateway.metrics.families import QUANTITIES, families
from gateway.telemetry import LinkTelemetry, Refits, SubjectTelemetry, Telemetry

ODD = 'a "quoted" \\ cause\nof two lines, with ü'
TELEMETRY = Telemetry(
    time_s=1.7e9,
    vehicle="BlueROV2 Heavy",
    running_s=100.0,
    subjects=(
        SubjectTelemetry("thruster 1", Level.FAULT, 1.4, {"speed_rpm": 800.0, "residual_rpm": -200.0}),
        SubjectTelemetry("vehicle", Level.NORMAL, 0.2, {"speed_mps": 0.9}),
        SubjectTelemetry("link can0", Level.UNKNOWN, nan),
    ),
    links=(
        LinkTelemetry("can0", True, "", 120, {"wrong length": 3, "overflow": 2}, 0.25, {"wrong length": 3}),
        LinkTelemetry("mavlink", None, "", 7, {ODD: 1}, nan, {ODD: 1}),
    ),
    findings={"FAULT": 1},
    drops={"pipeline": {"late": 2}, "control": {}},
    behind_s=0.125,
    latency_bounds_s=(0.1, 0.25),
    latency_counts=(4, 2, 1),
    latency_sum_s=1.5,
    refits={"thruster 1": Refits(3, 0.12)},
    recorded_bytes=4096,
)


class Shown(Collector):
    """All families of a telemetry."""

    def __init__(self, telemetry: Telemetry) -> None:
        self.telemetry = telemetry

    def collect(self):
        return families(self.telemetry, "1.2.3")


def read(telemetry: Telemetry) -> dict[str, Metric]:
    """What a reader of the text makes of it, by name."""
    registry = CollectorRegistry()
    registry.register(Shown(telemetry))
    text = generate_latest(registry).decode()
    return {family.name: family for family in text_string_to_metric_families(text)}


def samples(telemetry: Telemetry, name: str) -> dict[tuple[str, ...], float]:
    """Values of a metric by the values of its labels."""
    found = [one for family in read(telemetry).values() for one in family.samples if one.name == name]
    order = ("link", "place", "subject", "level", "cause")
    ranked = [
        (sorted(one.labels.items(), key=lambda item: (*order, item[0]).index(item[0])), one.value) for one in found
    ]
    return {tuple(value for _, value in labels): number for labels, number in ranked}


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("gateway_build_info", {("1.2.3",): 1.0}),
        ("gateway_vehicle_info", {("BlueROV2 Heavy",): 1.0}),
        ("gateway_start_time_seconds", {(): 1.7e9 - 100.0}),
        ("gateway_level", {("thruster 1",): 3.0, ("vehicle",): 1.0, ("link can0",): 0.0}),
        ("gateway_score", {("thruster 1",): 1.4, ("vehicle",): 0.2}),
        ("gateway_residual_rpm", {("thruster 1",): -200.0}),
        ("gateway_speed_meters_per_second", {("vehicle",): 0.9}),
        ("gateway_link_up", {("can0",): 1.0}),
        ("gateway_bus_load_ratio", {("can0",): 0.25}),
        ("gateway_frames_total", {("can0",): 120.0, ("mavlink",): 7.0}),
        ("gateway_decode_errors_total", {("can0", "wrong length"): 3.0, ("mavlink", ODD): 1.0}),
        ("gateway_dropped_total", {("can0", "overflow"): 2.0, ("pipeline", "late"): 2.0}),
        ("gateway_findings_total", {("UNKNOWN",): 0.0, ("NORMAL",): 0.0, ("SUSPECT",): 0.0, ("FAULT",): 1.0}),
        ("gateway_behind_seconds", {(): 0.125}),
        ("gateway_latency_seconds_bucket", {("0.1",): 4.0, ("0.25",): 6.0, ("+Inf",): 7.0}),
        ("gateway_latency_seconds_count", {(): 7.0}),
        ("gateway_latency_seconds_sum", {(): 1.5}),
        ("gateway_recording_bytes_total", {(): 4096.0}),
        ("gateway_refits_total", {("thruster 1",): 3.0}),
        ("gateway_refit_seconds_total", {("thruster 1",): 0.12}),
    ],
)
def test_what_is_known_is_read_back_as_it_was(name, expected):
    assert samples(TELEMETRY, name) == expected


@pytest.mark.parametrize("unknown", [nan, inf, -inf])
def test_what_is_not_known_has_no_sample(unknown):
    subject = SubjectTelemetry("thruster 1", Level.UNKNOWN, unknown, {"residual_rpm": unknown})
    telemetry = replace(TELEMETRY, subjects=(subject,))
    assert samples(telemetry, "gateway_score") == samples(telemetry, "gateway_residual_rpm") == {}


@pytest.mark.parametrize("telemetry", [TELEMETRY, Telemetry(0.0, "ROV", 0.0)], ids=["full", "empty"])
def test_names_and_types_are_as_promtool_wants_them(telemetry):
    found = list(families(telemetry, "1.2.3"))
    names = [family.name for family in found]
    assert len(names) == len(set(names)) and len(names) > len(QUANTITIES) + 10
    for family in found:
        assert re.fullmatch("gateway_[a-z][a-z_]*[a-z]", family.name), family.name
        assert family.documentation.endswith(".") and "\n" not in family.documentation
        assert not re.search("_(ms|millis|percent|rad|minutes|hours|count|sum|bucket|total|info)$", family.name)
        assert family.type != "counter" or all(one.name == f"{family.name}_total" for one in family.samples)
        for sample in family.samples:
            assert all(re.fullmatch("[a-z_]+", label) for label in sample.labels)
            assert family.type not in ("counter", "histogram") or sample.value >= 0.0


def test_the_same_families_come_with_and_without_samples():
    empty = Telemetry(0.0, "ROV", 0.0)
    assert [one.name for one in families(TELEMETRY, "1")] == [one.name for one in families(empty, "1")]


def test_the_process_itself_is_shown_and_nothing_else_that_this_process_counts():
    text = Exposition(lambda: TELEMETRY).text().decode()
    names = {family.name for family in text_string_to_metric_families(text)}
    assert {"process_cpu_seconds", "process_resident_memory_bytes", "gateway_level"} <= names
    assert all(name.startswith(("gateway_", "process_")) for name in names)
