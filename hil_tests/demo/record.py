"""What the gateway judged, the autopilot received and the rig did in a demonstration."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from math import nan

from detectors.navigation import ImuSample, NavigationSample, NavigationVerdict, Sensor
from detectors.speed.sample import PoseSample, SpeedVerdict
from detectors.thruster.sample import ThrusterSample, ThrusterVerdict
from detectors.verdict import Level
from gateway.sensor_observations import SUBJECTS
from hil_tests.rig.ardusub import Mode
from hil_tests.rig.commands import Command
from hil_tests.rig.notes import Notes, ReceivedCommand, ReceivedText

WARNING = 4  # MAV_SEVERITY: from here on upwards (smaller numbers) a text is an alarm
CRITICAL_STATE = 5  # MAV_STATE_CRITICAL
# Subjects; the others are "thruster 1" and so on.
SPEED, DVL = "speed", SUBJECTS[Sensor.DVL]
SENSORS = {subject: sensor for sensor, subject in SUBJECTS.items()}
# By what a text for the pilot speaks of them.
NAMES = {
    SPEED: r"^Speed\b",
    DVL: r"\bDVL\b",
    "depth sensor": r"\b[Dd]epth\b",
    "gyroscope": r"\b[Gg]yro",
    "accelerometer": r"\b[Aa]ccel",
}


@dataclass(frozen=True, slots=True)
class Judged:
    """One sample of one thruster and what the detector said of it."""

    sample: ThrusterSample
    verdict: ThrusterVerdict


@dataclass(frozen=True, slots=True)
class JudgedSpeed:
    """Where the vehicle was said to be, and what the speed detector said of it."""

    sample: PoseSample
    verdict: SpeedVerdict


@dataclass(frozen=True, slots=True)
class JudgedNavigation:
    """One sample of a navigation sensor, and what the detector said after it."""

    sample: NavigationSample
    verdict: NavigationVerdict


@dataclass(slots=True)
class Recording:
    """Every sample and verdict, in order of time.

    Attributes:
        judged: of thrusters, by the thruster's number.
        speed: of the vehicle's speed.
        navigation: of the navigation sensors.
        latest_s: how long after its own time a sample was judged, at worst.
    """

    judged: dict[int, list[Judged]] = field(default_factory=dict)
    speed: list[JudgedSpeed] = field(default_factory=list)
    navigation: list[JudgedNavigation] = field(default_factory=list)
    latest_s: float = 0.0

    def add(self, thruster: int, judged: Judged, time_s: float) -> None:
        """Append what the gateway saw of a thruster and said, and when it did."""
        self.judged.setdefault(thruster, []).append(judged)
        self.latest_s = max(self.latest_s, time_s - judged.sample.time_s)

    def add_speed(self, judged: JudgedSpeed, time_s: float) -> None:
        """Append what the gateway saw of the vehicle's way and said, and when it did."""
        self.speed.append(judged)
        self.latest_s = max(self.latest_s, time_s - judged.sample.time_s)

    def add_navigation(self, judged: JudgedNavigation, time_s: float) -> None:
        """Append what the gateway saw of a navigation sensor and said, and when it did."""
        self.navigation.append(judged)
        if isinstance(judged.sample, ImuSample):  # all others wait for the next of these
            self.latest_s = max(self.latest_s, time_s - judged.sample.time_s)

    def latest(self) -> dict[int, Judged]:
        """The newest of every thruster, by its number."""
        return {thruster: history[-1] for thruster, history in sorted(self.judged.items())}

    def counts(self) -> dict[str, int]:
        """How much there is."""
        return {
            "samples judged": sum(len(history) for history in self.judged.values()),
            "positions judged": len(self.speed),
            "navigation samples judged": len(self.navigation),
        }

    def subjects(self) -> list[str]:
        """All that were judged."""
        return [*(f"thruster {number}" for number in self.judged), SPEED, *SENSORS]

    def levels(self, subject: str) -> Iterator[tuple[float, Level]]:
        """Times and levels of a subject."""
        if subject in SENSORS:
            sensor = SENSORS[subject]
            return ((one.sample.time_s, one.verdict.of(sensor).level) for one in self.navigation)
        if subject == SPEED:
            return ((one.sample.time_s, one.verdict.level) for one in self.speed)
        history = self.judged.get(int(subject.removeprefix("thruster ")), [])
        return ((one.sample.time_s, one.verdict.level) for one in history)

    def first_fault_s(self, subject: str, since_s: float) -> float:
        """When a detector first said FAULT of a subject from a time on; NaN if it never did."""
        faults_s = (time_s for time_s, level in self.levels(subject) if level is Level.FAULT)
        return next((time_s for time_s in faults_s if time_s >= since_s), nan)


def names(text: str, subject: str) -> bool:
    """Whether a text for the pilot speaks of a subject."""
    pattern = NAMES.get(subject, rf"\bT{subject.removeprefix('thruster ')}\b")
    return re.search(pattern, text) is not None


@dataclass(frozen=True, slots=True)
class Trouble:
    """Something that the rig does to the vehicle and the gateway is to find.

    Attributes:
        subject: what it harms: "thruster 3", "speed" or "dvl".
        catches, shows: its two instants, in words.
        onset_s: when it begins.
        shown_s: when it first shows; NaN: never.
    """

    subject: str
    catches: str
    shows: str
    onset_s: float
    shown_s: float

    def explains(self, text: ReceivedText) -> bool:
        """Whether an alarm speaks of this."""
        return names(text.text, self.subject) and text.time_s >= self.onset_s


@dataclass(frozen=True, slots=True)
class Truth:
    """What the rig does.

    Attributes:
        troubles: what is to be found.
        events: what is not, as pairs of a time and words for it; times to come among them.
    """

    troubles: tuple[Trouble, ...]
    events: tuple[tuple[float, str], ...] = ()


@dataclass(frozen=True, slots=True)
class Happening:
    """One line of the log that is shown; `alarm` if the pilot would be alarmed by it."""

    time_s: float
    text: str
    alarm: bool = False


def happenings(notes: Notes, truth: Truth, now_s: float) -> list[Happening]:
    """What is worth showing, as far as it has happened, in order of time."""
    found = [Happening(text.time_s, f'STATUSTEXT "{text.text}"', text.severity <= WARNING) for text in notes.texts]
    found += [
        Happening(one.time_s, _in_words(one), alarm=True) for one in notes.commands if one.command in set(Command)
    ]
    found += _heartbeat_changes(notes)
    shown = [(trouble.shown_s, trouble.shows) for trouble in truth.troubles]
    past = [(time_s, text) for time_s, text in [*shown, *truth.events] if time_s <= now_s]
    found += [Happening(time_s, f"(rig) {text}") for time_s, text in past]
    return sorted(found, key=lambda happening: happening.time_s)


def _heartbeat_changes(notes: Notes) -> Iterable[Happening]:
    critical = False
    for heartbeat in list(notes.heartbeats):
        if (heartbeat.system_status == CRITICAL_STATE) is not critical:
            critical = not critical
            word = "CRITICAL" if critical else "no longer CRITICAL"
            yield Happening(heartbeat.time_s, f"HEARTBEAT of component {heartbeat.component_id}: {word}", critical)


def _in_words(command: ReceivedCommand) -> str:
    name = Command(command.command).name
    if command.command == Command.DO_SET_MODE and command.parameters[1] in set(Mode):
        name += f" {Mode(int(command.parameters[1])).name}"
    answer = "not answered" if command.result is None else f"answered {command.result.name}"
    return f"COMMAND_LONG {name}: {answer}"
