"""The supervisor under any interleaving of what can happen to it: what must never be, whatever comes.

Beside it runs a small model of its own: which HEARTBEAT was the last, what was asked when, which modes were ours.
"""

from __future__ import annotations

import pickle
from dataclasses import dataclass

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from detectors.verdict import Level
from drivers.mavlink.messages import TEXT_MAX, CommandLong, CompanionHeartbeat, CompanionState, StatusText
from drivers.readings import AutopilotHeartbeat, CommandAcknowledgement
from gateway.findings import Finding
from gateway.observation import Observation
from gateway.severity import Severity
from gateway.supervision.actions import RANK, Action
from gateway.supervision.announcements import RateLimit
from gateway.supervision.autopilots import LOST_AFTER_S, OWN_FAILSAFE, REQUESTS, AutopilotKind, Request, kind_of
from gateway.supervision.debounce import DebounceTimes
from gateway.supervision.evidence import DEPTH_SENSOR, VERTICAL_LEFT_MIN, Geometry
from gateway.supervision.intervention_table import State
from gateway.supervision.levels import Event
from gateway.supervision.settings import Settings
from gateway.supervision.subject import Policy
from gateway.supervisor import Outgoing, Supervisor

# label, detector, and what is relied on, by subject
SUBJECTS = {
    "thruster 1": ("T1", "thruster", ()),
    "thruster 2": ("T2", "thruster", ()),
    "thruster 5": ("T5", "thruster", ()),
    "thruster 6": ("T6", "thruster", ()),
    "vehicle": ("Speed", "speed", ("dvl",)),
    "dvl": ("DVL", "navigation", ()),
    "depth sensor": ("Depth", "navigation", ()),
    "link can0": ("can0", "link", ()),
}
GEOMETRY = Geometry({"thruster 5": 1.0, "thruster 6": 1.0}, {"thruster 1": 1.0, "thruster 2": 1.0})
TROUBLES = [
    *[("thruster 1", "vehicle")] * 3,
    *[("thruster 2",)] * 3,
    ("thruster 5", "thruster 6"),
    ("depth sensor",),
    ("dvl",),
]
# how an autopilot deals with commands: what it answers, and whether it obeys
CONDUCTS = [*[(0, True)] * 4, (0, False), (None, True), (None, False), (2, False), (1, False), (5, False), (5, True)]
TROUBLE = {Level.SUSPECT: "odd?", Level.FAULT: "entangled?"}
# MAV_AUTOPILOT, MAV_TYPE, and modes: those that can be asked for, and one more
AUTOPILOTS = {
    AutopilotKind.ARDUSUB: (3, 12, (0, 2, 9, 16, 19)),
    AutopilotKind.PX4: (12, 12, (1 << 16, 2 << 16, 3 << 16, 5 << 16)),
    AutopilotKind.OTHER: (3, 2, (0, 2, 9, 16, 19)),
}
ARM_DISARM = 400
ABOVE_HOLD = {action for action in Action if RANK[action] > RANK[Action.HOLD]}
HOLDING_DEPTH = {Action.HOLD, Action.RETURN, Action.SURFACE, Action.LAND}

ladders = st.lists(st.sampled_from(Action), min_size=1, max_size=3, unique=True).map(tuple)
asking = st.lists(st.sampled_from([*Action][2:]), min_size=1, max_size=3, unique=True).map(tuple)
times = st.sampled_from([DebounceTimes(0.0, 0.0, 0.0), DebounceTimes(0.5, 1.0, 3.0)])
clearing = st.sampled_from(
    [frozenset({Event.GOOD}), frozenset({Event.DISARMED}), frozenset(Event) & {Event.GOOD, Event.DISARMED}]
)
policies = st.builds(Policy, times, clearing, st.one_of(asking, ladders), st.one_of(st.just(()), asking))
subjects = st.sampled_from(sorted(SUBJECTS))


@dataclass
class Asked:
    """What was asked last, and how often."""

    action: Action
    command: CommandLong
    time_s: float
    sent: int = 1


