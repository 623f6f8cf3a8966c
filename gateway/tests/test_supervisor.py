"""The supervisor: its table walked, its times kept, its texts complete."""

import itertools
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from detectors.verdict import Level
from drivers.mavlink.messages import CompanionHeartbeat, CompanionState, StatusText
from drivers.readings import AutopilotHeartbeat
from gateway.findings import Finding
from gateway.observation import Observation
from gateway.severity import Severity
from gateway.supervision.debounce import Debounce, DebounceTimes
from gateway.supervision.levels import TABLE, Event, Say, diagram
from gateway.supervision.settings import Settings
from gateway.supervision.subject import Policy
from gateway.supervisor import Supervisor

AT_ONCE = DebounceTimes(0.0, 0.0, 0.0)


def supervisor(times: DebounceTimes = AT_ONCE, **settings: object) -> Supervisor:
    return Supervisor({"thruster": Policy(times, frozenset({Event.GOOD, Event.DISARMED}))}, Settings(**settings))


def seen(time_s: float, level: Level, subject: str = "thruster 3") -> Observation:
    details = ("1040 rpm", ", want 1043") if level is Level.NORMAL else ("812 rpm", ", want 1043", " (-22%)")
    return Observation(time_s, "thruster", subject, "T3", level, 1.7, "entangled?", details)


def heartbeat(time_s: float, armed: bool) -> AutopilotHeartbeat:
    return AutopilotHeartbeat(time_s, 1, 1, 3, 12, armed, 19, 4)


def texts(actions: list) -> list[tuple[int, str]]:
    """What the pilot reads, but for what is no news of a fault."""
    said = [action for action in actions if isinstance(action, StatusText)]
    return [(action.severity, action.text) for action in said if action.severity < Severity.INFO]


def findings(actions: list) -> list[Finding]:
    return [action for action in actions if isinstance(action, Finding)]


def test_table_is_complete():
    assert set(TABLE) == set(itertools.product(Level, Event))


def test_what_the_table_says_of_worse_and_over():
    for (level, _event), transition in TABLE.items():
        assert (transition.say is Say.WORSE) == (transition.level > max(level, Level.NORMAL))
        assert (transition.say is Say.OVER) == (level >= Level.SUSPECT > transition.level)


def test_fault_is_latched_against_all_but_its_named_clear_conditions():
    out = {event for event in Event if TABLE[Level.FAULT, event].level is not Level.FAULT}
    assert out == {Event.GOOD, Event.DISARMED, Event.ACCEPTED, Event.DISTRUSTED}


EVENT_OF_LEVEL = {
    Level.UNKNOWN: Event.LEARNING,
    Level.NORMAL: Event.GOOD,
    Level.SUSPECT: Event.SUSPICIOUS,
    Level.FAULT: Event.FAULTY,
}


@given(st.lists(st.sampled_from(Level), max_size=20))
def test_walk_through_the_table(levels):
    subject, at = supervisor(), Level.UNKNOWN
    for time_s, level in enumerate(levels):
        transition = TABLE[at, EVENT_OF_LEVEL[level]]
        actions = subject.observe(seen(time_s, level))
        assert subject.levels()["thruster 3"] is transition.level
        assert len(findings(actions)) == (transition.level is not at)
        assert len(texts(actions)) == (transition.say is not Say.NOTHING)
        at = transition.level


def test_words_of_a_fault_from_onset_to_end():
    subject = supervisor()
    assert texts(subject.observe(seen(0.0, Level.NORMAL))) == []
    onset = subject.observe(seen(1.0, Level.FAULT))
    assert texts(onset) == [(Severity.CRITICAL, "T3 entangled? 812 rpm, want 1043 (-22%)")]
    (finding,) = findings(onset)
    assert finding == Finding(1.0, "thruster", "thruster 3", Level.FAULT, 1.7, onset[1].text, Severity.CRITICAL)
    over = subject.observe(seen(9.0, Level.NORMAL))
    assert texts(over) == [(Severity.NOTICE, "T3 ok again: 1040 rpm, want 1043")]
    assert [finding.level for finding in findings(over)] == [Level.NORMAL]


def test_suspicion_is_a_warning_and_worsens_to_critical():
    subject = supervisor()
    assert texts(subject.observe(seen(0.0, Level.SUSPECT)))[0][0] == Severity.WARNING
    assert texts(subject.observe(seen(1.0, Level.SUSPECT))) == []
    assert texts(subject.observe(seen(2.0, Level.FAULT)))[0][0] == Severity.CRITICAL


def test_fault_is_repeated_with_its_last_evidence_while_it_lasts():
    subject = supervisor(DebounceTimes(0.0, 0.0, 5.0), repeat_s=30.0)
    subject.observe(seen(0.0, Level.FAULT))
    said = []
    for tick in range(1, 700):
        time_s = tick / 10
        said += [(time_s, *text) for text in texts(subject.advance(time_s))]
        if time_s == 20.0:
            assert subject.observe(seen(time_s, Level.NORMAL)) == []  # once is not for 5 s
    assert said == [(t, Severity.WARNING, "T3 entangled? 812 rpm, want 1043 (-22%)") for t in (30.0, 60.0)]


