"""Readings as columns come to the findings, the levels and the drops of the same readings one by one."""

from __future__ import annotations

import math
import random
from collections import defaultdict
from dataclasses import replace

import numpy as np
import pytest

from drivers.reading_block import CommandColumns, ReadingBlock, ReportColumns
from drivers.readings import Attitude, AutopilotHeartbeat, LocalPosition, ThrusterCommand, ThrusterReport
from gateway.channel import Judgement
from gateway.config import Config, parse
from gateway.findings import Finding
from gateway.pipeline import Arrival, Factories, Pipeline
from gateway.stretches.stretch import BlockArrival, Stretch
from gateway.tests.conftest import FULL_RPM, TWO_THRUSTERS, GroundSpeedDetector, ThresholdDetector
from gateway.thruster_channel import JudgedColumns

START_S = 1.7e9
RATE_HZ = 50
UNKNOWN = math.nan


def block(readings: list) -> ReadingBlock:
    """Each reading in a row of its own."""
    commands, reports, others = defaultdict(list), defaultdict(list), []
    for row, reading in enumerate(readings):
        match reading:
            case ThrusterCommand():
                commands[reading.thruster].append((row, reading.time_s, reading.fraction))
            case ThrusterReport():
                measured = (reading.speed_rpm, reading.voltage_v, reading.current_a)
                numbers = [UNKNOWN if one is None else one for one in measured]
                reports[reading.thruster].append((row, reading.time_s, *numbers, UNKNOWN, UNKNOWN))
            case _:
                others.append((row, reading))
    return ReadingBlock(
        tuple(CommandColumns(number, *columns(rows)) for number, rows in sorted(commands.items())),
        tuple(ReportColumns(number, *columns(rows)) for number, rows in sorted(reports.items())),
        tuple(others),
    )


def columns(rows: list) -> list[np.ndarray]:
    first, *rest = (np.array(column) for column in zip(*rows, strict=True))
    return [first.astype(np.intp), *(column.astype(float) for column in rest)]


def dive(seed: int, seconds: float) -> dict[str, list]:
    """Readings by link: two thrusters, the second commanded over MAVLink; faults, silences, wrong times."""
    chance = random.Random(seed)
    by_link = {"can0": [], "mavlink": []}
    share, silent_until_s = {1: 1.0, 2: 1.0}, {"can0": 0.0, "mavlink": 0.0, 1: 0.0, 2: 0.0}
    for n in range(round(seconds * RATE_HZ)):
        time_s = START_S + n / RATE_HZ
        if chance.random() < 0.01:
            share[chance.choice((1, 2))] = chance.choice((1.0, 1.0, 0.8, 0.5))
        if chance.random() < 0.004:
            silent_until_s[chance.choice(list(silent_until_s))] = time_s + chance.choice((0.2, 1.0, 2.5, 4.0))
        speeds = [speed(time_s, number, share[number], chance) for number in (1, 2)]
        happened = {
            "can0": [ThrusterCommand(time_s, 1, fraction(time_s))]
            + [one for one in speeds if time_s >= silent_until_s[one.thruster]],
            "mavlink": telemetry(n, time_s + 0.006, chance),
        }
        for link, readings in happened.items():
            if time_s >= silent_until_s[link]:
                by_link[link] += [late(reading, chance) for reading in readings]
    return by_link


def fraction(time_s: float) -> float:
    return math.sin(0.3 * (time_s - START_S))


def speed(time_s: float, thruster: int, share: float, chance: random.Random) -> ThrusterReport:
    rpm = None if chance.random() < 0.02 else share * FULL_RPM * fraction(time_s)
    return ThrusterReport(time_s + 0.004, thruster, rpm, None if chance.random() < 0.3 else 16.0)


def telemetry(n: int, time_s: float, chance: random.Random) -> list:
    along_m = 0.8 * (time_s - START_S)
    due = {
        3: ThrusterCommand(time_s, 2, fraction(time_s)),
        5: Attitude(time_s, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0),
        10: LocalPosition(time_s, (along_m, 0.5 * along_m, 2.0), (0.8, 0.4, 0.0)),
        RATE_HZ: AutopilotHeartbeat(time_s, 1, 1, 3, 12, chance.random() > 0.05, 19, 4),
    }
    return [reading for every, reading in due.items() if n % every == 0]


def late(reading, chance: random.Random):
    """Once in a while a reading comes with a time that cannot be."""
    wrong_s = chance.choice((-0.5, -0.004, 700.0)) if chance.random() < 0.0005 else 0.0
    return replace(reading, time_s=reading.time_s + wrong_s)


