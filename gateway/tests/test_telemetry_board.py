"""What the board shows of a run: the newest of each subject, links as they are, how late it is, what was learnt."""

import json
from collections import Counter, defaultdict
from math import inf, isnan, nan
from types import SimpleNamespace

import pytest

from detectors.navigation import DepthSample, DvlSample, NavigationState, NavigationVerdict, Sensor, SensorVerdict
from detectors.speed import PoseSample
from detectors.thruster import ThrusterDetector, ThrusterSample
from detectors.verdict import Level
from drivers.mavlink.messages import StatusText
from drivers.readings import BusLoad, FrameLoss, LinkState
from gateway.channel import NavigationJudgement, SpeedJudgement, ThrusterJudgement
from gateway.findings import Finding
from gateway.pipeline import Arrival, Factories, Pipeline
from gateway.severity import Severity
from gateway.stopwatch import Stopwatch
from gateway.subject_values import values_of
from gateway.telemetry import Refits, Said
from gateway.telemetry_board import LATENCY_BOUNDS_S, Counts, TelemetryBoard
from gateway.telemetry_table import table_of
from gateway.tests.conftest import ThresholdDetector, over_the_disk, speed_verdict, verdict
from gateway.tests.test_pipeline import START_S, drive, play

NOW_S = START_S + 10.0


def thruster(number: int, time_s: float, level: Level = Level.NORMAL, **fields: object) -> ThrusterJudgement:
    return ThrusterJudgement(number, ThrusterSample(time_s, 0.5, 900.0), verdict(time_s, level, **fields))


def finding(subject: str, level: Level, text: str, detector: str = "thruster") -> Finding:
    return Finding(NOW_S, detector, subject, level, 1.4, text, Severity.CRITICAL)


@pytest.fixture
def board() -> TelemetryBoard:
    return TelemetryBoard("ROV", ["thruster 1", "thruster 2", "vehicle"], START_S)


def subject(board: TelemetryBoard, name: str):
    (found,) = (one for one in board.telemetry(NOW_S, Counts()).subjects if one.subject == name)
    return found


# What judgements say


def test_of_a_thruster_its_numbers_are_told_and_what_is_not_known_is_left_out():
    judgement = ThrusterJudgement(
        3,
        ThrusterSample(1.0, -0.5, -900.0, None, 3.5),
        verdict(1.0, Level.UNKNOWN, residual_rpm=nan, predicted_rpm=nan, reason="learning", score=0.0),
    )
    (told,) = values_of(judgement)
    assert (told.subject, told.score, told.reason) == ("thruster 3", 0.0, "learning")
    known = {"command": -0.5, "speed_rpm": -900.0, "threshold_rpm": 150.0, "lag_s": 0.1, "current_a": 3.5}
    assert told.values == known


@pytest.mark.parametrize("flow", [(0.1, -0.2), (0.1, -0.2, 0.05)])
def test_of_the_speed_the_flow_is_told_along_each_axis(flow):
    judgement = SpeedJudgement(
        PoseSample(1.0, 0.0, 0.0, 0.0), speed_verdict(1.0, Level.NORMAL, flow_mps=flow, speed_error_mps=inf)
    )
    (told,) = values_of(judgement)
    assert told.subject == "vehicle"
    assert [told.values[f"flow_{axis}_mps"] for axis in ("north", "east", "down")[: len(flow)]] == list(flow)
    assert told.values["speed_mps"] == 1.0 and not {"command", "speed_error_mps"} & set(told.values)


