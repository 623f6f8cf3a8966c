"""A level counts when it has lasted: rise and fall times of their own, and what does not end them."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from detectors.verdict import Level
from gateway.supervision.debounce import Debounce, DebounceTimes
from gateway.supervision.levels import Event

AT_ONCE = DebounceTimes(0.0, 0.0, 0.0)
NORMAL, UNKNOWN, SUSPECT, FAULT = Level.NORMAL, Level.UNKNOWN, Level.SUSPECT, Level.FAULT


@pytest.mark.parametrize("wrong", [(-1.0, 0.0, 0.0), (0.0, math.nan, 0.0), (0.0, 0.0, -1e-9)])
def test_debounce_times(wrong):
    with pytest.raises(ValueError, match="want 0 or more"):
        DebounceTimes(*wrong)


@pytest.mark.parametrize(
    ("level", "after_s", "event"),
    [
        (SUSPECT, 1.0, Event.SUSPICIOUS),
        (FAULT, 2.0, Event.FAULTY),
        (NORMAL, 5.0, Event.GOOD),
        (UNKNOWN, 5.0, Event.LEARNING),
    ],
)
def test_each_level_counts_when_its_own_time_is_over(level, after_s, event):
    debounce = Debounce(DebounceTimes(1.0, 2.0, 5.0))
    assert debounce.update(10.0, level) is None
    assert debounce.update(10.0 + after_s - 0.01, level) is not event
    assert debounce.update(10.0 + after_s, level) is event
    assert debounce.update(20.0 + after_s, level) is event


def test_a_fault_counts_as_suspicious_until_it_has_lasted():
    debounce = Debounce(DebounceTimes(1.0, 2.0, 5.0))
    debounce.update(0.0, SUSPECT)
    assert debounce.update(0.9, FAULT) is None
    assert debounce.update(1.0, FAULT) is Event.SUSPICIOUS
    assert debounce.update(2.9, FAULT) is Event.FAULTY


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
    assert debounce.update(0.0, FAULT) is None
    debounce.unmute()
    assert debounce.update(0.1, FAULT) is Event.FAULTY


def test_muted_debounce_speaks_again_when_what_was_bad_was_away():
    debounce = Debounce(AT_ONCE)
    debounce.mute()
    debounce.update(0.0, NORMAL)
    assert debounce.update(0.1, FAULT) is Event.FAULTY


def test_reset_begins_anew():
    debounce = Debounce(DebounceTimes(1.0, 1.0, 5.0))
    debounce.update(0.0, FAULT)
    debounce.reset()
    assert debounce.update(1.0, FAULT) is None
    assert debounce.update(2.0, FAULT) is Event.FAULTY


@given(st.lists(st.tuples(st.floats(0.0, 3.0), st.sampled_from(Level)), max_size=40))
def test_an_event_is_always_of_a_level_that_lasted_without_a_break(steps):
    times = DebounceTimes(1.0, 2.0, 5.0)
    debounce, time_s, bad_since_s = Debounce(times), 0.0, None
    for interval_s, level in steps:
        time_s += interval_s
        bad_since_s = None if level is not FAULT else bad_since_s if bad_since_s is not None else time_s
        event = debounce.update(time_s, level)
        assert (event is Event.FAULTY) == (bad_since_s is not None and time_s - bad_since_s >= times.fault_s)
        assert event is not Event.GOOD or level is NORMAL
