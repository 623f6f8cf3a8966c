"""What is found of links, sensors, buses and the gateway itself, through the whole pipeline."""

import re

import pytest

from detectors.verdict import Level
from drivers.mavlink.messages import StatusText
from drivers.readings import (
    AutopilotHeartbeat,
    BusLoad,
    FrameLoss,
    Lateness,
    ThrusterCommand,
    ThrusterReport,
)
from gateway.config import parse
from gateway.findings import Finding
from gateway.pipeline import Factories, Pipeline
from gateway.tests.conftest import TWO_THRUSTERS, ThresholdDetector

START_S = 1.7e9
STAND_INS = Factories(thruster=ThresholdDetector)
OWN_SENSOR = """
[[thruster]]
number = 3
command = { link = "mavlink", servo_channel = 4 }
rpm = { link = "mavlink", rpm_sensor = 1 }
"""


class Dive:
    """Twenty steps a second, of which a test leaves out what it wants."""

    def __init__(self, pipeline: Pipeline) -> None:
        self.pipeline = pipeline
        self.time_s = START_S
        self.outcomes: list = []

    def go(
        self,
        seconds: float,
        *,
        escs: tuple[int, ...] = (1, 2),
        speed_rpm: float | None = 1500.0,
        beats: bool = True,
        mavlink: bool = True,
    ) -> None:
        for step in range(round(20 * seconds)):
            time_s = self.time_s = self.time_s + 0.05
            can = [ThrusterCommand(time_s, 1, 0.5)]
            can += [ThrusterReport(time_s + 0.001, number, speed_rpm, voltage_v=16.0) for number in escs]
            self.hear("can0", *can)
            if mavlink:
                self.hear("mavlink", ThrusterCommand(time_s, 2, 0.5))
            if beats and step % 20 == 0:
                self.hear("mavlink", AutopilotHeartbeat(time_s, 1, 1, 3, 12, True, 19, 4))

    def hear(self, link: str, *readings: object) -> None:
        self.outcomes += self.pipeline.feed(link, list(readings))

    def texts(self) -> list[str]:
        """What was said since this was last asked, in whole seconds where it is about silence."""
        said = [one.text for one in self.outcomes if isinstance(one, StatusText) and one.severity < 6]
        self.outcomes = []
        return [re.sub(r"(silent|after) (\d+)\.\d", r"\1 \2", text) for text in said]


@pytest.fixture
def dive(config) -> Dive:
    dive = Dive(Pipeline(config, STAND_INS))
    dive.go(3.0)
    assert dive.texts() == []
    return dive


def test_an_autopilot_that_is_lost_while_others_speak_on_its_link(dive):
    dive.go(8.0, beats=False)
    assert dive.texts() == ["Autopilot silent 5 s"]
    assert dive.pipeline.levels()["autopilot"] is Level.SUSPECT
    assert dive.pipeline.levels()["link mavlink"] is Level.NORMAL
    dive.go(5.0)
    assert dive.texts() == ["Autopilot ok again: after 9 s"]
    assert dive.pipeline.levels()["autopilot"] is Level.NORMAL


def test_a_link_that_is_lost_is_said_and_not_that_its_autopilot_is_too(dive):
    dive.go(8.0, beats=False, mavlink=False)
    assert dive.texts() == ["mavlink silent 5 s"]
    assert dive.pipeline.levels()["autopilot"] is Level.NORMAL


def test_an_esc_that_is_lost_is_said_and_not_that_its_rpm_is_too(dive):
    dive.go(4.0, escs=(2,))
    assert dive.texts() == ["T1 ESC silent 1 s"]
    dive.go(4.0)
    assert dive.texts() == ["T1 ESC ok again: after 4 s"]
    assert dive.pipeline.levels()["thruster 1 rpm"] is Level.NORMAL


def test_an_esc_that_speaks_of_all_but_its_rpm(dive):
    dive.go(4.0, speed_rpm=None)
    assert dive.texts() == ["T1 RPM silent 1 s", "T2 RPM silent 1 s"]
    assert dive.pipeline.levels()["thruster 1 esc"] is Level.NORMAL
    dive.go(4.0, escs=())  # and then falls silent altogether: can0 still brings commands
    assert sorted(dive.texts()) == ["T1 ESC silent 1 s", "T2 ESC silent 1 s"]