def test_of_navigation_each_sensor_is_told_by_what_it_measures():
    state = NavigationState(1.0, 0.5, 0.2, 5.0, (1.0, 0.0, 0.0), (0.0, 0.1, 0.2))
    sensors = (SensorVerdict(Sensor.DVL, Level.FAULT, 1.5, isolated=True), SensorVerdict(Sensor.DEPTH, Level.NORMAL))
    judged = NavigationVerdict(
        time_s=1.0, level=Level.FAULT, score=1.5, state=state, innovation=(0.3, nan, 0.0, 0.02), sensors=sensors
    )
    dvl, depth = DvlSample(1.0, (1.3, 0.0, 0.0)), DepthSample(1.0, 5.02)
    told = {one.subject: one for one in values_of(NavigationJudgement(dvl, judged, dvl, depth, True))}
    assert list(told) == ["navigation", "dvl", "depth sensor"]
    assert told["dvl"].score == 1.5 and told["dvl"].values == {
        "isolated": 1.0,
        "innovation_forward_mps": 0.3,
        "innovation_down_mps": 0.0,
        "forward_mps": 1.3,
        "right_mps": 0.0,
        "down_mps": 0.0,
    }
    assert told["depth sensor"].values == {"isolated": 0.0, "innovation_depth_m": 0.02, "depth_m": 5.02}
    assert told["navigation"].values["depth_m"] == 5.0 and "position_error_m" not in told["navigation"].values


# The board


def test_before_anything_was_heard_the_subjects_of_the_configuration_are_not_known(board):
    telemetry = board.telemetry(NOW_S, Counts())
    assert [one.subject for one in telemetry.subjects] == ["thruster 1", "thruster 2", "vehicle"]
    assert all(one.level is Level.UNKNOWN and isnan(one.score) and not one.text for one in telemetry.subjects)
    assert (telemetry.vehicle, telemetry.running_s, sum(telemetry.latency_counts)) == ("ROV", 10.0, 0)


def test_the_newest_judgement_of_each_subject_is_shown(board):
    outcomes = [
        thruster(1, NOW_S - 2.0, score=0.1),
        thruster(2, NOW_S - 1.0, score=0.2),
        thruster(1, NOW_S, score=0.9),
    ]
    board.take(outcomes, NOW_S)
    assert subject(board, "thruster 1").score == 0.9 and subject(board, "thruster 2").score == 0.2


def test_a_subject_says_what_the_pilot_was_told_and_of_what_is_not_known_rather_why(board):
    board.take(
        [finding("thruster 1", Level.FAULT, "T1 entangled?"), finding("link can0", Level.FAULT, "No can0")], NOW_S
    )
    board.take([finding("thruster 1", Level.NORMAL, "T1 accepted", "operator")], NOW_S)
    board.levels = {"thruster 1": Level.FAULT, "link can0": Level.FAULT}
    assert subject(board, "thruster 1").text == "T1 entangled?" and subject(board, "link can0").text == "No can0"
    board.levels = {"thruster 1": Level.UNKNOWN}
    assert subject(board, "thruster 1").text == "T1 entangled?"
    board.take([thruster(1, NOW_S, Level.UNKNOWN, reason="learning")], NOW_S)
    assert subject(board, "thruster 1").text == "learning"


def test_findings_are_counted_by_level_and_notes_are_none(board):
    found = [finding("dvl", level, "") for level in (Level.FAULT, Level.NORMAL, Level.FAULT)]
    board.take(
        [*found, finding("dvl", Level.NORMAL, "", "operator"), finding("all", Level.NORMAL, "", "failsafe")], NOW_S
    )
    assert board.telemetry(NOW_S, Counts()).findings == {"FAULT": 2, "NORMAL": 1}


def test_the_newest_texts_are_kept(board):
    for n in range(12):
        board.take([StatusText(2, f"text {n}")], NOW_S + n)
    texts = board.telemetry(NOW_S + 12.0, Counts()).texts
    assert texts[0] == Said(10.0, 2, "text 2") and texts[-1] == Said(1.0, 2, "text 11") and len(texts) == 10


