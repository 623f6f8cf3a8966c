"""The benchmark of the speed detector: what counts as found, early, false; and that the part works whole."""

from __future__ import annotations

import json
from dataclasses import replace
from math import inf, nan

import numpy as np
import pytest
from click.testing import CliRunner

from detectors.speed import SpeedVerdict
from detectors.verdict import Level
from hil_tests.bench import bench
from hil_tests.bench.ideal import BEFORE_S, ideal_delay_s, regressors_of
from hil_tests.bench.speed import DATA, by_kind_of_mission
from hil_tests.bench.speed_detection import judge, samples, score
from hil_tests.bench.speed_timing import plain_filter
from hil_tests.bench.speed_ways import FINE, MISSIONS, RECORDED, judge_mission, judge_recording
from hil_tests.missions import random_mission

LABELS = {"estimator": "one", "group": MISSIONS, "water": "constant", "seed": 4}


class Scripted:
    """Says FAULT in the given spans of time, UNKNOWN before 10 s, and the true speed and flow but for an error."""

    def __init__(self, way, *spans, speed_off_mps=0.0, error_mps=nan):
        self._truth = {
            time_s: (float(speed_mps) + speed_off_mps, tuple(flow_mps.tolist()))
            for time_s, speed_mps, flow_mps in zip(way.time_s, way.true_speed_mps, way.true_flow_mps, strict=True)
        }
        self._spans, self._error_mps = spans, error_mps

    def update(self, sample):
        speed_mps, flow_mps = self._truth[sample.time_s]
        fault = any(begin <= sample.time_s < end for begin, end in self._spans)
        level = Level.FAULT if fault else Level.UNKNOWN if sample.time_s < 10.0 else Level.NORMAL
        return SpeedVerdict(
            time_s=sample.time_s, level=level, score=0.0, flag=0,
            speed_mps=speed_mps, flow_mps=flow_mps, speed_error_mps=self._error_mps,
        )  # fmt: skip


@pytest.fixture(scope="module")
def lost():
    return random_mission(4, 0.3, rate_hz=2.0)


@pytest.fixture(scope="module")
def healthy():
    return random_mission(4, rate_hz=2.0)


def found(way, *spans, **arguments):
    return judge(way, Scripted(way, *spans, **arguments), **LABELS)


def test_a_fault_after_the_onset_finds_the_loss_and_one_before_is_an_alarm(lost):
    onset_s = lost.onset_s
    assert found(lost).delay_s is None
    assert found(lost, (onset_s + 7.0, inf)).delay_s == pytest.approx(7.0, abs=0.5)
    assert found(lost, (onset_s + 7.0, inf)).alarms == 0
    early = found(lost, (50.0, 60.0), (80.0, 81.0), (onset_s + 3.0, inf))
    assert early.alarms == 2
    assert early.delay_s == pytest.approx(3.0, abs=0.5)
    lasting = found(lost, (onset_s - 3.0, inf))  # not found: it has been there before
    assert (lasting.alarms, lasting.delay_s) == (1, None)


def test_every_fault_in_a_healthy_mission_is_an_alarm(healthy):
    finding = found(healthy, (50.0, 60.0), (healthy.time_s[-1] - 5.0, inf))
    assert (finding.alarms, finding.delay_s, finding.loss) == (2, None, 0.0)
    assert finding.healthy_s == pytest.approx(np.ptp(healthy.time_s))
    assert finding.unknown == 0.0
    assert finding.ideal_s is None


def test_errors_are_those_after_the_learning_where_there_is_an_estimate(healthy):
    off = found(healthy, speed_off_mps=0.25)
    assert off.speed_error_mps == pytest.approx(0.25)
    assert off.flow_error_mps == pytest.approx(0.0, abs=1e-12)
    assert np.isnan(found(healthy, speed_off_mps=0.25, error_mps=inf).speed_error_mps)


def test_scores_sum_up_what_was_found(healthy, lost):
    findings = [
        *(found(healthy, *spans) for spans in ([], [(50.0, 60.0)], [])),
        *(found(lost, (lost.onset_s + delay_s, inf)) for delay_s in (2.0, 4.0, 30.0)),
        found(lost),
        found(lost, (20.0, 30.0), (lost.onset_s + 1.0, inf)),
    ]
    result = score("one", findings)
    assert (result.healthy, result.alarmed, result.lost, result.early, result.found) == (3, 1, 5, 1, 3)
    assert result.median_s == pytest.approx(30.0, abs=0.5)
    assert result.late_s is None  # missed ones take for ever
    hours = (3 * np.ptp(healthy.time_s) + 5 * lost.onset_s) / 3600.0
    assert result.alarms_per_hour == pytest.approx(2 / hours, rel=0.01)


