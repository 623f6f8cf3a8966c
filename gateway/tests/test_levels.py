"""The table of levels: whole, and each cell walked through the supervisor."""

import itertools

import pytest

from detectors.verdict import Level
from drivers.mavlink.messages import StatusText
from drivers.readings import AutopilotHeartbeat
from gateway.findings import Finding
from gateway.observation import Observation
from gateway.severity import Severity
from gateway.supervision.debounce import DebounceTimes
from gateway.supervision.levels import SEVERITY_OF_WORSE, TABLE, Event, Say, diagram
from gateway.supervision.settings import Settings
from gateway.supervision.subject import Policy
from gateway.supervisor import Outgoing, Supervisor

AT_ONCE = DebounceTimes(0.0, 0.0, 0.0)
REPEAT_S = 30.0
LEVEL_OF = {
    Event.LEARNING: Level.UNKNOWN,
    Event.GOOD: Level.NORMAL,
    Event.SUSPICIOUS: Level.SUSPECT,
    Event.FAULTY: Level.FAULT,
}


def test_table_is_complete():
    assert set(TABLE) == set(itertools.product(Level, Event))


def test_what_the_table_says_of_worse_and_over():
    for (level, _event), transition in TABLE.items():
        assert (transition.say is Say.WORSE) == (transition.level > max(level, Level.NORMAL))
        assert (transition.say is Say.OVER) == (level >= Level.SUSPECT > transition.level)


def test_fault_is_latched_against_all_but_its_named_clear_conditions():
    out = {event for event in Event if TABLE[Level.FAULT, event].level is not Level.FAULT}
    assert out == {Event.GOOD, Event.DISARMED, Event.ACCEPTED, Event.DISTRUSTED}


def test_diagram_shows_every_way_in_and_out_of_a_fault():
    lines = diagram().splitlines()
    assert lines[0] == "stateDiagram-v2"
    assert "    NORMAL --> FAULT: FAULT lasted / say worse" in lines
    assert sum("FAULT --> " in line and "SUSPECT" not in line for line in lines) == 5  # four ways out, and the repeat


class Watched:
    """A speed that relies on a DVL, brought to a level by what is seen of it."""

    def __init__(self, level: Level) -> None:
        policy = Policy(AT_ONCE, frozenset({Event.GOOD, Event.DISARMED}))
        settings = Settings(repeat_s=REPEAT_S, suspect_repeat_s=REPEAT_S)
        self.supervisor = Supervisor({"speed": policy, "navigation": policy}, settings)
        self.beat(0.0, armed=True)
        self.see(1.0, level)
        assert self.level is level

    @property
    def level(self) -> Level:
        return self.supervisor.levels()["vehicle"]

    def see(self, time_s: float, level: Level) -> list[Outgoing]:
        return self.supervisor.observe(
            Observation(time_s, "speed", "vehicle", "Speed", level, 1.0, "0.5 m/s", relies_on=("dvl",))
        )

    def beat(self, time_s: float, armed: bool) -> list[Outgoing]:
        return self.supervisor.heartbeat(AutopilotHeartbeat(time_s, 1, 1, 3, 12, armed, 0, 4))

    def happen(self, event: Event) -> list[Outgoing]:
        match event:
            case Event.DISTRUSTED:
                self.supervisor.observe(Observation(2.0, "navigation", "dvl", "DVL", Level.FAULT, 1.0, "frozen"))
                return self.see(2.1, self.level)
            case Event.DISARMED:
                return self.beat(2.0, armed=False)
            case Event.ACCEPTED:
                return self.supervisor.accept(["vehicle"], 2.0)
            case Event.REPEAT_DUE:
                return self.supervisor.advance(1.0 + REPEAT_S)
            case _:
                return self.see(2.0, LEVEL_OF[event])


@pytest.mark.parametrize(("level", "event"), list(TABLE))
def test_each_cell(level, event):
    watched, transition = Watched(level), TABLE[level, event]
    outgoing = watched.happen(event)
    assert watched.level is transition.level
    findings = [one for one in outgoing if isinstance(one, Finding)]
    assert [one.level for one in findings] == [transition.level] * (transition.level is not level)
    severities = {
        Say.NOTHING: [],
        Say.WORSE: [SEVERITY_OF_WORSE.get(transition.level)],
        Say.REPEAT: [Severity.WARNING],
        Say.OVER: [Severity.NOTICE],
    }
    assert [one.severity for one in outgoing if isinstance(one, StatusText)] == severities[transition.say]


@pytest.mark.parametrize(
    ("cleared_by", "good", "disarmed"),
    [
        ({Event.GOOD}, Level.NORMAL, Level.FAULT),
        ({Event.DISARMED}, Level.FAULT, Level.UNKNOWN),
        ({Event.GOOD, Event.DISARMED}, Level.NORMAL, Level.UNKNOWN),
        (set(), Level.FAULT, Level.FAULT),
    ],
)
def test_a_policy_says_which_of_recovering_and_disarming_clears_a_fault(cleared_by, good, disarmed):
    for event, expected in ((Event.GOOD, good), (Event.DISARMED, disarmed), (Event.ACCEPTED, Level.UNKNOWN)):
        watched = Watched(Level.FAULT)
        watched.supervisor._subjects["vehicle"].policy = Policy(AT_ONCE, frozenset(cleared_by))
        watched.happen(event)
        assert watched.level is expected


@pytest.mark.parametrize("level", [Level.UNKNOWN, Level.SUSPECT])
def test_recovering_ends_what_is_no_fault_whatever_clears_a_fault(level):
    supervisor = Supervisor({"speed": Policy(AT_ONCE, frozenset({Event.DISARMED}))})
    for time_s, seen in enumerate([level, Level.NORMAL]):
        supervisor.observe(Observation(time_s, "speed", "vehicle", "Speed", seen, 1.0, "0.5 m/s"))
    assert supervisor.levels() == {"vehicle": Level.NORMAL}
