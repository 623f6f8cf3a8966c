"""The benchmark of the supervisor: every change is told, in both ways, and the plain loop tells the same faults."""

from __future__ import annotations

import json

from click.testing import CliRunner

from detectors.thruster import ThrusterSample
from detectors.verdict import Level
from hil_tests.bench import bench
from hil_tests.bench.supervisor_latency import _bare
from hil_tests.bench.supervisor_timing import supervision
from hil_tests.bench.timed_detector import CHANGE_S, WANTED_RPM, TimedDetector


def test_the_command_measures_both_ways():
    result = CliRunner().invoke(bench, ["supervisor", "--changes", "3", "--json", "-"], catch_exceptions=False)
    assert result.exit_code == 0
    figures = json.loads(result.stdout)["supervisor"]
    from_sample, from_verdict, bare = figures["latency"]
    for way in (from_sample, from_verdict, bare):
        assert way["texts"] >= 2
        assert 0.0 < way["median_ms"] <= way["p99_ms"] <= way["max_ms"] < 2000.0
    assert from_sample["median_ms"] > from_verdict["median_ms"]
    assert figures["cost"]["ours_us"] > figures["cost"]["peer_us"] > 0.0


def test_nothing_in_between_takes_less_than_a_batch():
    taken_ms = _bare(5)
    assert len(taken_ms) == 5
    assert taken_ms.min() > 0.0
    assert taken_ms.max() < 100.0


def test_the_timed_detector_names_each_change_once():
    detector = TimedDetector(changing=True)
    verdicts = [detector.update(ThrusterSample(n * CHANGE_S / 4 + 0.01, 0.5, 800.0)) for n in range(12)]
    assert [one.level for one in verdicts[::4]] == [Level.NORMAL, Level.FAULT, Level.NORMAL]
    assert sorted(detector.said_ns) == [0, 1, 2]
    assert {round(one.predicted_rpm) - WANTED_RPM for one in verdicts} == {0, 1, 2}
    calm = TimedDetector(changing=False)
    assert {calm.update(ThrusterSample(float(n), 0.5, 800.0)).level for n in range(9)} == {Level.NORMAL}


def test_supervisor_and_plain_loop_tell_the_same_faults():
    comparison = supervision()
    told = comparison.ours()
    assert told == comparison.theirs()
    assert {severity for severity, _ in told} == {2, 5}