def test_missions_are_sorted_by_what_they_are(lost):
    finding = found(lost, (lost.onset_s + 5.0, inf))
    other = replace(finding, group=FINE, noise_m=0.1, delay_s=None)
    scores = {one.name: one for one in by_kind_of_mission([replace(finding, noise_m=0.5), other])}
    assert scores["noise 0.3 to 1 m"].found == 1
    assert scores[lost.kind].lost == 1
    assert scores[FINE].found == 0
    assert "noise 0 to 0.3 m" not in scores


def test_on_a_straight_leg_even_the_ideal_observer_waits_for_the_turn(lost):
    turn_s = lost.onset_s + 31.0
    legs_rad = np.where(lost.time_s < turn_s, 0.3, 2.0)
    turned_before_rad = np.where(lost.time_s < lost.onset_s, 0.5 * lost.time_s, legs_rad)
    waited_s = ideal_delay_s(replace(lost, true_heading_rad=turned_before_rad))
    assert turn_s < lost.onset_s + waited_s < turn_s + 30.0
    # who has never turned before does not know the speed that is to be lost
    assert ideal_delay_s(replace(lost, true_heading_rad=legs_rad)) is None


def test_the_ideal_observer_needs_less_noise_or_more_time(lost):
    delays_s = [ideal_delay_s(replace(lost, noise_m=noise_m)) for noise_m in (0.01, 0.1, 1.0)]
    assert delays_s == sorted(delays_s)
    assert delays_s[0] < delays_s[2]
    assert ideal_delay_s(replace(lost, noise_m=1e4)) is None


def test_the_ideal_observers_evidence_is_that_of_a_fit():
    """When it is sure, the standard deviation of the loss in a least-squares fit is a fifth of it."""
    mission = random_mission(12, 0.3, rate_hz=10.0, noise_m=0.3)
    used = (mission.time_s >= mission.onset_s - BEFORE_S) & (
        mission.time_s <= mission.onset_s + ideal_delay_s(mission)
    )
    regressors, change = regressors_of(mission.time_s[used] - mission.onset_s, mission.true_heading_rad[used])
    every = np.column_stack([regressors, change])
    deviation_mps = mission.noise_m * np.sqrt(np.linalg.inv(every.T @ every)[-1, -1])
    lost_mps = 0.3 * mission.true_speed_mps[mission.time_s < mission.onset_s].mean()
    assert 5.0 < lost_mps / deviation_mps < 6.0


def test_samples_are_what_the_sensors_say(lost):
    seen = samples(lost)
    assert len(seen) == len(lost.time_s)
    assert (seen[7].north_m, seen[7].east_m, seen[7].heading_rad) == (
        lost.north_m[7], lost.east_m[7], lost.heading_rad[7],
    )  # fmt: skip


def test_the_plain_filter_learns_the_speed():
    mission = random_mission(1, rate_hz=5.0, noise_m=0.1)
    assert plain_filter(samples(mission)) == pytest.approx(mission.true_speed_mps[-1], rel=0.1)


def test_a_mission_is_judged_healthy_with_a_loss_and_with_fine_sensors():
    healthy, lost, fine = judge_mission("kalman", 3, "plain", 0.3)
    assert [one.loss for one in (healthy, lost, fine)] == [0.0, 0.3, 0.3]
    assert [one.group for one in (healthy, lost, fine)] == [MISSIONS, MISSIONS, FINE]
    assert (fine.noise_m, fine.rate_hz) == (0.1, 10.0)
    assert fine.updates > lost.updates or lost.rate_hz == 10.0


def test_the_speed_part_prints_tables_and_writes_the_figures(tmp_path):
    file = tmp_path / "figures.json"
    arguments = [
        "--missions",
        "1",
        "--only",
        "kalman",
        "--paper",
        "1",
        "--recordings",
        str(tmp_path),
        "--jobs",
        "1",
        "--json",
        str(file),
    ]
    result = CliRunner().invoke(bench, ["speed", *arguments])
    assert result.exit_code == 0, result.output
    assert "kalman" in result.output
    figures = json.loads(file.read_text(), parse_constant=pytest.fail)["speed"]
    assert figures["options"]["missions"] == 1
    assert list(figures["estimators"]) == [MISSIONS, FINE]
    assert len(figures["findings"]) == 3
    assert {row["experiment"] for row in figures["paper"]} > {"simulation, 10 Hz"}


@pytest.mark.skipif(
    not any(DATA.glob("snapir/*.npz")), reason="the recordings of shared/data are not beside the project"
)
def test_a_recording_is_judged_healthy_and_with_its_loss():
    path = sorted(DATA.glob(RECORDED["snapir"].pattern))[4]
    healthy, lost = judge_recording("kalman", "snapir", path, "tidal")
    assert [one.loss for one in (healthy, lost)] == [0.0, 0.5]
    assert {one.group for one in (healthy, lost)} == {"snapir, tidal"}
    assert healthy.alarms == 0
    assert healthy.speed_error_mps < 1.0
