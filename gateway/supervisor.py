"""From what detectors and watches say, what pilot and autopilot are told. Pure: time comes in, actions go out.

Each subject (a thruster, the vehicle, a link, ...) is in one of the four levels, and moves by `TABLE`:

- Levels are debounced, upwards and downwards, before they count (`gateway.debounce`).
- A FAULT is latched. Its clear conditions have names: NORMAL lasted, vehicle disarmed, operator accepted. That its
  detector does not know (any more) clears nothing, nor does one NORMAL of a detector that has just learnt the faulty
  state.
- One text when a subject gets worse, one when it is over, and a lasting FAULT again every `repeat_s`.
- The onset of a FAULT is handed to `gateway.failsafe`, with the action that its detector's policy names.
- Every change of level is a finding.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum, auto

from detectors.verdict import Level
from drivers.mavlink.messages import CommandLong, CompanionHeartbeat, CompanionState, StatusText
from drivers.readings import AutopilotHeartbeat, CommandAcknowledgement
from gateway import texts
from gateway.failsafe import ACTIONS, Failsafe
from gateway.findings import Finding
from gateway.observation import Observation
from gateway.severity import Severity
from gateway.supervision.autopilots import ArmedEdge, AutopilotWatch
from gateway.supervision.debounce import Debounce, DebounceTimes
from gateway.supervision.levels import Event

Action = Finding | StatusText | CommandLong | CompanionHeartbeat

HEARTBEAT_PERIOD_S = 1.0
# ticks stand on a grid of decimal fractions: less than half a tick early is on time
TICK_TOLERANCE_S = 0.01


class Say(Enum):
    """What a transition tells the pilot."""

    NOTHING = auto()
    WORSE = auto()
    REPEAT = auto()
    OVER = auto()


@dataclass(frozen=True, slots=True)
class Transition:
    """Where an event leads, and what is said."""

    level: Level
    say: Say = Say.NOTHING


TABLE: Mapping[tuple[Level, Event], Transition] = {
    (Level.UNKNOWN, Event.LEARNING): Transition(Level.UNKNOWN),
    (Level.UNKNOWN, Event.GOOD): Transition(Level.NORMAL),
    (Level.UNKNOWN, Event.SUSPICIOUS): Transition(Level.SUSPECT, Say.WORSE),
    (Level.UNKNOWN, Event.FAULTY): Transition(Level.FAULT, Say.WORSE),
    (Level.UNKNOWN, Event.DISARMED): Transition(Level.UNKNOWN),
    (Level.UNKNOWN, Event.ACCEPTED): Transition(Level.UNKNOWN),
    (Level.UNKNOWN, Event.REPEAT_DUE): Transition(Level.UNKNOWN),
    (Level.NORMAL, Event.LEARNING): Transition(Level.UNKNOWN),
    (Level.NORMAL, Event.GOOD): Transition(Level.NORMAL),
    (Level.NORMAL, Event.SUSPICIOUS): Transition(Level.SUSPECT, Say.WORSE),
    (Level.NORMAL, Event.FAULTY): Transition(Level.FAULT, Say.WORSE),
    (Level.NORMAL, Event.DISARMED): Transition(Level.NORMAL),
    (Level.NORMAL, Event.ACCEPTED): Transition(Level.NORMAL),
    (Level.NORMAL, Event.REPEAT_DUE): Transition(Level.NORMAL),
    # not knowing is no good news: a suspicion stays until it is confirmed, refuted or dealt with
    (Level.SUSPECT, Event.LEARNING): Transition(Level.SUSPECT),
    (Level.SUSPECT, Event.GOOD): Transition(Level.NORMAL, Say.OVER),
    (Level.SUSPECT, Event.SUSPICIOUS): Transition(Level.SUSPECT),
    (Level.SUSPECT, Event.FAULTY): Transition(Level.FAULT, Say.WORSE),
    (Level.SUSPECT, Event.DISARMED): Transition(Level.UNKNOWN, Say.OVER),
    (Level.SUSPECT, Event.ACCEPTED): Transition(Level.UNKNOWN, Say.OVER),
    (Level.SUSPECT, Event.REPEAT_DUE): Transition(Level.SUSPECT),
    # latched: only a named clear condition leads out
    (Level.FAULT, Event.LEARNING): Transition(Level.FAULT),
    (Level.FAULT, Event.GOOD): Transition(Level.NORMAL, Say.OVER),
    (Level.FAULT, Event.SUSPICIOUS): Transition(Level.FAULT),
    (Level.FAULT, Event.FAULTY): Transition(Level.FAULT),
    (Level.FAULT, Event.DISARMED): Transition(Level.UNKNOWN, Say.OVER),
    (Level.FAULT, Event.ACCEPTED): Transition(Level.UNKNOWN, Say.OVER),
    (Level.FAULT, Event.REPEAT_DUE): Transition(Level.FAULT, Say.REPEAT),
}

SEVERITY_OF_WORSE: Mapping[Level, Severity] = {Level.SUSPECT: Severity.WARNING, Level.FAULT: Severity.CRITICAL}


def diagram() -> str:
    """`TABLE` as a mermaid state diagram; transitions that change and say nothing are left out."""
    lines = ["stateDiagram-v2", f"    [*] --> {Level.UNKNOWN.name}"]
    for (level, event), transition in TABLE.items():
        if transition.level is not level or transition.say is not Say.NOTHING:
            said = "" if transition.say is Say.NOTHING else f" / say {transition.say.name.lower()}"
            lines.append(f"    {level.name} --> {transition.level.name}: {event}{said}")
    return "\n".join(lines)


@dataclass(frozen=True, slots=True)
class Policy:
    """How the subjects of one detector are treated.

    Attributes:
        times: debounce.
        cleared_by_disarm: disarming the vehicle is a clear condition.
        failsafe: what the onset of a FAULT asks of the autopilot. With "warn" the pilot gets texts, and that is all;
            with "none" there are only findings.

    Raises:
        ValueError: an unknown failsafe action.
    """

    times: DebounceTimes
    cleared_by_disarm: bool = False
    failsafe: str = "warn"

    def __post_init__(self) -> None:
        if self.failsafe not in ACTIONS:
            raise ValueError(f"failsafe = {self.failsafe!r}: want one of {', '.join(sorted(ACTIONS))}")


@dataclass(slots=True)
class _Subject:
    """State of one subject: its level, its debounce, and what was said of it last."""

    debounce: Debounce
    policy: Policy
    seen: Observation
    level: Level = Level.UNKNOWN
    said_s: float = 0.0


class Supervisor:
    """See the module's text.

    Args:
        policies: by detector; and by subject, for those that are treated in another way.
        ask_every_s: the autopilot is never asked for a failsafe action again sooner than this.
        repeat_s: a lasting FAULT is said again this often.
    """

    def __init__(self, policies: Mapping[str, Policy], ask_every_s: float = 60.0, repeat_s: float = 30.0) -> None:
        self._policies = dict(policies)
        self._failsafe = Failsafe(ask_every_s)
        self._autopilot = AutopilotWatch()
        self._repeat_s = repeat_s
        self._subjects: dict[str, _Subject] = {}
        self._beat_s: float | None = None

    def levels(self) -> dict[str, Level]:
        """Present level of every subject that was ever observed."""
        return {name: subject.level for name, subject in self._subjects.items()}

    def disarmed(self) -> bool:
        """True where the autopilot is known to be disarmed."""
        return self._autopilot.armed is False

    def observe(self, observation: Observation) -> list[Action]:
        """Takes what is said of a subject.

        Raises:
            ValueError: a detector that has no policy.
        """
        subject = self._subject(observation)
        event = subject.debounce.update(observation.time_s, observation.level)
        if observation.level >= Level.SUSPECT or subject.level <= Level.NORMAL:
            subject.seen = observation  # of a latched fault, the last evidence of it
        return [] if event is None else self._apply(subject, event, observation)

    def heartbeat(self, reading: AutopilotHeartbeat) -> list[Action]:
        """Takes the autopilot's HEARTBEAT: disarming clears, arming lets everything count again."""
        edge = self._autopilot.heartbeat(reading)
        actions: list[Action] = []
        for subject in self._subjects.values():
            if edge is ArmedEdge.DISARMED and subject.policy.cleared_by_disarm:
                actions += self._clear(subject, Event.DISARMED, reading.time_s)
            elif edge is ArmedEdge.ARMED:
                subject.debounce.unmute()
        return actions

    def accept(self, subject: str, time_s: float) -> list[Action]:
        """The operator says that a subject is well as it is. Unknown subjects are well."""
        found = self._subjects.get(subject)
        return [] if found is None else self._clear(found, Event.ACCEPTED, time_s)

    def acknowledge(self, reading: CommandAcknowledgement) -> list[Action]:
        """Takes a COMMAND_ACK."""
        return list(self._failsafe.acknowledge(reading))

    def advance(self, time_s: float) -> list[Action]:
        """Takes a tick: repeats, failsafe tries, and our own heartbeat once a second."""
        actions: list[Action] = []
        for subject in self._subjects.values():
            if subject.level is Level.FAULT and time_s - subject.said_s >= self._repeat_s - TICK_TOLERANCE_S:
                actions += self._apply(subject, Event.REPEAT_DUE, subject.seen, time_s)
        actions += self._failsafe.advance(time_s)
        if self._beat_s is None or time_s - self._beat_s >= HEARTBEAT_PERIOD_S - TICK_TOLERANCE_S:
            self._beat_s = time_s
            faulty = any(s.level is Level.FAULT for s in self._subjects.values())
            actions.append(CompanionHeartbeat(CompanionState.CRITICAL if faulty else CompanionState.ACTIVE))
        return actions

    def _subject(self, observation: Observation) -> _Subject:
        found = self._subjects.get(observation.subject)
        if found is None:
            policy = self._policies.get(observation.subject, self._policies.get(observation.detector))
            if policy is None:
                known = ", ".join(sorted(self._policies))
                raise ValueError(f"detector = {observation.detector!r}: want one that has a policy: {known}")
            found = _Subject(Debounce(policy.times), policy, observation)
            self._subjects[observation.subject] = found
        return found

    def _clear(self, subject: _Subject, event: Event, time_s: float) -> list[Action]:
        if subject.level < Level.SUSPECT:
            return []
        subject.debounce.mute()
        return self._apply(subject, event, subject.seen, time_s)

    def _apply(
        self, subject: _Subject, event: Event, observation: Observation, time_s: float | None = None
    ) -> list[Action]:
        """Makes the transition; `time_s` where it is not the observation's own."""
        before, transition = subject.level, TABLE[subject.level, event]
        at_s = observation.time_s if time_s is None else time_s
        subject.level = transition.level
        if transition.level is before and transition.say is Say.NOTHING:
            return []
        severity, text = _words(transition, event, observation)
        actions: list[Action] = []
        if transition.level is not before:
            actions.append(_finding(at_s, observation, transition.level, severity, text))
        if transition.say is not Say.NOTHING:
            subject.said_s = at_s
            actions += [StatusText(severity, text)] if subject.policy.failsafe != "none" else []
        if transition.level is Level.FAULT and before is not Level.FAULT:
            actions += self._failsafe.request(at_s, observation.label, subject.policy.failsafe, self._autopilot)
        return actions


def _words(transition: Transition, event: Event, observation: Observation) -> tuple[Severity, str]:
    match transition.say:
        case Say.WORSE:
            return SEVERITY_OF_WORSE[transition.level], observation.text()
        case Say.REPEAT:
            return Severity.WARNING, observation.text()
        case Say.OVER if event is Event.GOOD:
            return Severity.NOTICE, observation.over_text()
        case Say.OVER:
            return Severity.NOTICE, texts.fitted(f"{observation.label} fault cleared: {event}")
        case Say.NOTHING:
            return Severity.INFO, observation.text()


def _finding(time_s: float, observation: Observation, level: Level, severity: Severity, text: str) -> Finding:
    return Finding(time_s, observation.detector, observation.subject, level, observation.score, text, severity)
