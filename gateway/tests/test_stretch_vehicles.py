"""Stretches of a whole vehicle: thrusters over several links, speed, navigation, operators, buses in trouble.

All of it as columns comes to the findings of the same readings one by one, whatever the stretches' length.
"""

from __future__ import annotations

import math
import random
from dataclasses import replace

import pytest

from drivers.bus_readings import EscConflict, Health, NodeHealth, NodeMode
from drivers.readings import (
    Attitude,
    AutopilotHeartbeat,
    AutopilotReboot,
    BodyVelocity,
    FrameLoss,
    Inertial,
    LinkState,
    LocalPosition,
    OperatorAct,
    OperatorRequest,
    Reading,
    ThrusterCommand,
    ThrusterReport,
    WaterPressure,
)
from gateway.config import Config, parse
from gateway.findings import Finding
from gateway.pipeline import Arrival, Factories, Pipeline
from gateway.tests.conftest import (
    FULL_RPM,
    NAVIGATION_WATCH,
    SPEED_WATCH,
    TWO_THRUSTERS,
    CruiseDetector,
    GroundSpeedDetector,
    ThresholdDetector,
)
from gateway.tests.test_stretch import START_S, compare

SECOND_BUS = '[[can]]\nname = "can1"\ninterface = "virtual"\nchannel = "other"\nprotocol = "dronecan"\n\n[mavlink]'
THIRD = """
[[thruster]]
number = 3
ahead = 1
command = { link = "can0", esc_index = 2 }
rpm = { link = "can1", esc_index = 2 }
"""
FAKES = Factories(ThresholdDetector, GroundSpeedDetector, CruiseDetector)
COMMANDED = {1: "can0", 2: "mavlink", 3: "can0"}
MEASURED = {1: "can0", 2: "can0", 3: "can1"}
RATES_HZ = (20, 33, 50, 100)


@pytest.fixture(scope="module")
def vehicle(tmp_path_factory) -> Config:
    """The second thruster is commanded over MAVLink, the third one measured on another bus; rates are learnt."""
    text = TWO_THRUSTERS.replace("[mavlink]", SECOND_BUS, 1).replace("[align]\nsample_rate_hz = 50\n", "")
    return parse(text + THIRD + SPEED_WATCH + NAVIGATION_WATCH, tmp_path_factory.mktemp("config"))


class Dive:
    """What a vehicle says, by link; each link and thruster falls silent now and then, and times are uneven."""

    def __init__(self, seed: int, seconds: float) -> None:
        self._chance = chance = random.Random(seed)
        self._silent_s = {key: self._silences(seconds) for key in ("can0", "can1", "mavlink", 1, 2, 3, "imu")}
        self._held = {number: self._silences(seconds) for number in (1, 2, 3)}
        self.by_link: dict[str, list[Reading]] = {"can0": [], "can1": [], "mavlink": []}
        for number in (1, 2, 3):
            self._say(COMMANDED[number], seconds, chance.choice(RATES_HZ), lambda s, n=number: [self._command(s, n)])
            self._say(MEASURED[number], seconds, chance.choice(RATES_HZ), lambda s, n=number: self._report(s, n))
        self._say("mavlink", seconds, 10, self._motion)
        self._say("mavlink", seconds, 1, self._autopilot)
        for link in ("can0", "can1"):
            self._say(link, seconds, 0.3, lambda s, link=link: [self._trouble(s, link)])
        for link, readings in self.by_link.items():
            readings.sort(key=lambda reading: reading.time_s)
            self.by_link[link] = [self._disturbed(one) for one in readings]

    def _silences(self, seconds: float) -> list[tuple[float, float]]:
        lengths = (0.3, 1.0, 1.6, 2.2, 4.5, 8.0)
        starts = [self._chance.uniform(0.0, seconds) for _ in range(self._chance.randrange(4))]
        return [(start_s, start_s + self._chance.choice(lengths)) for start_s in starts]

    def _say(self, link: str, seconds: float, rate_hz: float, what) -> None:
        time_s = self._chance.uniform(0.0, 1.0 / rate_hz)
        while time_s < seconds:
            if not within(time_s, self._silent_s[link]):
                self.by_link[link] += what(time_s)
            time_s += self._chance.uniform(0.9, 1.1) / rate_hz

    def _command(self, time_s: float, number: int) -> Reading:
        return ThrusterCommand(START_S + time_s, number, fraction(time_s, number))

    def _report(self, time_s: float, number: int) -> list[Reading]:
        if within(time_s, self._silent_s[number]):
            return []
        share = 0.6 if within(time_s, self._held[number]) else 1.0
        rpm = None if self._chance.random() < 0.03 else share * FULL_RPM * fraction(time_s, number)
        volts = None if self._chance.random() < 0.3 else 16.0
        return [ThrusterReport(START_S + time_s, number, rpm, volts, 3.0)]

    def _motion(self, time_s: float) -> list[Reading]:
        now_s, boot_s = START_S + time_s, 60.0 + time_s
        said: list[Reading] = [Attitude(now_s, 0.0, 0.0, 0.5, 0.0, 0.0, 0.0, boot_s)]
        if not within(time_s, self._silent_s["imu"]):
            said.append(Inertial(now_s, boot_s, "raw_imu", (0.0, 0.0, -9.81), (0.0, 0.0, 0.0)))
        if self._chance.random() < 0.5:
            speed_mps = 1.3 if within(time_s, self._held[1]) else 1.0
            said.append(BodyVelocity(now_s, boot_s, (speed_mps, 0.0, 0.0), "vision_position_delta"))
            said.append(WaterPressure(now_s, boot_s, 2, 121_325.0, None))
        if self._chance.random() < 0.3:
            along_m = 0.8 * time_s
            said.append(LocalPosition(now_s, (along_m, 0.5 * along_m, 2.0), (0.8, 0.4, 0.0)))
        return said

    def _autopilot(self, time_s: float) -> list[Reading]:
        now_s, armed = START_S + time_s, self._chance.random() > 0.05
        said: list[Reading] = [AutopilotHeartbeat(now_s, 1, 1, 3, 12, armed, 19, 4)]
        if self._chance.random() < 0.05:
            act = self._chance.choice(list(OperatorAct))
            said.append(OperatorRequest(now_s, act, self._chance.randrange(5), 20.0, 255, 190))
        if self._chance.random() < 0.02:
            said.append(AutopilotReboot(now_s, 1))
        return said

    def _trouble(self, time_s: float, link: str) -> Reading:
        now_s = START_S + time_s
        return self._chance.choice(
            [
                LinkState(now_s, link, False, "bus-off"),
                LinkState(now_s, link, True, ""),
                LinkState(now_s, link, True, "error passive"),
                FrameLoss(now_s, link, 3, 0),
                NodeHealth(now_s, 11, self._chance.choice(list(Health)), NodeMode.OPERATIONAL, 100, (1,)),
                EscConflict(now_s, 1, 0, (11, 12), None),
            ]
        )

    def _disturbed(self, reading: Reading) -> Reading:
        """Once in a while a time is a little wrong, or far off."""
        wrong_s = self._chance.choice((-0.5, -0.004, 700.0)) if self._chance.random() < 0.0003 else 0.0
        return replace(reading, time_s=reading.time_s + wrong_s)


