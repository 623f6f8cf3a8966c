"""The supervisor as a whole: what is said of faults, by whom it is cleared, and what is remembered of it."""

import math
import pickle

import pytest
from hypothesis import given
from hypothesis import strategies as st

from detectors.verdict import Level
from drivers.mavlink.messages import CompanionHeartbeat, CompanionState, StatusText
from drivers.readings import AutopilotHeartbeat
from gateway.findings import Finding
from gateway.observation import Observation
from gateway.severity import Severity
from gateway.supervision.actions import Action
from gateway.supervision.announcements import RateLimit
from gateway.supervision.debounce import DebounceTimes
from gateway.supervision.evidence import Geometry
from gateway.supervision.intervention_table import State
from gateway.supervision.levels import TABLE, Event, Say
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


# One cause, said once --------------------------------------------------------------------------------

GEOMETRY = Geometry({"thruster 5": 1.0}, {"thruster 3": 1.0, "thruster 4": 1.0})


class Watch:
    """Thrusters, speed and a DVL that the speed relies on."""

    def __init__(self, thruster: Policy | None = None, **settings: object) -> None:
        policy = Policy(AT_ONCE)
        self.policies = {"thruster": thruster or policy, "speed": policy, "navigation": policy}
        self.settings = Settings(geometry=GEOMETRY, limit=RateLimit(6000.0, 1000), **settings)
        self.supervisor = Supervisor(self.policies, self.settings)

    def thruster(self, time_s: float, level: Level, number: int = 3) -> list:
        subject, label = f"thruster {number}", f"T{number}"
        return self.supervisor.observe(
            Observation(time_s, "thruster", subject, label, level, 1.0, "entangled?", ("812 rpm",))
        )

    def speed(self, time_s: float, level: Level) -> list:
        return self.supervisor.observe(
            Observation(time_s, "speed", "vehicle", "Speed", level, 1.0, "0.52 m/s, want 0.9-1.2", relies_on=("dvl",))
        )

    def dvl(self, time_s: float, level: Level) -> list:
        return self.supervisor.observe(Observation(time_s, "navigation", "dvl", "DVL", level, 1.0, "frozen"))

    def repeated(self, begin_s: int, end_s: int) -> list[tuple[int, str]]:
        """What is said in each second."""
        return [
            (second, text) for second in range(begin_s, end_s) for _, text in texts(self.supervisor.advance(second))
        ]


TOGETHER = "T3 entangled: speed 0.52 m/s, want 0.9-1.2"


def test_a_slow_vehicle_is_said_with_the_thruster_that_makes_it_so():
    watch = Watch()
    assert texts(watch.thruster(0.0, Level.FAULT)) == [(Severity.CRITICAL, "T3 entangled? 812 rpm")]
    assert texts(watch.speed(2.0, Level.FAULT)) == [(Severity.WARNING, TOGETHER)]  # no second CRITICAL
    assert watch.repeated(3, 93) == [(32, TOGETHER), (62, TOGETHER), (92, TOGETHER)]


def test_the_other_way_round_the_thruster_brings_its_slow_vehicle_with_it():
    watch = Watch()
    assert texts(watch.speed(0.0, Level.FAULT)) == [(Severity.CRITICAL, "Speed 0.52 m/s, want 0.9-1.2")]
    assert texts(watch.thruster(2.0, Level.FAULT)) == [(Severity.CRITICAL, TOGETHER)]
    assert watch.repeated(3, 63) == [(32, TOGETHER), (62, TOGETHER)]


def test_when_the_thruster_is_well_again_the_speed_speaks_for_itself():
    watch = Watch()
    watch.thruster(0.0, Level.FAULT)
    watch.speed(2.0, Level.FAULT)
    watch.thruster(10.0, Level.NORMAL)
    assert watch.repeated(11, 40) == [(32, "Speed 0.52 m/s, want 0.9-1.2")]


def test_a_vertical_thruster_explains_no_slow_vehicle():
    watch = Watch()
    watch.thruster(0.0, Level.FAULT, number=5)
    assert texts(watch.speed(2.0, Level.FAULT)) == [(Severity.CRITICAL, "Speed 0.52 m/s, want 0.9-1.2")]


def test_a_thruster_that_is_not_told_of_makes_no_speed_fault_small():
    watch = Watch(thruster=Policy(AT_ONCE, ladder=(Action.NONE,)))
    assert texts(watch.thruster(0.0, Level.FAULT)) == []
    assert texts(watch.speed(2.0, Level.FAULT)) == [(Severity.CRITICAL, TOGETHER)]
    assert watch.repeated(3, 63) == [(32, TOGETHER), (62, TOGETHER)]