class Model:
    """What a bystander knows who reads along."""

    def __init__(self) -> None:
        self.heard: AutopilotHeartbeat | None = None
        self.asked_s: dict[Action, float] = {}
        self.request: Asked | None = None
        self.ours: set[int] = set()
        self.before: set[int] = set()
        self.foreign = 0
        self.overridden = False
        self.texts_s: list[float] = []
        self.said: dict[str, float] = {}

    def reset(self) -> None:
        """Disarmed, or all is well: nothing of what was asked counts any more, but for when."""
        self.ours, self.before, self.foreign, self.overridden = set(), set(), 0, False

    def heartbeat(self, reading: AutopilotHeartbeat) -> None:
        self.heard = reading
        if not reading.armed:
            self.reset()
        elif self.ours and reading.custom_mode not in self.ours | self.before:
            self.foreign += 1
            self.overridden = self.overridden or self.foreign > 1
        else:
            self.foreign = 0

    def done(self, request: Request) -> None:
        """It came about: no other mode says nothing. Where nothing was asked, nobody can be against it."""
        if self.ours:
            self.ours = set(request.modes | request.after | request.as_good)
            self.before, self.foreign = set(), 0


class Supervision(RuleBasedStateMachine):
    """See the module's text."""

    def __init__(self) -> None:
        super().__init__()
        self.time_s = 1000.0
        self.model = Model()
        self.twin: Supervisor | None = None
        self.arrived: list[Action] = []

    @initialize(
        kind=st.sampled_from([*[AutopilotKind.ARDUSUB, AutopilotKind.PX4] * 3, AutopilotKind.OTHER]),
        by_detector=st.fixed_dictionaries(dict.fromkeys(("thruster", "speed", "navigation", "link"), policies)),
        delay_s=st.sampled_from([0.0, 2.0, 5.0]),
        interval_s=st.sampled_from([10.0, 60.0]),
        limit=st.sampled_from([RateLimit(), RateLimit(6000.0, 1000)]),
        conduct=st.sampled_from(CONDUCTS),
    )
    def begin(self, kind, by_detector, delay_s, interval_s, limit, conduct):
        self.conduct = conduct
        self.kind, self.policies, self.limit, self.interval_s = kind, by_detector, limit, interval_s
        self.settings = Settings(
            limit=limit, delay_s=delay_s, interval_s=interval_s, geometry=GEOMETRY, watching="Watching 4 thrusters"
        )
        self.supervisor = Supervisor(by_detector, self.settings)
        self.mode = AUTOPILOTS[kind][2][0]
        self.armed, self.status = True, 4
        self._beat()

    # What happens -------------------------------------------------------------------------------

    @rule(subject=subjects, level=st.sampled_from(Level), lasts_s=st.sampled_from([0.0, 0.0, 4.0]))
    def verdict(self, subject, level, lasts_s):
        for after_s in (0.0, lasts_s) if lasts_s else (0.0,):
            self._wait(after_s)
            label, detector, relies_on = SUBJECTS[subject]
            trouble = TROUBLE.get(level, "")
            seen = Observation(self.time_s, detector, subject, label, level, 1.0, trouble, relies_on=relies_on)
            self._do("observe", seen)

    @rule(bad=st.sampled_from(TROUBLES))
    def trouble(self, bad):
        for subject in bad:
            self.verdict(subject, Level.FAULT, 4.0)

    @rule(bad=st.sampled_from(TROUBLES), seconds=st.integers(1, 9))
    def flap(self, bad, seconds):
        """It comes, goes, the pilot takes the vehicle back, and it comes again."""
        self.armed, self.status = True, 4
        for level in (Level.FAULT, Level.NORMAL, Level.FAULT):
            for subject in bad:
                self.verdict(subject, level, 4.0 if level is Level.NORMAL else 1.0)
                self._beat()
            self.fly(seconds)
            if level is Level.NORMAL:
                self.mode = AUTOPILOTS[self.kind][2][0]
                self.fly(2)

    @rule(rounds=st.integers(2, 6))
    def flood(self, rounds):
        """All of them change their minds, at once."""
        for turn in range(rounds):
            for subject in SUBJECTS:
                self.verdict(subject, Level.SUSPECT if turn % 2 else Level.NORMAL, 0.0)

    @rule(seconds=st.sampled_from([0.1, 0.9, 1.0, 2.5, 6.0, 40.0]))
    def silence(self, seconds):
        self._wait(seconds)

    @rule(seconds=st.integers(1, 15))
    def fly(self, seconds):
        for _ in range(seconds):
            self._wait(1.0)
            self._beat()

    @rule(index=st.integers(0, 4), lasts=st.booleans())
    def pilot_changes_mode(self, index, lasts):
        modes = AUTOPILOTS[self.kind][2]
        self.mode = modes[index % len(modes)]
        for _ in range(1 + lasts):
            self._wait(0.5)
            self._beat()

    @rule(what=st.sampled_from(["disarm", "reboot", "second autopilot", "restart", "snapshot", "fails", "fails"]))
    def upset(self, what):
        match what:
            case "disarm":
                self.armed = False
                self._beat()
            case "reboot":
                self._wait(6.0)
                self.armed, self.status, self.mode = False, 3, AUTOPILOTS[self.kind][2][0]
                self._beat()
            case "second autopilot":
                self.model.heard = None
                for supervisor in self._both():
                    supervisor.conflict()
                self._wait(5.5)
                for supervisor in self._both():
                    supervisor.conflict(several=False)
            case "restart":
                self._restart()
            case "snapshot":
                self.twin = pickle.loads(pickle.dumps(self.supervisor))  # noqa: S301  our own bytes
            case "fails":
                self.status = 5
                self._beat()

    @rule(seconds=st.integers(1, 70))
    def all_in_order(self, seconds):
        """Armed, active and heard for a while."""
        self.armed, self.status = True, 4
        self.fly(seconds)

    @precondition(lambda self: self.model.request is not None)
    @rule(
        result=st.sampled_from([0, 0, 0, 1, 2, 3, 4, 5, 6]),
        ours=st.sampled_from([True, True, True, False]),
        component_id=st.sampled_from([1, 1, 1, 191]),
    )
    def answer(self, result, ours, component_id):
        command = self.model.request.command.command if ours else 511
        self._do("command_ack", CommandAcknowledgement(self.time_s, 1, component_id, command, result, 255))

    @rule(conduct=st.sampled_from(CONDUCTS))
    def autopilot_conducts_itself(self, conduct):
        self.conduct = conduct

    @rule(subject=st.one_of(subjects, st.none()))
    def acknowledge(self, subject):
        self._do("acknowledge", [subject] if subject else sorted(SUBJECTS), self.time_s)

    @rule(subject=subjects)
    def accept(self, subject):
        self._do("accept", [subject], self.time_s)

    @rule(subject=st.one_of(subjects, st.none()), duration_s=st.sampled_from([5.0, 600.0]))
    def mute(self, subject, duration_s):
        for supervisor in self._both():
            supervisor.mute([subject] if subject else sorted(SUBJECTS), self.time_s, duration_s)

    # What must never be -------------------------------------------------------------------------

    @invariant()
    def it_is_in_a_named_state(self):
        if hasattr(self, "supervisor"):
            assert self.supervisor.intervention in State
            assert not self.model.overridden or self.supervisor.intervention in (State.YIELDED, State.IDLE)

    def teardown(self):
        """All is well in the end, whatever was."""
        if not hasattr(self, "supervisor"):
            return
        self.armed, self.status = True, 4
        for subject in SUBJECTS:
            self.verdict(subject, Level.NORMAL, 4.0)
        self.armed = False
        self.fly(3)
        levels = self.supervisor.levels()
        self.accept_all(levels)
        assert set(self.supervisor.levels().values()) <= {Level.UNKNOWN, Level.NORMAL}
        assert self.supervisor.intervention is State.IDLE

    def accept_all(self, levels):
        """Only an operator's word ends what disarming and recovering do not."""
        for subject, level in levels.items():
            if level is Level.FAULT:
                self.accept(subject)

    # Within -------------------------------------------------------------------------------------

    def _restart(self):
        memory = pickle.loads(pickle.dumps(self.supervisor.remember()))  # noqa: S301  our own bytes
        self.supervisor, self.twin = Supervisor(self.policies, self.settings), None
        self.supervisor.resume(memory)
        self.model.request, self.model.heard = None, None
        self.model.texts_s.clear()
        self._wait(1.0)

    def _both(self) -> list[Supervisor]:
        return [one for one in (self.supervisor, self.twin) if one is not None]

    def _do(self, name: str, *arguments: object) -> None:
        outgoing = getattr(self.supervisor, name)(*arguments)
        if self.twin is not None:
            assert repr(getattr(self.twin, name)(*arguments)) == repr(outgoing)  # NaN is not NaN, its words are
        self._check(outgoing)
        while self.arrived:
            self._react(self.arrived.pop(0))

    def _react(self, action: Action) -> None:
        """The autopilot deals with a command that has reached it."""
        result, obeyed = self.conduct
        request = REQUESTS[self.kind, action]
        self.time_s += 0.01
        if result is not None:
            self._do("command_ack", CommandAcknowledgement(self.time_s, 1, 1, request.command, result, 255))
        if obeyed:
            self.mode = min(request.modes, default=self.mode)
            self.status = min(request.statuses, default=self.status)
            self.armed = self.armed and bool(request.modes or request.statuses)

    def _wait(self, seconds: float) -> None:
        self.time_s += seconds
        self._do("advance", self.time_s)

    def _beat(self) -> None:
        autopilot, vehicle, _ = AUTOPILOTS[self.kind]
        reading = AutopilotHeartbeat(self.time_s, 1, 1, autopilot, vehicle, self.armed, self.mode, self.status)
        self.model.heartbeat(reading)
        self._do("heartbeat", reading)

    def _check(self, outgoing: list[Outgoing]) -> None:
        for one in outgoing:
            match one:
                case Finding():
                    self._check_finding(one)
                case StatusText():
                    self._check_text(one)
                case CommandLong():
                    self._check_command(one)
                case CompanionHeartbeat():
                    faulty = Level.FAULT in self.supervisor.levels().values()
                    assert (one.state is CompanionState.CRITICAL) == faulty
        if Level.FAULT not in self.supervisor.levels().values() or self.supervisor.intervention is State.IDLE:
            self.model.reset()

    def _check_finding(self, finding: Finding) -> None:
        if finding.detector == "failsafe":
            if " done for " in finding.text or " is on already" in finding.text:
                action = Action(finding.text.split()[0].lower())
                self.model.done(REQUESTS[self.kind, action])
            return
        label = SUBJECTS[finding.subject][0]
        for text in [text for text in self.model.said if label.lower() in text.lower()]:
            del self.model.said[text]

    def _check_text(self, text: StatusText) -> None:
        assert len(text.text) <= TEXT_MAX
        assert text.text == text.text.strip()
        assert text.severity >= Severity.CRITICAL
        self.model.texts_s.append(self.time_s)
        for count, since_s in enumerate(reversed(self.model.texts_s), start=1):
            assert count <= self.limit.burst + (self.time_s - since_s) * self.limit.per_minute / 60.0 + 1e-6
        if self.limit.burst > 100 and TROUBLE[Level.FAULT].rstrip("?") in text.text:
            self._check_repeat(text.text)

    def _check_repeat(self, text: str) -> None:
        """Of a level that has not changed: not before its time."""
        last_s = self.model.said.get(text)
        assert last_s is None or self.time_s - last_s >= self.settings.repeat_s - 0.02, text
        self.model.said[text] = self.time_s

    def _check_command(self, command: CommandLong) -> None:
        heard = self.model.heard
        assert heard is not None
        assert heard.armed
        assert self.time_s - heard.time_s <= LOST_AFTER_S
        assert heard.system_status not in OWN_FAILSAFE
        assert kind_of(heard) is not AutopilotKind.OTHER
        assert not self.model.overridden
        assert (command.target_system, command.target_component) == (heard.system_id, heard.component_id)
        action = self._action_of(command)
        self._check_pointless(action)
        self._check_repetition(action, command)
        self.arrived.append(action)

    def _action_of(self, command: CommandLong) -> Action:
        """Only what is known to be accepted, with its own parameters, and never to arm."""
        if command.command == ARM_DISARM:
            assert command.parameters[0] == 0.0
        known = {
            (request.command, tuple((*request.parameters, 0.0, 0.0, 0.0)[:3])): action
            for (kind, action), request in REQUESTS.items()
            if kind is self.kind
        }
        return known[command.command, command.parameters[:3]]

    def _check_pointless(self, action: Action) -> None:
        levels = self.supervisor.levels()
        faulty = {subject for subject, level in levels.items() if level is Level.FAULT}
        assert faulty
        if action in ABOVE_HOLD:
            assert "vehicle" in faulty
            assert faulty & set(GEOMETRY.horizontal)
        if action in HOLDING_DEPTH:
            assert GEOMETRY.vertical_left(faulty) >= VERTICAL_LEFT_MIN
            assert DEPTH_SENSOR not in faulty

    def _check_repetition(self, action: Action, command: CommandLong) -> None:
        request = self.model.request
        if command.confirmation > 0:
            assert request is not None
            assert request.action is action
            assert command.confirmation == request.sent < 3
            request.sent += 1
            return
        assert self.time_s - self.model.asked_s.get(action, -1e9) >= self.interval_s
        self.model.asked_s[action] = self.time_s
        self.model.request = Asked(action, command, self.time_s)
        if not self.model.ours:
            self.model.before = {self.mode}
        wanted = REQUESTS[self.kind, action]
        self.model.ours |= wanted.modes | wanted.after | wanted.as_good


TestSupervision = Supervision.TestCase
TestSupervision.settings = settings(
    max_examples=120,
    stateful_step_count=40,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
)
TestSupervision = pytest.mark.timeout(120)(TestSupervision)