def test_debounce_upwards_and_downwards():
    subject = supervisor(DebounceTimes(1.0, 0.0, 5.0))
    for time_s in (0.0, 0.5, 0.9):
        assert subject.observe(seen(time_s, Level.SUSPECT)) == []
    subject.observe(seen(0.95, Level.NORMAL))
    assert subject.observe(seen(1.5, Level.SUSPECT)) == []
    assert texts(subject.observe(seen(2.5, Level.SUSPECT)))
    assert subject.observe(seen(3.0, Level.NORMAL)) == []
    assert subject.observe(seen(7.9, Level.NORMAL)) == []
    assert texts(subject.observe(seen(8.0, Level.NORMAL)))


def test_companion_heartbeat_is_critical_while_a_fault_lasts():
    subject = supervisor()
    beats = {}
    for tick in range(0, 60):
        time_s = tick / 10
        if tick == 15:
            subject.observe(seen(time_s, Level.FAULT))
        if tick == 35:
            subject.observe(seen(time_s, Level.NORMAL))
        for action in subject.advance(time_s):
            beats[time_s] = action.state is CompanionState.CRITICAL
            assert isinstance(action, CompanionHeartbeat)
    assert beats == {0.0: False, 1.0: False, 2.0: True, 3.0: True, 4.0: False, 5.0: False}


def test_disarming_clears_and_arming_lets_the_same_fault_count_again():
    subject = supervisor()
    subject.heartbeat(heartbeat(0.0, True))
    subject.observe(seen(1.0, Level.FAULT))
    cleared = subject.heartbeat(heartbeat(2.0, False))
    assert texts(cleared) == [(Severity.NOTICE, "T3 fault cleared: vehicle disarmed")]
    assert subject.observe(seen(2.1, Level.FAULT)) == []
    subject.heartbeat(heartbeat(3.0, True))
    assert texts(subject.observe(seen(3.1, Level.FAULT)))[0][0] == Severity.CRITICAL


def test_fault_while_disarmed_is_told_all_the_same():
    subject = supervisor()
    subject.heartbeat(heartbeat(0.0, False))
    assert texts(subject.observe(seen(1.0, Level.FAULT)))


def test_accepted_fault_counts_again_only_after_it_was_away():
    subject = supervisor()
    subject.observe(seen(1.0, Level.FAULT))
    assert texts(subject.accept(["thruster 3"], 2.0)) == [(Severity.NOTICE, "T3 fault cleared: operator accepted")]
    assert subject.observe(seen(2.1, Level.FAULT)) == []
    subject.observe(seen(3.0, Level.NORMAL))
    assert texts(subject.observe(seen(4.0, Level.FAULT)))


def test_detector_without_a_policy_is_the_callers_mistake():
    with pytest.raises(ValueError, match="thruster"):
        supervisor().observe(Observation(0.0, "dvl", "dvl", "DVL", Level.FAULT, 1.0, "frozen"))


@given(label=st.text(max_size=60), trouble=st.text(max_size=60), details=st.lists(st.text(max_size=30), max_size=4))
def test_every_text_is_a_valid_statustext(label, trouble, details):
    for level in Level:
        observation = Observation(0.0, "link", "x", label, level, math.nan, trouble, tuple(details))
        StatusText(Severity.WARNING, observation.text())
        StatusText(Severity.WARNING, observation.over_text())


def test_policy_with_an_unknown_action_is_the_callers_mistake():
    with pytest.raises(ValueError, match="surface"):
        Policy(AT_ONCE, ladder=("explode",))
    with pytest.raises(ValueError, match="ladder"):
        Policy(AT_ONCE, ladder=())


def test_diagram_shows_every_way_in_and_out_of_a_fault():
    lines = diagram().splitlines()
    assert lines[0] == "stateDiagram-v2"
    assert "    NORMAL --> FAULT: FAULT lasted / say worse" in lines
    assert sum("FAULT --> " in line and "SUSPECT" not in line for line in lines) == 5  # four ways out, and the repeat


@pytest.mark.parametrize("wrong", [(-1.0, 0.0, 0.0), (0.0, math.nan, 0.0)])
def test_debounce_times(wrong):
    with pytest.raises(ValueError, match="want 0 or more"):
        DebounceTimes(*wrong)


NORMAL, UNKNOWN, SUSPECT = Level.NORMAL, Level.UNKNOWN, Level.SUSPECT


@pytest.mark.parametrize(
    ("levels", "good_s"),
    [
        ([NORMAL] * 20, 5),
        ([NORMAL] * 3 + [UNKNOWN] * 4 + [NORMAL] * 13, 9),  # 3 s, four that do not count, and 2 s
        (([NORMAL] + [UNKNOWN] * 4) * 8, 25),
        ([NORMAL] * 3 + [UNKNOWN] * 6 + [NORMAL] * 11, 14),  # not known for long: it begins anew
        ([NORMAL] * 3 + [UNKNOWN, SUSPECT, UNKNOWN] + [NORMAL] * 14, 11),
    ],
)
def test_short_unknown_stops_the_time_of_normal_and_a_long_one_ends_it(levels, good_s):
    debounce = Debounce(DebounceTimes(1.0, 0.0, 5.0))
    events = [debounce.update(float(time_s), level) for time_s, level in enumerate(levels)]
    assert events.index(Event.GOOD) == good_s


def test_muted_debounce_speaks_again_when_unmuted():
    debounce = Debounce(AT_ONCE)
    debounce.mute()
    assert debounce.update(0.0, Level.FAULT) is None
    debounce.unmute()
    assert debounce.update(0.1, Level.FAULT) is Event.FAULTY