def stretches(by_link: dict[str, list], length_s: float) -> list[list[BlockArrival]]:
    """Cut in time; a reading stays with those before it on its link."""
    cut = defaultdict(lambda: defaultdict(list))
    for link, readings in by_link.items():
        latest = 0
        for reading in readings:
            latest = max(latest, int((reading.time_s - START_S) // length_s))
            cut[latest][link].append(reading)
    return [[BlockArrival(link, block(cut[n][link])) for link in by_link] for n in sorted(cut)]


def outcome(pipeline: Pipeline, outcomes: list) -> tuple:
    lines = [one.json_line() for one in outcomes if isinstance(one, Finding)]
    return lines, pipeline.levels(), pipeline.drops()


class Seen:
    """Time, level and score of every judgement that is shown, by whom it is of."""

    def __init__(self) -> None:
        self.judgements: defaultdict[object, list[tuple]] = defaultdict(list)

    def __call__(self, shown: JudgedColumns | Judgement) -> None:
        if isinstance(shown, JudgedColumns):
            for row in range(len(shown.samples.time_s)):
                self(shown.judgement(row))
        else:
            said = shown.verdict
            key = getattr(shown, "thruster", type(shown))
            self.judgements[key].append((shown.sample.time_s, said.level, round(said.score, 12)))


def compare(config: Config, by_link: dict[str, list], length_s: float, factories: Factories) -> tuple:
    quiet = replace(config, mavlink=config.mavlink.model_copy(update={"named_values_period_s": 0.0}))
    slow, fast = Pipeline(quiet, factories), Pipeline(quiet, factories)
    singles, blocks = [], []
    seen_slow, seen_fast = Seen(), Seen()
    for arrivals in stretches(by_link, length_s):
        for _, link, reading in Stretch.of(arrivals).readings():
            singles += slow.take([Arrival(link, [reading])], seen_slow)
        blocks += fast.take_stretch(arrivals, seen_fast)
    assert outcome(fast, blocks) == outcome(slow, singles)
    assert [one for one in blocks if not hasattr(one, "verdict")] == [
        one for one in singles if not hasattr(one, "verdict")
    ]
    assert repr(fast.newest) == repr(slow.newest)  # a NaN is no other NaN
    assert seen_fast.judgements == seen_slow.judgements
    assert sum(map(len, seen_slow.judgements.values())) == sum(hasattr(one, "verdict") for one in singles)
    return outcome(slow, singles)


@pytest.fixture(scope="module")
def config_once(tmp_path_factory):
    return parse(TWO_THRUSTERS, tmp_path_factory.mktemp("config"))


FAKES = Factories(thruster=ThresholdDetector, speed=GroundSpeedDetector)


@pytest.mark.parametrize("length_s", [0.3, 2.0, 60.0])
@pytest.mark.parametrize("seed", range(7, 11))
def test_a_stretch_is_its_readings_one_by_one(config_once, seed, length_s):
    compare(config_once, dive(seed, 30.0), length_s, FAKES)


def test_such_dives_have_something_to_find(config_once):
    lines = [line for seed in range(4) for line in compare(config_once, dive(seed, 30.0), 7.0, FAKES)[0]]
    for word in ('"thruster 1", "level": "FAULT"', '"signal"', '"link"', "ok again"):
        assert any(word in line for line in lines), word


def test_with_the_real_detector_and_the_speed_watch(speed_config):
    compare(speed_config, dive(3, 60.0), 10.0, Factories())


def test_a_stretch_whose_times_run_backwards_within_a_link_keeps_its_order():
    readings = [ThrusterCommand(2.0, 1, 0.1), ThrusterCommand(1.0, 1, 0.2), ThrusterCommand(3.0, 1, 0.3)]
    stretch = Stretch.of([BlockArrival("can0", block(readings)), BlockArrival("can1", block(readings[1:2]))])
    assert [reading.fraction for _, _, reading in stretch.readings()] == [0.2, 0.1, 0.2, 0.3]
    assert [link for _, link, _ in stretch.readings()] == ["can1", "can0", "can0", "can0"]


@pytest.mark.parametrize("arrivals", [[], [BlockArrival("can0", ReadingBlock())]])
def test_of_nothing_comes_nothing(config_once, arrivals):
    assert Pipeline(config_once, FAKES).take_stretch(arrivals) == []