def test_a_sensor_of_its_own_has_no_esc(tmp_path):
    dive = Dive(Pipeline(parse(TWO_THRUSTERS + OWN_SENSOR, tmp_path), STAND_INS))
    dive.go(8.0)
    assert sorted(dive.texts()) == ["T3 RPM silent 5 s", "T3 command silent 5 s"]


def findings(dive: Dive, subject: str) -> list[tuple[str, str]]:
    return [(f.level.name, f.text) for f in dive.outcomes if isinstance(f, Finding) and f.subject == subject]


def test_a_bus_that_carries_more_than_it_should(dive):
    for second in range(20):
        dive.hear("can0", BusLoad(dive.time_s, "can0", 0.83 if 5 <= second < 10 else 0.3))
        dive.go(1.0)
    assert findings(dive, "link can0 load") == [
        ("NORMAL", "can0 load ok: 30%"),
        ("SUSPECT", "can0 load 83%, limit 70%"),
        ("NORMAL", "can0 load ok again: 30%"),
    ]
    assert dive.texts() == ["can0 load 83%, limit 70%", "can0 load ok again: 30%"]


def test_the_limit_of_a_bus_is_its_own(tmp_path):
    text = TWO_THRUSTERS.replace('protocol = "dronecan"', 'protocol = "dronecan"\nload_max = 0.25')
    dive = Dive(Pipeline(parse(text, tmp_path), STAND_INS))
    dive.go(1.0)
    dive.hear("can0", BusLoad(dive.time_s, "can0", 0.3))
    dive.go(1.0)
    assert dive.texts() == ["can0 load 30%, limit 25%"]


@pytest.mark.parametrize(
    ("frames", "overruns", "said"),
    [
        (123, 0, "can0 lost 123 frames: machine too slow"),
        (4_000_000_000, 9, "can0 lost 4000000000 frames: machine too slow"),
        (0, 4, "can0 controller lost frames, 4 times"),
    ],
)
def test_frames_that_this_machine_loses_are_told(dive, frames, overruns, said):
    for second in range(12):
        lost = (frames, overruns) if 3 <= second < 6 else (0, 0)
        dive.hear("can0", FrameLoss(dive.time_s, "can0", *lost))
        dive.go(1.0)
    assert dive.texts() == [said, "can0: no frames lost any more"]
    assert dive.pipeline.levels()["link can0 frames"] is Level.NORMAL


@pytest.mark.parametrize(
    ("behind_s", "lost", "said"),
    [
        (3.14, 0, "Gateway 3.1 s behind: machine too busy"),
        (12.0, 4711, "Gateway lost 4711 readings: machine too busy"),
    ],
)
def test_a_gateway_that_is_late_says_so(dive, behind_s, lost, said):
    for second in range(12):
        late = 3 <= second < 6
        dive.hear("gateway", Lateness(dive.time_s, behind_s if late else 0.1, lost if late else 0))
        dive.go(1.0)
    assert dive.texts() == [said, "Gateway ok again"]
    assert dive.pipeline.levels()["gateway"] is Level.NORMAL


def test_a_program_that_stood_still_blames_nobody(dive):
    """Stopped, or on a machine that slept: what came meanwhile is not there, and nobody was silent."""
    dive.time_s += 8.0
    dive.go(3.0)
    assert dive.texts() == []


def test_streamed_commands_that_become_rare_are_told_as_that_and_once(dive):
    for step in range(20 * 10):
        time_s = dive.time_s = dive.time_s + 0.05
        dive.hear("can0", ThrusterCommand(time_s, 1, 0.5), ThrusterReport(time_s + 0.001, 1, 1500.0))
        dive.hear("can0", ThrusterReport(time_s + 0.002, 2, 1500.0))
        if step % 10 == 0:  # 2 Hz, where it was 20
            dive.hear(
                "mavlink", ThrusterCommand(time_s, 2, 0.5), AutopilotHeartbeat(time_s, 1, 1, 3, 12, True, 19, 4)
            )
    assert dive.texts() == ["Commands too rare to judge by"]
    dive.go(5.0)
    assert dive.texts() == ["Commands ok again: after 9 s"]
