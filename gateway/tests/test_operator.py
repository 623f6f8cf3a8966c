"""What an operator says of a subject: numbers that mean the same everywhere, and each act with its answer."""

from __future__ import annotations

import pytest

from detectors.verdict import Level
from drivers.mavlink.messages import CommandAck, StatusText
from drivers.readings import AutopilotHeartbeat, OperatorAct, OperatorRequest
from gateway.findings import Finding
from gateway.observation import Observation
from gateway.operator import ALL, CODES, MUTE_MAX_S, MUTE_S, OperatorDesk, code_of, subject_of
from gateway.severity import Severity
from gateway.supervision.actions import Action
from gateway.supervision.announcements import RateLimit
from gateway.supervision.debounce import DebounceTimes
from gateway.supervision.intervention_table import State
from gateway.supervision.settings import Settings
from gateway.supervision.subject import Policy
from gateway.supervisor import Supervisor

AT_ONCE = DebounceTimes(0.0, 0.0, 0.0)
ACCEPTED, DENIED = 0, 2
SENDER = (255, 190)
NAMES = {4: "T4", 101: "Speed", 106: "Navigation", 200: "Subject 200"}


def test_every_number_and_its_subject_belong_together():
    assert {code_of(subject) for subject in CODES.values()} == set(CODES)
    assert [subject_of(code) for code in (0, 1, 99, 101, 102)] == [ALL, "thruster 1", "thruster 99", "vehicle", "dvl"]
    assert len(set(CODES.values())) == len(CODES)


@pytest.mark.parametrize("code", [100, 107, 255, -1])
def test_numbers_of_nothing(code):
    assert subject_of(code) is None


@pytest.mark.parametrize("subject", ["thruster 100", "thruster 0", "Thruster 3", "link can0", ""])
def test_subjects_without_a_number_are_the_callers_mistake(subject):
    with pytest.raises(ValueError, match=r"subject = .*want one of all, vehicle, .* or thruster 1\.\.99"):
        code_of(subject)


class Channel:
    """As much of a detector's channel as the desk needs."""

    def __init__(self, *subjects: str) -> None:
        self._subjects = subjects
        self.accepted = 0

    def told(self) -> tuple[str, ...]:
        return self._subjects

    def accept(self) -> None:
        self.accepted += 1


class Desk:
    """A desk over a supervisor of two thrusters, two sensors of one detector, and a link."""

    def __init__(self) -> None:
        policy, ask = Policy(AT_ONCE), Policy(AT_ONCE, ladder=(Action.HOLD,))
        self.supervisor = Supervisor(
            {"thruster": ask, "navigation": policy, "link": policy}, Settings(limit=RateLimit(600.0, 50))
        )
        self.channels = {
            "thruster 1": Channel("thruster 1"),
            "thruster 3": Channel("thruster 3"),
            "navigation": Channel("dvl", "depth sensor"),
        }
        self.desk = OperatorDesk(self.channels, self.supervisor)
        self.supervisor.heartbeat(AutopilotHeartbeat(0.0, 1, 1, 3, 12, True, 0, 4))

    def see(self, subject: str, level: Level, time_s: float = 1.0) -> list:
        detector = "navigation" if subject == "dvl" else subject.split(maxsplit=1)[0]
        return self.supervisor.observe(Observation(time_s, detector, subject, subject, level, 1.0, "bad"))

    def take(self, act: OperatorAct, code: int, duration_s: float = 0.0, sender: tuple[int, int] = SENDER):
        """The texts, and the answer."""
        *others, answer = self.desk.take(OperatorRequest(2.0, act, code, duration_s, *sender))
        return [one.text for one in others if isinstance(one, StatusText)], answer

    def recorded(self, act: OperatorAct, code: int, sender: tuple[int, int] = SENDER) -> list[str]:
        """What stands in the findings."""
        outcomes = self.desk.take(OperatorRequest(2.0, act, code, 0.0, *sender))
        return [one.text for one in outcomes if isinstance(one, Finding) and one.detector == "operator"]

    def texts(self, time_s: float) -> list[str]:
        return [one.text for one in self.supervisor.advance(time_s) if isinstance(one, StatusText)]


@pytest.fixture
def desk() -> Desk:
    return Desk()


@pytest.mark.parametrize("act", OperatorAct)
@pytest.mark.parametrize("code", [4, 101, 106, 200])
def test_what_is_not_watched_is_denied_and_said(desk, act, code):
    texts, answer = desk.take(act, code)
    assert answer == CommandAck(act, DENIED, *SENDER)
    assert texts == [f"{NAMES[code]} is not watched here"]


def test_acknowledged_it_is_not_repeated_and_nothing_is_asked(desk):
    desk.see("thruster 3", Level.FAULT)
    assert desk.supervisor.intervention is State.COUNTDOWN
    texts, answer = desk.take(OperatorAct.ACKNOWLEDGE, 3)
    assert answer == CommandAck(OperatorAct.ACKNOWLEDGE, ACCEPTED, *SENDER)
    assert texts == ["Hold for thruster 3 cancelled", "T3 acknowledged"]
    assert desk.supervisor.levels()["thruster 3"] is Level.FAULT
    assert desk.texts(100.0) == []


