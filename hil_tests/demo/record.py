"""What the gateway judged, the autopilot received and the rig did in a demonstration, and the summary of it."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from math import inf, nan

from detectors.thruster.sample import ThrusterSample, ThrusterVerdict
from detectors.verdict import Level
from hil_tests.rig.ardusub import Command, Mode
from hil_tests.rig.autopilot import Notes, ReceivedCommand, ReceivedText

WARNING = 4  # MAV_SEVERITY: from here on upwards (smaller numbers) a text is an alarm
CRITICAL_STATE = 5  # MAV_STATE_CRITICAL
NAMES_THRUSTER = re.compile(r"\bT(\d+)\b")


@dataclass(frozen=True, slots=True)
class Judged:
    """One sample of one thruster and what the detector said of it."""

    sample: ThrusterSample
    verdict: ThrusterVerdict


@dataclass(slots=True)
class Recording:
    """Every sample and verdict by thruster, in order of time.

    Attributes:
        judged: by the thruster's number.
        latest_s: how long after its own time a sample was judged, at worst.
    """

    judged: dict[int, list[Judged]] = field(default_factory=dict)
    latest_s: float = 0.0

    def add(self, thruster: int, judged: Judged, time_s: float) -> None:
        """Append what the gateway saw and said, and when it did."""
        self.judged.setdefault(thruster, []).append(judged)
        self.latest_s = max(self.latest_s, time_s - judged.sample.time_s)

    def latest(self) -> dict[int, Judged]:
        """The newest of every thruster, by its number."""
        return {thruster: history[-1] for thruster, history in sorted(self.judged.items())}

    def counts(self) -> dict[str, int]:
        """How much there is."""
        return {"samples judged": sum(len(history) for history in self.judged.values())}

    def first_fault_s(self, thruster: int, since_s: float) -> float:
        """When the detector first said FAULT of a thruster from a time on; NaN if it never did."""
        faults = (one for one in self.judged.get(thruster, ()) if one.verdict.level is Level.FAULT)
        return next((one.sample.time_s for one in faults if one.sample.time_s >= since_s), nan)


@dataclass(frozen=True, slots=True)
class Truth:
    """What the rig really did.

    Attributes:
        thruster: the one that got entangled.
        onset_s: when weeds began to catch.
        shown_s: when its speed first differed visibly from a healthy one's; NaN: never.
    """

    thruster: int
    onset_s: float
    shown_s: float

    def explains(self, text: ReceivedText) -> bool:
        """Whether an alarm speaks of the fault that was there."""
        named = NAMES_THRUSTER.search(text.text)
        return named is not None and int(named[1]) == self.thruster and text.time_s >= self.onset_s


@dataclass(frozen=True, slots=True)
class Happening:
    """One line of the log that is shown; `alarm` if the pilot would be alarmed by it."""

    time_s: float
    text: str
    alarm: bool = False


def happenings(notes: Notes, truth: Truth) -> list[Happening]:
    """What is worth showing, as far as it has happened, in order of time."""
    found = [Happening(text.time_s, f'STATUSTEXT "{text.text}"', text.severity <= WARNING) for text in notes.texts]
    found += [
        Happening(one.time_s, _in_words(one), alarm=True) for one in notes.commands if one.command in set(Command)
    ]
    found += _heartbeat_changes(notes)
    if truth.shown_s == truth.shown_s:
        found.append(Happening(truth.shown_s, f"(rig) weeds in thruster {truth.thruster} begin to show in its RPM"))
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
    return f"COMMAND_LONG {name}: answered {command.result.name}"


@dataclass(frozen=True, slots=True)
class Summary:
    """How a demonstration went. Times in seconds; NaN where something did not happen.

    Attributes:
        lasted_s: how long it ran.
        truth: what the rig did.
        verdict_s: first FAULT of the entangled thruster.
        text_s: first alarm about it at the autopilot.
        command_s: failsafe message at the autopilot.
        false_alarms: alarms at the autopilot, and thrusters called faulty, that were not true.
        counts: frames, samples, drops and the like, by name.
        judged_late_s: how long after its own time a sample was judged, at worst: the machine's margin.
        load: processor time over time, 1.0 = one core.
    """

    lasted_s: float
    truth: Truth
    verdict_s: float
    text_s: float
    command_s: float
    false_alarms: tuple[str, ...]
    counts: Mapping[str, int]
    judged_late_s: float
    load: float

    @property
    def latency_s(self) -> float:
        """From the first sign in the RPM to the STATUSTEXT at the autopilot."""
        return self.text_s - self.truth.shown_s

    @property
    def passed(self) -> bool:
        """The pilot was told of the weeds, and of nothing that was not there."""
        return self.text_s == self.text_s and not self.false_alarms


def summarize(
    recording: Recording, notes: Notes, truth: Truth, *, lasted_s: float, counts: Mapping[str, int], load: float
) -> Summary:
    """Judge a demonstration by what reached the autopilot."""
    alarms = [text for text in notes.texts if text.severity <= WARNING]
    actions = (one.time_s for one in notes.commands if one.command in set(Command))
    return Summary(
        lasted_s=lasted_s,
        truth=truth,
        verdict_s=recording.first_fault_s(truth.thruster, truth.onset_s),
        text_s=next((text.time_s for text in alarms if truth.explains(text)), nan),
        command_s=next(actions, nan),
        false_alarms=tuple(_false_alarms(recording, alarms, truth)),
        counts=dict(counts),
        judged_late_s=recording.latest_s,
        load=load,
    )


def _false_alarms(recording: Recording, alarms: Iterable[ReceivedText], truth: Truth) -> Iterable[str]:
    for text in alarms:
        if not truth.explains(text):
            yield f'STATUSTEXT "{text.text}"'
    for thruster in recording.judged:
        true_from_s = truth.onset_s if thruster == truth.thruster else inf
        false_s = recording.first_fault_s(thruster, -inf)
        if false_s < true_from_s and not any(f"T{thruster} " in text.text for text in alarms):
            yield f"FAULT of thruster {thruster}, not told"
