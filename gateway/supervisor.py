"""From what detectors and watches say, what pilot and autopilot are told. Pure: time comes in, outcomes go out.

Each subject (a thruster, the vehicle, a sensor, a link, ...) is in one of four levels, and moves by the table in
`supervision.levels`, when what is said of it has lasted (`supervision.debounce`). Over all of them:

- One text for each change for the worse, one when it is over, and again while it lasts; under one rate limit
  (`supervision.announcements`). Every change of level is a finding.
- A thruster's fault that explains a slow vehicle is said with it, as one cause; a sensor's fault makes that UNKNOWN
  which relies on the sensor (`supervision.evidence`).
- The faults that ask for more than texts make a plan, and the worst wins (`supervision.actions`); what is asked of
  the autopilot, and when not, is in `supervision.intervention`.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace

from detectors.verdict import Level
from drivers.mavlink.messages import CommandLong, CompanionHeartbeat, CompanionState, StatusText
from drivers.readings import AutopilotHeartbeat, CommandAcknowledgement
from gateway import texts
from gateway.findings import Finding
from gateway.observation import Observation
from gateway.severity import Severity
from gateway.supervision.announcements import Announcements
from gateway.supervision.autopilots import ArmedEdge, AutopilotKind, AutopilotWatch, kind_of
from gateway.supervision.debounce import Debounce
from gateway.supervision.evidence import plan, together
from gateway.supervision.intervention import Intervention
from gateway.supervision.intervention_table import State
from gateway.supervision.levels import TABLE, Event, Say
from gateway.supervision.settings import Settings
from gateway.supervision.subject import Policy, Remembered, Subject
from gateway.supervision.wording import Wording
from gateway.timeline import TICK_TOLERANCE_S

Outgoing = Finding | StatusText | CommandLong | CompanionHeartbeat

HEARTBEAT_PERIOD_S = 1.0
# texts of no subject of their own: they wait, and are replaced, as if they were of these
FAILSAFE, STATE = "failsafe", "state"


@dataclass(frozen=True, slots=True)
class Memory:
    """What survives a restart of the program, if it is short: subjects, and what was asked of the autopilot."""

    subjects: Mapping[str, Remembered]
    intervention: Intervention

    def of(self, subjects: Collection[str]) -> Memory:
        """The same, without those that are no longer among these."""
        return replace(self, subjects={name: one for name, one in self.subjects.items() if name in subjects})


class Supervisor:
    """See the module's text.

    Args:
        policies: by detector; and by subject, for those that are treated in another way.
        settings: for all of them.
    """

    def __init__(self, policies: Mapping[str, Policy], settings: Settings | None = None) -> None:
        self._policies = dict(policies)
        self._settings = settings or Settings()
        self._autopilot = AutopilotWatch()
        self._kind: AutopilotKind | None = None
        self._intervention = Intervention(self._autopilot, self._settings.delay_s, self._settings.interval_s)
        self._announcements = Announcements(self._settings.limit)
        self._subjects: dict[str, Subject] = {}
        self._beat_s: float | None = None

    def levels(self) -> dict[str, Level]:
        """Present level of every subject that was ever observed."""
        return {name: subject.level for name, subject in self._subjects.items()}

    def disarmed(self) -> bool:
        """True where the autopilot is known to be disarmed."""
        return self._autopilot.armed is False

    def steady(self, subject: str, time_s: float, level: Level) -> bool:
        """True where nothing comes of it when a subject is observed in this level once more.

        Of thousands of readings a second, hardly any is news: whoever asks first need not put the others in words.
        """
        found = self._subjects.get(subject)
        return found is not None and found.steady(time_s, level)

    @property
    def intervention(self) -> State:
        """How far the autopilot was asked to do something."""
        return self._intervention.state

    # What comes in --------------------------------------------------------------------------------

    def observe(self, observation: Observation) -> list[Outgoing]:
        """Takes what is said of a subject.

        Raises:
            ValueError: a detector that has no policy.
        """
        subject = self._subject(observation)
        if observation.relies_on and self._distrusted(observation.relies_on):
            return self._distrust(subject, observation, observation.time_s)
        event = subject.debounce.update(observation.time_s, observation.level)
        if observation.level >= Level.SUSPECT or subject.level <= Level.NORMAL:
            subject.seen = observation  # of a latched fault, the last evidence of it
        if event is None or not subject.clears(event):
            return []
        return self._apply(subject, event, observation, observation.time_s)

    def heartbeat(self, reading: AutopilotHeartbeat) -> list[Outgoing]:
        """Takes the autopilot's HEARTBEAT: disarming clears, arming lets everything count again."""
        edge = self._autopilot.heartbeat(reading)
        self._intervention.heartbeat(reading)
        outgoing = self._introduce(reading)
        for subject in self._subjects.values():
            if edge is not ArmedEdge.NONE:
                subject.settled = True  # whoever arms with a fault, or disarms, knows of it
            if edge is ArmedEdge.DISARMED and subject.clears(Event.DISARMED):
                outgoing += self._clear(subject, Event.DISARMED, reading.time_s)
            elif edge is ArmedEdge.ARMED:
                subject.debounce.unmute()
        return outgoing + self._intervene(reading.time_s)

    def conflict(self, several: bool = True) -> None:
        """Several autopilots are heard: none of them is asked for anything; or there is one again."""
        self._autopilot.ambiguous = several
        if several:
            self._kind = None

    def command_ack(self, reading: CommandAcknowledgement) -> list[Outgoing]:
        """Takes a COMMAND_ACK."""
        self._intervention.acknowledge(reading)
        return self._intervene(reading.time_s)

    def advance(self, time_s: float) -> list[Outgoing]:
        """Takes a tick: repeats, requests to the autopilot, texts that had to wait, and a heartbeat once a second."""
        outgoing: list[Outgoing] = []
        for subject in self._subjects.values():
            relies_on = subject.seen.relies_on
            if relies_on and subject.level > Level.UNKNOWN and self._distrusted(relies_on):
                outgoing += self._distrust(subject, subject.seen, time_s)
            if subject.level >= Level.SUSPECT and self._repeat_due(subject, time_s):
                outgoing += self._apply(subject, Event.REPEAT_DUE, subject.seen, time_s)
        outgoing += self._intervene(time_s)
        outgoing += self._announcements.advance(time_s)
        if self._beat_s is None or time_s - self._beat_s >= HEARTBEAT_PERIOD_S - TICK_TOLERANCE_S:
            self._beat_s = time_s
            outgoing.append(CompanionHeartbeat(self._state()))
        return outgoing

    # What the operator says -----------------------------------------------------------------------

    def acknowledge(self, subjects: Iterable[str], time_s: float) -> list[Outgoing]:
        """The operator has seen these faults: they are not repeated, and nothing (more) is asked because of them."""
        for subject in self._known(subjects):
            subject.acknowledged = subject.settled = True
        return self._intervene(time_s)

    def accept(self, subjects: Iterable[str], time_s: float) -> list[Outgoing]:
        """The operator says that these are well as they are."""
        outgoing = [one for subject in self._known(subjects) for one in self._clear(subject, Event.ACCEPTED, time_s)]
        return outgoing + self._intervene(time_s)

    def mute(self, subjects: Iterable[str], time_s: float, duration_s: float) -> None:
        """The operator wants no texts of these for a while. Findings and actions go on."""
        for subject in self._known(subjects):
            subject.muted_until_s = time_s + duration_s
            self._announcements.withdraw(subject.seen.subject)

    def inform(self, time_s: float, text: str) -> list[Outgoing]:
        """Says something that is no fault."""
        return self._say(time_s, STATE, Severity.INFO, text)

    # What survives a restart ----------------------------------------------------------------------

    def remember(self) -> Memory:
        """For `resume` in a new process."""
        kept = {
            name: Remembered(one.level, one.seen, one.acknowledged, one.settled, one.muted_until_s, one.said_s)
            for name, one in self._subjects.items()
        }
        return Memory(kept, self._intervention)

    def resume(self, memory: Memory) -> None:
        """Takes up what another supervisor remembered: levels, and that which was asked is not asked again."""
        for name, old in memory.subjects.items():
            if old.seen.detector in self._policies or name in self._policies:
                subject = self._subject(old.seen)
                subject.level, subject.acknowledged, subject.settled = old.level, old.acknowledged, old.settled
                subject.muted_until_s, subject.said_s = old.muted_until_s, old.said_s
        self._intervention.resume(memory.intervention)

    # Within ---------------------------------------------------------------------------------------

    def _subject(self, observation: Observation) -> Subject:
        found = self._subjects.get(observation.subject)
        if found is None:
            policy = self._policies.get(observation.subject, self._policies.get(observation.detector))
            if policy is None:
                known = ", ".join(sorted(self._policies))
                raise ValueError(f"detector = {observation.detector!r}: want one that has a policy: {known}")
            found = Subject(policy, Debounce(policy.times), observation)
            self._subjects[observation.subject] = found
        return found

    def _known(self, subjects: Iterable[str]) -> list[Subject]:
        return [found for name in subjects if (found := self._subjects.get(name)) is not None]

    def _distrusted(self, relies_on: Iterable[str]) -> list[Subject]:
        return [one for one in self._known(relies_on) if one.level is Level.FAULT]

    def _distrust(self, subject: Subject, observation: Observation, time_s: float) -> list[Outgoing]:
        """What its detector says of it is based on a sensor that lies."""
        because = together([one.seen.label for one in self._distrusted(observation.relies_on)])
        subject.debounce.reset()
        subject.seen = observation.unknown(f"{because} faulty")
        return self._apply(subject, Event.DISTRUSTED, subject.seen, time_s)

    def _clear(self, subject: Subject, event: Event, time_s: float) -> list[Outgoing]:
        if subject.level < Level.SUSPECT:
            return []
        subject.debounce.mute()
        return self._apply(subject, event, subject.seen, time_s)

    def _apply(self, subject: Subject, event: Event, observation: Observation, time_s: float) -> list[Outgoing]:
        """Makes the transition."""
        before, transition = subject.level, TABLE[subject.level, event]
        if transition.level is before and transition.say is Say.NOTHING:
            return []
        subject.move(transition.level)
        wording = Wording(subject, self._subjects.values(), self._settings.geometry, time_s)
        severity, text = wording.of(transition, event, observation)
        outgoing: list[Outgoing] = []
        if transition.level is not before:
            outgoing.append(_finding(time_s, observation, transition.level, severity, text))
        if transition.say is not Say.NOTHING:
            subject.said_s = time_s
            if not (subject.silenced(time_s) or (transition.say is Say.REPEAT and wording.explained)):
                outgoing += self._say(time_s, observation.subject, severity, text)
                for one in wording.said_with(transition):
                    one.said_s = time_s  # one cause is not said again by each who has a part in it
        return outgoing + (self._intervene(time_s) if Level.FAULT in (before, transition.level) else [])

    def _repeat_due(self, subject: Subject, time_s: float) -> bool:
        if subject.acknowledged:
            return False
        fault = subject.level is Level.FAULT
        after_s = self._settings.repeat_s if fault else self._settings.suspect_repeat_s
        return time_s - subject.said_s >= after_s - TICK_TOLERANCE_S

    def _introduce(self, reading: AutopilotHeartbeat) -> list[Outgoing]:
        """Once for each autopilot: what is watched, and that one that is not known gets advice only."""
        if self._autopilot.ambiguous:
            return []
        before, self._kind = self._kind, kind_of(reading)
        if self._kind is before:
            return []
        said = self._say(reading.time_s, STATE, Severity.INFO, self._settings.watching)
        if self._kind is AutopilotKind.OTHER:
            text = f"Autopilot {reading.autopilot}, type {reading.vehicle_type} unknown: advice only"
            said += self._say(reading.time_s, "autopilot kind", Severity.INFO, text)
        return said

    def _intervene(self, time_s: float) -> list[Outgoing]:
        faulty = Level.FAULT in [subject.level for subject in self._subjects.values()]
        if not faulty and self._intervention.state is State.IDLE:
            return []
        wanted = plan(list(self._subjects.values()), self._settings.geometry, self._kind)
        outgoing: list[Outgoing] = []
        for one in self._intervention.update(time_s, wanted, all_well=not faulty):
            if isinstance(one, StatusText):
                outgoing += self._announcements.say(time_s, FAILSAFE, one)
            else:
                outgoing.append(one)
        return outgoing

    def _say(self, time_s: float, subject: str, severity: Severity, text: str) -> list[Outgoing]:
        if not text:
            return []
        return [*self._announcements.say(time_s, subject, StatusText(severity, texts.fitted(text)))]

    def _state(self) -> CompanionState:
        levels = {subject.level for subject in self._subjects.values()}
        if Level.FAULT in levels:
            return CompanionState.CRITICAL
        return CompanionState.ACTIVE if levels & {Level.NORMAL, Level.SUSPECT} else CompanionState.BOOT


def _finding(time_s: float, observation: Observation, level: Level, severity: Severity, text: str) -> Finding:
    return Finding(time_s, observation.detector, observation.subject, level, observation.score, text, severity)
