"""The clock goes on evenly whatever is done to the wall clock."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.clock import MAX_AGE_S, Clock


@dataclass
class Time:
    """Both sources of time, moved by hand."""

    wall_s: float = 1_700_000_000.0
    monotonic_s: float = 50.0

    def pass_s(self, seconds: float) -> None:
        self.wall_s += seconds
        self.monotonic_s += seconds

    def clock(self) -> Clock:
        return Clock(lambda: self.wall_s, lambda: self.monotonic_s)


def test_now_is_unix_time_that_goes_on_evenly():
    time = Time()
    clock = time.clock()
    assert clock.now() == pytest.approx(1_700_000_000.0)
    time.pass_s(3.5)
    assert clock.now() == pytest.approx(1_700_000_003.5)


@pytest.mark.parametrize("step_s", [3600.0, -3600.0, 0.25])
def test_a_step_of_the_wall_clock_moves_neither_now_nor_stamps(step_s):
    time = Time()
    clock = time.clock()
    time.pass_s(10.0)
    time.wall_s += step_s
    assert clock.now() == pytest.approx(1_700_000_010.0)
    assert clock.stamp(time.wall_s - 0.004) == pytest.approx(1_700_000_009.996)


@pytest.mark.parametrize("age_s", [-0.001, -3600.0, MAX_AGE_S + 0.1, 1e9, math.nan, math.inf, -math.inf])
def test_a_nonsensical_stamp_becomes_now(age_s):
    time = Time()
    clock = time.clock()
    assert clock.stamp(time.wall_s - age_s) == clock.now()


def test_stamps_keep_the_order_of_the_kernel_when_the_reader_is_interrupted():
    time = Time()
    clock = time.clock()
    received = [time.wall_s - 0.0030, time.wall_s - 0.0029]
    first = clock.stamp(received[0])
    time.wall_s += 0.0015  # interrupted after one clock was read: the other looks 1.5 ms fast
    second = clock.stamp(received[1])
    assert second - first == pytest.approx(0.0001, abs=1e-6)


@given(
    st.lists(st.floats(-100.0, 100.0) | st.just(math.nan), max_size=5),
    st.sampled_from([0.0, 0.001, 0.5, -3600.0]),
)
def test_many_stamps_are_as_each_alone(ages_s, step_s):
    time = Time()
    one_by_one, at_once = time.clock(), time.clock()
    time.wall_s += step_s
    unix_s = [time.wall_s - age_s for age_s in ages_s]
    assert at_once.stamps(np.array(unix_s)).tolist() == [one_by_one.stamp(stamp_s) for stamp_s in unix_s]
    assert at_once.stamp(time.wall_s) == one_by_one.stamp(time.wall_s)  # both know of the step


def test_a_stamp_is_never_in_the_future():
    time = Time()
    clock = time.clock()
    time.monotonic_s += 0.5
    time.wall_s += 0.501
    assert clock.stamp(time.wall_s) <= clock.now()


def test_the_real_clocks_agree():
    clock = Clock()
    assert clock.now() <= clock.now()
