"""Texts under one rate limit: what is grave first, nothing that is lost, nothing that is old."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.mavlink.command_exchange import NO_ANSWER
from drivers.mavlink.messages import TEXT_MAX, StatusText
from gateway.severity import Severity
from gateway.supervision import intervention_words as words
from gateway.supervision.actions import Action, Need, Plan, sends
from gateway.supervision.announcements import Announcements, RateLimit
from gateway.supervision.autopilots import AutopilotKind

CRITICAL, ERROR, WARNING, NOTICE = Severity.CRITICAL, Severity.ERROR, Severity.WARNING, Severity.NOTICE
NEVER = 1e-9  # a minute


def text(severity: Severity, words: str = "T3") -> StatusText:
    return StatusText(severity, words)


def test_a_burst_goes_out_at_once_and_the_rest_at_the_rate():
    announcements = Announcements(RateLimit(per_minute=60.0, burst=5))
    out = [len(announcements.say(0.0, f"thruster {n}", text(WARNING))) for n in range(6)]
    assert out == [1, 1, 1, 0, 0, 0]  # the last two are kept
    assert [len(announcements.advance(time_s)) for time_s in (0.9, 1.0, 2.0, 3.0, 4.0)] == [0, 1, 1, 1, 0]


@pytest.mark.parametrize("severity", [CRITICAL, ERROR])
def test_what_is_grave_is_not_kept_waiting_by_what_is_not(severity):
    announcements = Announcements(RateLimit(NEVER, 5))
    for n in range(9):
        announcements.say(0.0, f"thruster {n}", text(WARNING))
    assert announcements.say(0.0, "failsafe", text(severity, "grave")) == [text(severity, "grave")]


def test_of_what_waits_the_gravest_and_then_the_oldest_goes_first():
    announcements = Announcements(RateLimit(60.0, 3))
    for severity in (CRITICAL, CRITICAL, CRITICAL):
        announcements.say(0.0, str(len(str(severity))), text(severity))
    for subject, severity in (("a", NOTICE), ("b", WARNING), ("c", CRITICAL), ("d", WARNING), ("e", CRITICAL)):
        assert announcements.say(0.0, subject, text(severity, subject)) == []
    out = [one.text for tenths in range(200) for one in announcements.advance(tenths / 10)]
    assert out == ["c", "e", "b", "d", "a"]


def test_only_the_newest_of_a_subject_is_said():
    announcements = Announcements(RateLimit(60.0, 3))
    announcements.say(0.0, "thruster 1", text(WARNING))
    announcements.say(0.0, "thruster 3", text(WARNING, "T3 entangled?"))
    announcements.say(0.5, "thruster 3", text(NOTICE, "T3 ok again"))
    assert announcements.advance(10.0) == [text(NOTICE, "T3 ok again")]


def test_what_is_no_longer_so_is_withdrawn():
    announcements = Announcements(RateLimit(60.0, 3))
    announcements.say(0.0, "thruster 1", text(WARNING))
    announcements.say(0.0, "thruster 3", text(WARNING))
    announcements.withdraw("thruster 3")
    assert announcements.advance(10.0) == []


def test_a_clock_that_goes_back_gives_nothing_for_free():
    announcements = Announcements(RateLimit(60.0, 3))
    announcements.say(100.0, "a", text(CRITICAL))
    announcements.say(100.0, "b", text(CRITICAL))
    announcements.say(100.0, "c", text(CRITICAL))
    assert announcements.say(50.0, "d", text(CRITICAL)) == []
    assert announcements.advance(99.0) == []
    assert len(announcements.advance(101.0)) == 1


@given(st.lists(st.tuples(st.floats(0.0, 5.0), st.integers(0, 4), st.sampled_from(Severity)), max_size=60))
def test_the_rate_is_kept_in_every_span_and_the_newest_is_said_in_the_end(said):
    limit = RateLimit(per_minute=60.0, burst=4)
    announcements, time_s, times_s, newest, last = Announcements(limit), 0.0, [], {}, {}
    for number, (after_s, subject, severity) in enumerate(said):
        time_s += after_s
        newest[subject] = text(severity, f"{subject} {number}")
        for one in announcements.say(time_s, str(subject), newest[subject]):
            times_s.append(time_s)
            last[int(one.text.split()[0])] = one
    for begin, since_s in enumerate(times_s):
        for end in range(begin, len(times_s)):
            assert end - begin + 1 <= limit.burst + (times_s[end] - since_s) * limit.per_minute / 60.0 + 1e-6
    for second in range(10):
        for one in announcements.advance(time_s + 10.0 * second):
            last[int(one.text.split()[0])] = one
    assert last == newest


@pytest.mark.parametrize("wrong", [{"per_minute": 0.0}, {"per_minute": math.nan}, {"burst": 2}])
def test_a_limit_that_leaves_nothing_is_the_callers_mistake(wrong):
    with pytest.raises(ValueError, match="want more than"):
        RateLimit(**wrong)


# In which words --------------------------------------------------------------------------------------

LABELS = ("T3", "T1+T2+T3", "T10+T11+T12", "4 faults", "Accel", "Speed")
ANSWERS = ("denied", "unsupported", "failed", "cancelled", NO_ANSWER, "did not come", "rejected for now", "result 7")


def said(outcomes: object) -> str:
    return next(one.text for one in outcomes if isinstance(one, StatusText))


@pytest.mark.parametrize("label", LABELS)
@pytest.mark.parametrize("action", list(filter(sends, Action)))
def test_every_word_on_a_request_is_whole(action, label):
    name = action.capitalize()
    assert said(words.announced(0.0, action, 5.0, label)).startswith(f"{name} in 5 s for {label}")
    assert said(words.done(0.0, action, label, already=False)) == f"{name} done for {label}"
    assert said(words.done(0.0, action, label, already=True)) == f"{name} is on already, good for {label}"
    assert said(words.cancelled(0.0, action, "vehicle disarmed", label)) == f"{name} cancelled: vehicle disarmed"
    assert said(words.cancelled(0.0, action, "", label)).endswith("cancelled")
    assert said(words.recalled(0.0, action, label)).startswith(f"{name} not needed now, may still come")
    assert words.asked(0.0, action, label).text == f"{name} asked for {label}"


@pytest.mark.parametrize("answer", ANSWERS)
@pytest.mark.parametrize("label", LABELS)
def test_a_label_is_left_out_rather_than_cut(label, answer):
    for text in (
        said(words.fell_back(0.0, Action.TERMINATE, answer, Action.SURFACE, label)),
        said(words.given_up(0.0, Action.TERMINATE, answer, label)),
    ):
        assert text.startswith(f"Terminate {answer}")
        assert text.endswith((f" {label}", "asking surface", "yours to act"))


@pytest.mark.parametrize("action", list(filter(sends, Action)))
@pytest.mark.parametrize("kind", AutopilotKind)
def test_why_something_is_not_asked_is_whole(action, kind):
    whys = [
        words.obstacle(kind, Plan("T3", (action,)), own, known) for own in (True, False) for known in (True, False)
    ]
    for why in [*filter(None, whys), *Need, words.NOT_HEARD, words.JUST_NOW]:
        (finding, *_) = words.refrained(0.0, action, why)
        assert len(finding.text) <= TEXT_MAX
        assert finding.text.endswith(why)
