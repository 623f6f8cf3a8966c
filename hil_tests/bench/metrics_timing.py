"""Metrics collected when somebody asks, beside instruments that are set with each judgement, as is usual."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import sin

from prometheus_client import CollectorRegistry, Gauge, Histogram, generate_latest
from prometheus_client.parser import text_string_to_metric_families

from detectors.thruster import ThrusterSample
from detectors.thruster.detector import UNJUDGED
from detectors.verdict import Level
from gateway.channel import ThrusterJudgement
from gateway.metrics.exposition import Exposition
from gateway.telemetry_board import LATENCY_BOUNDS_S, Counts, TelemetryBoard
from hil_tests.bench.timing import Comparison

THRUSTERS, RATE_HZ, DURATION_S = 8, 50, 60
# judged together; asked for once in the whole time, as Prometheus does
BATCH_S = 0.1
# what both are to show in the end
SHOWN = ("gateway_score", "gateway_residual_rpm", "gateway_latency_seconds")
_Batch = tuple[float, Sequence[ThrusterJudgement]]
_Shown = dict[tuple[str, ...], float]


def metrics() -> Comparison:
    """Eight thrusters for a minute, and a scrape at the end.

    The peer has a gauge for score and residual of each thruster and a histogram of latencies; ours shows all else
    beside that. They agree where these have the same values in the end.
    """
    batches = _batches()
    return Comparison(
        work="metrics of judgements",
        peer="prometheus-client",
        unit="judgement",
        count=THRUSTERS * RATE_HZ * DURATION_S,
        ours=lambda: _board(batches),
        theirs=lambda: _instruments(batches),
        agree=lambda ours, theirs: bool(_shown(ours)) and _shown(ours) == _shown(theirs),
    )


def _batches() -> list[_Batch]:
    size = round(BATCH_S * RATE_HZ)
    return [
        (first / RATE_HZ + BATCH_S, [_judgement(n, k) for n in range(first, first + size) for k in range(THRUSTERS)])
        for first in range(0, DURATION_S * RATE_HZ, size)
    ]


def _judgement(n: int, thruster: int) -> ThrusterJudgement:
    time_s, residual_rpm = n / RATE_HZ, 30.0 * sin(0.1 * n + thruster)
    verdict = replace(
        UNJUDGED, time_s=time_s, level=Level.NORMAL, score=abs(residual_rpm) / 100.0, residual_rpm=residual_rpm
    )
    return ThrusterJudgement(thruster + 1, ThrusterSample(time_s, 0.5, 1500.0 + residual_rpm), verdict)


def _board(batches: Sequence[_Batch]) -> bytes:
    board = TelemetryBoard("ROV", [f"thruster {number + 1}" for number in range(THRUSTERS)], 0.0)
    for now_s, judgements in batches:
        board.take(judgements, now_s)
    return Exposition(lambda: board.telemetry(DURATION_S, Counts())).text()


def _instruments(batches: Sequence[_Batch]) -> bytes:
    registry = CollectorRegistry()
    score = Gauge("gateway_score", "Evidence.", ["subject"], registry=registry)
    residual = Gauge("gateway_residual_rpm", "Residual.", ["subject"], registry=registry)
    latency = Histogram("gateway_latency_seconds", "Latency.", buckets=LATENCY_BOUNDS_S, registry=registry)
    children = {
        number + 1: (score.labels(f"thruster {number + 1}"), residual.labels(f"thruster {number + 1}"))
        for number in range(THRUSTERS)
    }
    for now_s, judgements in batches:
        for one in judgements:
            of_score, of_residual = children[one.thruster]
            of_score.set(one.verdict.score)
            of_residual.set(one.verdict.residual_rpm)
            latency.observe(now_s - one.verdict.time_s)
    return generate_latest(registry)


def _shown(text: bytes) -> _Shown:
    """What a reader of the text sees, to six digits: the sums are made in another order."""
    found = [one for one in text_string_to_metric_families(text.decode()) if one.name in SHOWN]
    samples = [sample for family in found for sample in family.samples if not sample.name.endswith("_created")]
    return {(one.name, *one.labels.values()): round(one.value, 6) for one in samples}
