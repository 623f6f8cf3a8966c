"""Order, credible times, newest values: what logs of several kinds share."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivers.logs.boot_clock import BY_GPS, BootClock
from drivers.logs.damage import DamageReport
from drivers.logs.heartbeats import Heartbeats, StateChange
from drivers.logs.kinds import looks_like
from drivers.logs.stamped import Newest, Stamped, TimeOrder, credible
from drivers.readings import LinkState


def stamped(*times_s: float) -> Stamped:
    readings = [LinkState(time_s, "can0", True, "") for time_s in times_s]
    return Stamped(np.array(times_s), np.arange(len(times_s)), readings)


@settings(deadline=None)
@given(
    st.lists(st.tuples(st.lists(st.floats(0.0, 9.0), max_size=6), st.floats(0.0, 9.0)), max_size=6),
)
def test_all_come_out_once_and_in_order_or_are_counted(parts):
    damage = DamageReport()
    order, given_s, taken_s = TimeOrder(damage), [], []
    for times_s, until_s in parts:
        due = [reading.time_s for reading in order.take([stamped(*times_s)], until_s)]
        assert due == sorted(due)
        assert all(time_s <= until_s for time_s in due)
        given_s += due
        taken_s += times_s
    given_s += [reading.time_s for reading in order.rest()]
    assert given_s == sorted(given_s)
    assert len(given_s) + sum(damage.lost.values()) == len(taken_s)
    assert order.rest() == []


@given(st.lists(st.floats(0.0, 1.0), min_size=8, max_size=40), st.data())
def test_one_damaged_time_among_good_ones_is_not_credible(steps_s, data):
    time_s = 100.0 + np.cumsum(steps_s)
    assert credible(time_s).all()
    place = data.draw(st.integers(0, len(time_s) - 1))
    time_s[place] += data.draw(st.sampled_from([-90.0, 60.0, 1e9]))
    wanted = np.ones(len(time_s), dtype=bool)
    wanted[place] = False
    assert (credible(time_s) == wanted).all()


def test_a_log_that_paused_is_credible():
    assert credible(np.array([1.0, 1.1, 1.2, 1.3, 500.0, 500.1, 500.2, 500.3])).all()
    assert credible(np.array([1.0, 900.0])).all()
    assert len(credible(np.empty(0))) == 0


def test_the_newest_value_ages():
    newest = Newest(1)
    assert np.isnan(newest.at(np.array([1.0]))).all()
    newest.take(np.array([1.0, 2.0]), np.array([[10.0], [20.0]]))
    newest.take(np.array([3.0]), np.array([[30.0]]))
    values = newest.at(np.array([1.5, 2.0, 2.9, 3.0, 3.4, 4.0]), max_age_s=0.5)[:, 0]
    np.testing.assert_array_equal(values, [np.nan, 20.0, np.nan, 30.0, 30.0, np.nan])


def test_heartbeats_of_a_pause_of_days_are_not_made_up():
    beats = Heartbeats(1, 3, 12, armed=True)
    first = beats.take([StateChange(1.0, 0, custom_mode=19)], 2.5)
    assert [beat.time_s for beat in first.readings] == [1.0, 2.0]
    assert len(beats.take([], 200_000.0).readings) == 0
    assert len(beats.take([], 200_002.5).readings) == 3


def test_nothing_is_said_before_the_mode_is_known():
    beats = Heartbeats(1, 3, 12, armed=False)
    assert len(beats.take([StateChange(1.0, 0, armed=True)], 9.0).readings) == 0


@pytest.mark.parametrize(
    ("head", "words"),
    [
        (b"FMT, 128, 89, FMT", "text"),
        (b"\x1f\x8b\x08", "gzip"),
        (b"LOGG", "BLF"),
        (b";$FILEVERSION=1.1", "TRC"),
        (b"\xfe\x09\x00", "without times"),
        (bytes(7) + b"\x01\xfe\x09", "tlog"),
        (b"\x00\x01", "unknown"),
    ],
)
def test_a_file_is_told_by_its_beginning(head, words):
    assert words in looks_like(head)


def test_a_clock_must_be_finite():
    assert BootClock(1.7e9, BY_GPS).is_unix
    assert not BootClock().is_unix
    with pytest.raises(ValueError, match="offset_s"):
        BootClock(math.nan)