def test_acknowledging_one_leaves_the_others(desk):
    for subject in ("thruster 1", "thruster 3"):
        desk.see(subject, Level.FAULT)
    desk.take(OperatorAct.ACKNOWLEDGE, 3)
    assert desk.texts(100.0) == ["thruster 1 bad"]
    assert desk.supervisor.intervention is not State.IDLE


def test_an_acknowledged_suspicion_that_gets_worse_is_told(desk):
    desk.see("thruster 3", Level.SUSPECT)
    desk.take(OperatorAct.ACKNOWLEDGE, 3)
    (text,) = [one for one in desk.see("thruster 3", Level.FAULT, 3.0) if isinstance(one, StatusText)][:1]
    assert text.severity == Severity.CRITICAL


def test_accepted_it_is_the_new_normal_of_its_detector(desk):
    desk.see("thruster 3", Level.FAULT)
    texts, answer = desk.take(OperatorAct.ACCEPT, 3)
    assert answer.result == ACCEPTED
    assert "thruster 3 fault cleared: operator accepted" in texts
    assert texts[-1] == "T3 accepted as it is"
    assert [channel.accepted for channel in desk.channels.values()] == [0, 1, 0]
    assert desk.supervisor.levels()["thruster 3"] is Level.UNKNOWN


def test_accepting_one_sensor_accepts_the_detector_that_judges_it(desk):
    desk.see("dvl", Level.FAULT)
    desk.take(OperatorAct.ACCEPT, 102)
    assert desk.channels["navigation"].accepted == 1
    assert desk.supervisor.levels()["dvl"] is Level.UNKNOWN


def test_all_is_links_too_and_each_detector_once(desk):
    for subject in ("thruster 1", "dvl", "link can0"):
        desk.see(subject, Level.SUSPECT)
    texts, answer = desk.take(OperatorAct.ACCEPT, 0)
    assert answer.result == ACCEPTED
    assert texts[-1] == "All accepted as it is"
    assert set(desk.supervisor.levels().values()) == {Level.UNKNOWN}
    assert [channel.accepted for channel in desk.channels.values()] == [1, 1, 1]


@pytest.mark.parametrize(("duration_s", "lasts_s"), [(0.0, MUTE_S), (120.0, 120.0), (10.0 * MUTE_MAX_S, MUTE_MAX_S)])
def test_muted_there_are_no_texts_for_so_long_and_findings_and_actions_go_on(desk, duration_s, lasts_s):
    desk.see("dvl", Level.FAULT)
    texts, answer = desk.take(OperatorAct.MUTE, 102, duration_s)
    assert answer.result == ACCEPTED
    assert texts == [f"DVL muted for {lasts_s / 60.0:.0f} min"]
    assert desk.texts(2.0 + lasts_s - 0.1) == []
    assert desk.supervisor.levels()["dvl"] is Level.FAULT
    assert desk.texts(2.0 + lasts_s + 30.0) == ["dvl bad"]


def test_a_muted_thruster_still_gets_its_action(desk):
    desk.see("thruster 3", Level.NORMAL)
    desk.take(OperatorAct.MUTE, 3)
    outgoing = desk.see("thruster 3", Level.FAULT, 3.0)
    assert [one.text for one in outgoing if isinstance(one, StatusText)] == [
        "Hold in 5 s for thruster 3, change mode to stop"
    ]


def test_the_answer_names_whoever_asked(desk):
    _, answer = desk.take(OperatorAct.ACKNOWLEDGE, 3, sender=(0, 0))
    assert (answer.target_system, answer.target_component) == (0, 0)


@pytest.mark.parametrize(("sender", "speaker"), [(SENDER, "255/190"), ((0, 0), "gateway tell")])
def test_who_said_what_is_recorded(desk, sender, speaker):
    desk.see("thruster 3", Level.FAULT)
    assert desk.recorded(OperatorAct.ACKNOWLEDGE, 3, sender) == [f"T3 acknowledged ({speaker})"]
    assert desk.recorded(OperatorAct.MUTE, 200, sender) == [f"Subject 200 is not watched here ({speaker})"]


def test_where_nothing_nags_there_is_nothing_to_acknowledge_or_to_mute(desk):
    desk.see("thruster 3", Level.NORMAL)
    assert desk.take(OperatorAct.ACKNOWLEDGE, 3)[0] == ["T3: nothing to acknowledge"]
    assert desk.take(OperatorAct.MUTE, 0)[0] == ["All: nothing to mute"]
    assert [one for one in desk.see("thruster 3", Level.FAULT, 3.0) if isinstance(one, StatusText)]


def test_short_mutes_are_told_in_seconds(desk):
    desk.see("dvl", Level.FAULT)
    assert desk.take(OperatorAct.MUTE, 102, 12.0)[0] == ["DVL muted for 12 s"]