def test_acknowledging_the_thruster_does_not_silence_the_speed():
    watch = Watch()
    watch.thruster(0.0, Level.FAULT)
    watch.speed(2.0, Level.FAULT)
    watch.supervisor.acknowledge(["thruster 3"], 3.0)
    assert watch.repeated(3, 63) == [(32, TOGETHER), (62, TOGETHER)]
    watch.supervisor.acknowledge(["vehicle"], 64.0)
    assert watch.repeated(64, 200) == []


def test_a_suspected_thruster_does_not_slow_down_the_repeats_of_a_speed_fault():
    watch = Watch()
    watch.thruster(0.0, Level.SUSPECT)
    watch.speed(2.0, Level.FAULT)
    assert watch.repeated(3, 63) == [(32, TOGETHER), (62, TOGETHER)]


# What relies on a sensor that lies -----------------------------------------------------------------


def test_a_sensor_fault_turns_what_relies_on_it_unknown():
    watch = Watch()
    watch.speed(0.0, Level.FAULT)
    watch.dvl(1.0, Level.FAULT)
    assert texts(watch.supervisor.advance(1.1)) == [(Severity.NOTICE, "Speed unknown: DVL faulty")]
    assert watch.supervisor.levels()["vehicle"] is Level.UNKNOWN
    assert watch.speed(1.2, Level.FAULT) == []
    watch.dvl(5.0, Level.NORMAL)
    assert texts(watch.speed(5.1, Level.FAULT)) == [(Severity.CRITICAL, "Speed 0.52 m/s, want 0.9-1.2")]


def test_a_suspected_sensor_leaves_it_as_it_is():
    watch = Watch()
    watch.dvl(0.0, Level.SUSPECT)
    watch.speed(1.0, Level.FAULT)
    assert watch.supervisor.levels()["vehicle"] is Level.FAULT


# Who is there --------------------------------------------------------------------------------------


def test_an_autopilot_is_told_once_what_is_watched_and_again_after_two_were_heard():
    watch = Watch(watching="Watching 8 thrusters")
    said = [one.text for one in watch.supervisor.heartbeat(heartbeat(0.0, True)) if isinstance(one, StatusText)]
    assert said == ["Watching 8 thrusters"]
    assert watch.supervisor.heartbeat(heartbeat(1.0, True)) == []
    watch.supervisor.conflict()
    assert watch.supervisor.heartbeat(heartbeat(1.5, True)) == []
    watch.supervisor.conflict(several=False)
    assert len(watch.supervisor.heartbeat(heartbeat(2.0, True))) == 1


def test_an_autopilot_that_is_not_known_is_told_so():
    watch = Watch()
    copter = AutopilotHeartbeat(0.0, 1, 1, 3, 2, True, 19, 4)
    (text,) = watch.supervisor.heartbeat(copter)
    assert text == StatusText(Severity.INFO, "Autopilot 3, type 2 unknown: advice only")


# What is remembered ---------------------------------------------------------------------------------


def restarted(watch: Watch) -> Watch:
    new = Watch()
    new.policies, new.settings = watch.policies, watch.settings
    new.supervisor = Supervisor(watch.policies, watch.settings)
    new.supervisor.resume(pickle.loads(pickle.dumps(watch.supervisor.remember())))  # noqa: S301  our own bytes
    return new


def test_a_fault_goes_on_over_a_restart_and_is_not_said_before_its_time():
    watch = Watch()
    watch.thruster(0.0, Level.FAULT)
    new = restarted(watch)
    assert new.supervisor.levels() == {"thruster 3": Level.FAULT}
    assert new.repeated(5, 35) == [(30, "T3 entangled? 812 rpm")]
    assert texts(new.thruster(36.0, Level.NORMAL)) == [(Severity.NOTICE, "T3 ok again: 812 rpm")]


def test_what_the_operator_said_holds_over_a_restart():
    watch = Watch()
    watch.thruster(0.0, Level.FAULT)
    watch.dvl(0.0, Level.FAULT)
    watch.supervisor.acknowledge(["thruster 3"], 1.0)
    watch.supervisor.mute(["dvl"], 1.0, 60.0)
    assert restarted(watch).repeated(5, 60) == []


def test_subjects_that_are_not_watched_any_more_are_forgotten():
    watch = Watch()
    watch.thruster(0.0, Level.FAULT)
    watch.policies = {"speed": Policy(AT_ONCE)}
    assert restarted(watch).supervisor.levels() == {}


def test_a_request_is_not_made_again_after_a_restart():
    watch = Watch(thruster=Policy(AT_ONCE, ladder=(Action.HOLD,)), delay_s=0.0)
    watch.supervisor.heartbeat(heartbeat(0.0, True))
    assert [type(one).__name__ for one in watch.thruster(0.5, Level.FAULT)].count("CommandLong") == 1
    new = restarted(watch)
    for second in range(1, 120):
        outgoing = new.supervisor.heartbeat(heartbeat(float(second), True)) + new.supervisor.advance(float(second))
        assert "CommandLong" not in [type(one).__name__ for one in outgoing]
    assert new.supervisor.intervention is State.SPENT
