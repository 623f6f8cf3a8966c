"""What is collected while a dive is judged is what its detectors have said, and what its links have done."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from detectors.thruster import ThrusterDetector
from detectors.verdict import Level
from drivers.reading_block import CommandColumns, ReadingBlock, ReportColumns
from drivers.readings import (
    Attitude,
    AutopilotHeartbeat,
    BusLoad,
    FrameLoss,
    LinkState,
    LocalPosition,
    OperatorAct,
    OperatorRequest,
    Reading,
)
from gateway.channel import ThrusterJudgement
from gateway.config import Config, parse
from gateway.pipeline import Pipeline
from gateway.replay.result import ReplayResult
from gateway.report.collecting import Collecting
from gateway.report.dive import Dive, LinkCourse
from gateway.stretches.stretch import BlockArrival
from gateway.thruster_channel import JudgedColumns

START_S = 1_700_000_000.0
RATE_HZ, FULL_RPM = 50.0, 3000.0
CONFIG = """
[vehicle]
name = "Test vehicle"

[[can]]
name = "can0"
interface = "virtual"
channel = "gateway tests"
protocol = "dronecan"

[mavlink]
endpoint = "udpin:127.0.0.1:0"

[[thruster]]
number = 1
ahead = 1
command = { link = "can0", esc_index = 0 }
rpm = { link = "can0", esc_index = 0 }

[[thruster]]
number = 2
ahead = 1
command = { link = "mavlink", servo_channel = 3 }
rpm = { link = "can0", esc_index = 1 }

[align]
sample_rate_hz = 50