def within(time_s: float, spans: list[tuple[float, float]]) -> bool:
    return any(begin_s <= time_s < end_s for begin_s, end_s in spans)


def fraction(time_s: float, number: int) -> float:
    return 0.5 + 0.4 * math.sin((0.2 + 0.1 * number) * time_s)


@pytest.mark.parametrize("length_s", [1.0, 5.0, 60.0])
@pytest.mark.parametrize("seed", range(6))
def test_a_vehicle_over_three_links(vehicle, seed, length_s):
    compare(vehicle, Dive(seed, 30.0).by_link, length_s, FAKES)


class LearningDetector(ThresholdDetector):
    """It learns anew what it is told to accept."""

    def accept(self) -> None:
        super().accept()
        self.samples = 0


ACCEPTING = Factories(LearningDetector, GroundSpeedDetector, CruiseDetector)


@pytest.mark.parametrize("seed", range(3))
def test_what_an_operator_accepts_is_what_was_so_far(vehicle, seed):
    """And not what the stretch still brings."""
    by_link = Dive(seed, 30.0).by_link
    by_link["mavlink"] += [accepted(time_s) for time_s in (16.0, 24.0)]
    by_link["mavlink"].sort(key=lambda reading: reading.time_s)
    lines, _, _ = compare(vehicle, by_link, 20.0, ACCEPTING)
    assert sum('"operator"' in line for line in lines) >= 2


def test_a_batch_with_a_word_that_accepts_is_its_readings_one_by_one(vehicle):
    readings = [one for n in range(1000) for one in said(n)]
    readings[1500:1500] = [accepted(15.0)]
    whole, single = Pipeline(vehicle, ACCEPTING), Pipeline(vehicle, ACCEPTING)
    together = whole.take([Arrival("can0", readings[:1000]), Arrival("can0", readings[1000:])])
    one_by_one = [one for reading in readings for one in single.take([Arrival("can0", [reading])])]
    assert [one for one in together if isinstance(one, Finding)] == [
        one for one in one_by_one if isinstance(one, Finding)
    ]
    assert repr(whole.newest) == repr(single.newest)


def test_with_all_real_detectors(vehicle):
    lines, levels, _ = compare(vehicle, Dive(100, 30.0).by_link, 7.0, Factories())
    assert lines
    assert {"thruster 3", "vehicle"} & set(levels)


def said(n: int) -> list[Reading]:
    """Command and report of the first thruster, which is held back from 12 s on."""
    time_s, share = 0.02 * n, 1.0 if n < 600 else 0.7
    return [
        ThrusterCommand(START_S + time_s, 1, fraction(time_s, 1)),
        ThrusterReport(START_S + time_s + 0.004, 1, share * FULL_RPM * fraction(time_s, 1), 16.0, 3.0),
    ]


def accepted(time_s: float) -> Reading:
    return OperatorRequest(START_S + time_s, OperatorAct.ACCEPT, 0, 0.0, 255, 190)