@pytest.mark.parametrize(
    ("age_s", "place"), [(-0.5, 0), (0.0, 0), (0.125, 3), (10.0, 12), (10.5, 13), (LATENCY_BOUNDS_S[2], 2)]
)
def test_latencies_are_counted_by_their_bounds(board, age_s, place):
    board.take([thruster(1, -age_s)], 0.0)
    telemetry = board.telemetry(0.0, Counts())
    assert [index for index, count in enumerate(telemetry.latency_counts) if count] == [place]
    assert len(telemetry.latency_counts) == len(telemetry.latency_bounds_s) + 1
    assert telemetry.latency_sum_s == max(0.0, age_s)


def link(name: str) -> SimpleNamespace:
    """One that counts."""
    drops = Counter({"wrong length": 3, "overflow": 1})
    return SimpleNamespace(
        name=name, received=7, drops=lambda: drops, decode_errors=lambda: Counter({"wrong length": 3})
    )


def test_links_are_shown_as_they_were_last_said_to_be(board):
    for reading in (
        LinkState(1.0, "can0", True, ""),
        BusLoad(1.0, "can0", 0.4),
        FrameLoss(1.0, "can0", 1, 0),
        LinkState(2.0, "can0", False, "bus-off"),
    ):
        board.hear(reading)
    can0, can1 = board.telemetry(NOW_S, Counts(links=[link("can0"), link("can1")])).links
    assert (can0.up, can0.detail, can0.load, can0.received) == (False, "bus-off", 0.4, 7)
    assert can0.drops == {"wrong length": 3, "overflow": 1} and can0.decode_errors == {"wrong length": 3}
    assert can1.up is None and isnan(can1.load)


def test_what_others_count_is_handed_through(board):
    counts = Counts((), {"control": Counter({"silent": 2})}, 0.3, {"thruster 1": Refits(2, 0.1)}, "1 file")
    telemetry = board.telemetry(NOW_S, counts)
    assert telemetry.drops == {"control": {"silent": 2}} and telemetry.behind_s == 0.3
    assert telemetry.refits == {"thruster 1": Refits(2, 0.1)} and telemetry.recording == "1 file"


def test_a_dive_on_the_board(config):
    pipeline = Pipeline(config, Factories(thruster=ThresholdDetector))
    board = TelemetryBoard("ROV", pipeline.subjects, START_S)
    board.take(play(pipeline, drive(9.0, fault_s=8.0)), START_S + 9.0)
    board.keep(pipeline)
    telemetry = board.telemetry(START_S + 9.0, Counts())
    shown = {one.subject: one for one in telemetry.subjects}
    assert shown["thruster 1"].level is Level.NORMAL and shown["thruster 2"].level is Level.FAULT
    assert shown["thruster 2"].score > 0.5 and shown["thruster 2"].text.startswith("T2 entangled?")
    assert shown["thruster 2"].values["residual_rpm"] < -100.0
    assert telemetry.texts[-1].text.startswith("T2 entangled?") and telemetry.findings["FAULT"] == 1
    assert sum(telemetry.latency_counts) > 400
    assert json.loads(json.dumps(table_of(telemetry)))["subjects"][1]["level"] == Level.FAULT


# How long learning takes


def test_blocks_in_which_a_model_is_learnt_are_measured(config):
    ticks = iter(range(10**6))
    stopwatch = Stopwatch(lambda: float(next(ticks)))  # a second for each block
    pipeline = Pipeline(config, Factories(thruster=ThrusterDetector), stopwatch.judge)
    learnt: defaultdict[str, list[int]] = defaultdict(list)
    arrivals = [Arrival(*one) for one in drive(10.5)]
    for begin in range(0, len(arrivals), 40):
        judged = [one for one in pipeline.take(arrivals[begin : begin + 40]) if isinstance(one, ThrusterJudgement)]
        for number, count in Counter(one.thruster for one in judged if one.verdict.refitted).items():
            learnt[f"thruster {number}"].append(count)
    assert len(learnt) == 2
    assert stopwatch.refits == {name: Refits(sum(counts), float(len(counts))) for name, counts in learnt.items()}
    assert over_the_disk(pipeline.learnt()).keys() == {"thruster 1", "thruster 2"}