[speed]
position = "local"
"""
HEARTBEAT = AutopilotHeartbeat(START_S, 1, 1, 3, 12, armed=True, custom_mode=19, system_status=4)


@pytest.fixture(scope="module")
def config(tmp_path_factory: pytest.TempPathFactory) -> Config:
    return parse(CONFIG, tmp_path_factory.mktemp("config"))


def steering(time_s: np.ndarray) -> np.ndarray:
    return 0.5 + 0.3 * np.sign(np.sin(0.4 * (time_s - START_S))) + 0.1 * np.sin(1.3 * (time_s - START_S))


def thruster_block(from_s: float, to_s: float) -> ReadingBlock:
    """Thruster 1 over [from, to): its commands, and its speeds, which halve at 40 s."""
    time_s = START_S + np.arange(round(from_s * RATE_HZ), round(to_s * RATE_HZ)) / RATE_HZ
    chance = np.random.default_rng(int(from_s))
    share = np.where(time_s < START_S + 40.0, 1.0, 0.5)
    speed_rpm = FULL_RPM * share * steering(time_s) + chance.normal(0.0, 3.0, len(time_s))
    row, unknown = 2 * np.arange(len(time_s)), np.full(len(time_s), np.nan)
    return ReadingBlock(
        (CommandColumns(1, row, time_s, steering(time_s)),),
        (ReportColumns(1, row + 1, time_s + 0.004, speed_rpm, unknown, unknown, unknown, unknown),),
    )


def telemetry(from_s: float, to_s: float) -> list[Reading]:
    """The vehicle goes north; armed in MANUAL, and from 30 s on in ALT_HOLD."""
    found: list[Reading] = []
    for n in range(round(5.0 * from_s), round(5.0 * to_s)):
        time_s = START_S + 0.001 + n / 5.0
        found += [Attitude(time_s, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0)]
        found += [LocalPosition(time_s + 0.002, (0.16 * n, 0.0, 3.0), (0.8, 0.0, 0.0))]
        if n % 5 == 0:
            mode = 19 if n < 150 else 2
            found.append(replace(HEARTBEAT, time_s=time_s + 0.003, custom_mode=mode))
    return found


def stretches(seconds: float, length_s: float = 10.0) -> list[list[BlockArrival]]:
    edges = np.arange(0.0, seconds, length_s)
    return [
        [
            BlockArrival("can0", thruster_block(edge, edge + length_s)),
            BlockArrival("mavlink", ReadingBlock.of(telemetry(edge, edge + length_s))),
        ]
        for edge in edges.tolist()
    ]


def collected(config: Config, several: Sequence[Sequence[BlockArrival]]) -> Dive:
    collecting, pipeline, result = Collecting(config), Pipeline(config), ReplayResult()
    for arrivals in several:
        collecting.stretch(arrivals)
        pipeline.take_stretch(arrivals, collecting.seen)
        result.cover(arrivals)
    collecting.end(pipeline)
    return collecting.dive(result, [], ["can.log"])


def links_of(config: Config, several: Sequence[Sequence[BlockArrival]]) -> Sequence[LinkCourse]:
    """Nothing need be judged for it."""
    collecting, result = Collecting(config), ReplayResult()
    for arrivals in several:
        collecting.stretch(arrivals)
        result.cover(arrivals)
    return collecting.dive(result, [], []).links


@pytest.fixture(scope="module")
def dive(config: Config) -> Dive:
    return collected(config, stretches(60.0))


def test_a_thruster_has_the_columns_of_its_detector(config: Config, dive: Dive) -> None:
    shown: list[JudgedColumns | object] = []
    pipeline = Pipeline(config)
    for arrivals in stretches(60.0):
        pipeline.take_stretch(arrivals, shown.append)
    samples = [one.samples for one in shown if isinstance(one, JudgedColumns)]
    detector = ThrusterDetector(replace(config.detector.thruster, seed=config.detector.thruster.seed + 1))
    names = ("time_s", "command", "speed_rpm", "voltage_v", "current_a")
    said = detector.run(*(np.concatenate([getattr(one, name) for one in samples]) for name in names))
    (course,) = dive.thrusters
    np.testing.assert_array_equal(course.time_s + dive.begin_s, said.time_s)
    for name in ("predicted_rpm", "residual_rpm", "threshold_rpm", "score", "level"):
        np.testing.assert_array_equal(getattr(course, name), getattr(said, name))
    assert course.level.max() == Level.FAULT
    np.testing.assert_array_equal(course.refit_s + dive.begin_s, said.time_s[said.refitted])


def test_what_is_judged_one_by_one_is_the_same(config: Config, dive: Dive) -> None:
    act = OperatorRequest(START_S, OperatorAct.ACCEPT, 0, 0.0, 0, 0)  # a stretch with one is not judged as columns
    several = stretches(60.0)
    for n, (can0, mavlink) in enumerate(several):
        time_s = START_S + 10.0 * n
        others = [replace(act, code=99, time_s=time_s), *telemetry(10.0 * n, 10.0 * n + 10.0)]
        several[n] = [can0, BlockArrival(mavlink.link, ReadingBlock.of(others))]
    alone = collected(config, several)
    for name in ("time_s", "command", "speed_rpm", "predicted_rpm", "score", "level", "refit_s"):
        np.testing.assert_allclose(getattr(alone.thrusters[0], name), getattr(dive.thrusters[0], name), rtol=1e-9)
    assert alone.speed is not None
    assert dive.speed is not None
    np.testing.assert_array_equal(alone.speed.speed_mps, dive.speed.speed_mps)


def test_the_learnt_curve_is_there_beside_the_commissioned_one(dive: Dive) -> None:
    (course,) = dive.thrusters
    assert course.curve is not None
    assert course.commissioned is not None
    near = np.abs(course.curve.command - 0.6).argmin()
    healthy = FULL_RPM * course.curve.command[near]
    assert course.curve.speed_rpm[near] == pytest.approx(healthy, rel=0.05)
    assert np.isnan(course.commissioned.error_rpm).all()


def test_speed_and_track(dive: Dive) -> None:
    course = dive.speed
    assert course is not None
    assert course.north_m[-1] == pytest.approx(0.16 * 299, abs=1.0)
    assert course.flow_mps.shape == (len(course.time_s), 2)
    assert np.isfinite(course.speed_mps[-1])
    assert 0.0 <= course.time_s[0] < 2.0


def test_modes_by_their_names_and_when_it_was_armed(dive: Dive) -> None:
    assert [mode for _, mode in dive.modes] == ["MANUAL", "ALT_HOLD"]
    assert dive.modes[1][0] == pytest.approx(30.0, abs=0.01)
    np.testing.assert_allclose(dive.armed, [[0.004, 59.004]], atol=0.01)


def test_there_is_no_course_of_what_never_came(dive: Dive) -> None:
    assert [one.number for one in dive.thrusters] == [1]
    assert dive.navigation is None
    assert [one.name for one in dive.links] == ["can0", "mavlink"]


def test_a_link_second_by_second(config: Config) -> None:
    several = stretches(60.0)
    can0 = [BlockArrival("can0", thruster_block(edge, edge + 10.0)) for edge in (0.0, 10.0, 30.0, 40.0, 50.0)]
    told = [
        BusLoad(START_S + 12.9, "can0", 0.31),
        FrameLoss(START_S + 13.0, "can0", 7, 0),
        LinkState(START_S + 41.0, "can0", up=False, detail="bus-off"),
        LinkState(START_S + 43.5, "can0", up=True, detail=""),
    ]
    heard = ([can0[0]], [can0[1]], [], *([one] for one in can0[2:]))
    several = [[*one, part[1]] for one, part in zip(heard, several, strict=True)]
    several[1][0] = BlockArrival("can0", replace(several[1][0].readings, others=((0, told[0]), (1, told[1]))))
    several[4][0] = BlockArrival("can0", replace(several[4][0].readings, others=((0, told[2]), (1, told[3]))))
    link = links_of(config, several)[0]
    seconds = np.floor(link.time_s).astype(int)
    by_second = dict(zip(seconds.tolist(), link.readings_per_s.tolist(), strict=True))
    assert by_second[5] == by_second[55] == 100.0
    assert by_second[20] == by_second[29] == 0.0
    assert link.load[seconds == 12] == pytest.approx(0.31)
    assert np.isnan(link.load[seconds == 5]).all()
    assert link.lost.sum() == 7
    np.testing.assert_allclose(link.down, [[20.0, 30.0], [41.0, 43.5]], atol=0.05)


@pytest.mark.parametrize(("up_s", "down"), [(0.5, []), (3.0, [[0.0, 3.0]])])
def test_a_link_that_comes_up_for_the_first_time_was_not_lost(
    config: Config, up_s: float, down: list[list[float]]
) -> None:
    block = thruster_block(up_s, 10.0)
    told = [
        LinkState(START_S, "can0", up=False, detail="no frames yet"),
        LinkState(START_S + up_s, "can0", up=True, detail=""),
    ]
    (link,) = links_of(config, [[BlockArrival("can0", replace(block, others=((0, told[0]), (1, told[1]))))]])
    assert link.down.tolist() == down


def test_a_pause_of_the_recording_is_no_lost_link(config: Config) -> None:
    several = stretches(60.0)
    assert [one.down.tolist() for one in links_of(config, [*several[:2], *several[4:]])] == [[], []]


def test_nothing_at_all(config: Config) -> None:
    empty = collected(config, [])
    assert (empty.thrusters, empty.links, empty.speed, empty.modes) == ((), (), None, ())
    assert empty.begin_s == empty.end_s == 0.0
    assert len(empty.armed) == 0


def test_thrusters_of_a_second_run_keep_what_the_first_has_learnt(config: Config) -> None:
    collecting, pipeline = Collecting(config), Pipeline(config)
    for arrivals in stretches(40.0):
        pipeline.take_stretch(arrivals, collecting.seen)
    collecting.end(pipeline)
    collecting.end(Pipeline(config))
    (course,) = collecting.dive(ReplayResult(), [], []).thrusters
    assert course.curve is not None


def test_one_judgement_alone(config: Config) -> None:
    collecting, pipeline = Collecting(config), Pipeline(config)
    shown: list[object] = []
    pipeline.take_stretch(stretches(10.0)[0], shown.append)
    (columns,) = (one for one in shown if isinstance(one, JudgedColumns))
    alone = columns.judgement(3)
    assert isinstance(alone, ThrusterJudgement)
    collecting.seen(alone)
    (course,) = collecting.dive(ReplayResult(), [], []).thrusters
    assert course.time_s.tolist() == [alone.sample.time_s]
    assert course.level.tolist() == [int(alone.verdict.level)]
    assert math.isnan(course.predicted_rpm[0])
