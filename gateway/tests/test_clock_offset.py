"""The sender's clock: jitter goes, drift is followed, a restart is noticed."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.clock_offset import SLEW, STEP_S, WINDOW_S, ClockOffset

RATE_HZ = 50
LINK_S = 0.004  # shortest delay


def stream(seconds, offset_s=1.7e9, drift=0.0, jitter_s=0.03, seed=1):
    """Stamps and receptions of an even stream over a link with queues; the local clock is the true one."""
    true_s = np.arange(0.0, seconds, 1.0 / RATE_HZ)
    delays = LINK_S + np.random.default_rng(seed).exponential(jitter_s, true_s.size)
    received = np.maximum.accumulate(offset_s + true_s + delays)  # a link keeps the order
    return list(zip(((1.0 + drift) * true_s).tolist(), received.tolist(), (offset_s + true_s).tolist(), strict=True))


def errors(clock, messages):
    return np.array([clock.time_s(boot_s, received_s) - true_s for boot_s, received_s, true_s in messages])


def test_jitter_is_gone_after_some_seconds():
    messages = stream(60.0)
    wrong = errors(ClockOffset(), messages)[10 * RATE_HZ :]
    jitter = np.array([received_s - true_s for _, received_s, true_s in messages])
    assert np.std(jitter) > 0.02
    assert np.std(wrong) < 0.0003
    assert np.abs(wrong - LINK_S).max() < 0.002


@pytest.mark.parametrize("drift", [-1e-4, -2e-5, 2e-5, 1e-4])
def test_drift_is_followed(drift):
    wrong = errors(ClockOffset(), stream(600.0, drift=drift))[60 * RATE_HZ :]
    assert np.abs(wrong - LINK_S).max() < 0.006  # 100 ppm over the window are 3 ms; 60 ms over the whole time


@given(st.lists(st.floats(0.0, STEP_S), min_size=10, max_size=300))
def test_times_rise_and_no_interval_is_far_off(delays):
    clock = ClockOffset()
    times = [clock.time_s(n / RATE_HZ, 1.7e9 + n / RATE_HZ + delay_s) for n, delay_s in enumerate(delays)]
    intervals = [later - earlier for earlier, later in pairwise(times)]
    assert min(intervals) > (1.0 - 2 * SLEW) / RATE_HZ
    assert max(intervals) < (1.0 + 2 * SLEW) / RATE_HZ


def test_what_waited_for_the_link_to_open_is_soon_forgotten():
    held = [(boot_s, max(received_s, 1.7e9 + 3.0), true_s) for boot_s, received_s, true_s in stream(20.0)]
    wrong = errors(ClockOffset(), held)
    assert wrong[0] > 2.9
    assert np.abs(wrong[4 * RATE_HZ :]).max() < 0.1
    assert np.abs(wrong[10 * RATE_HZ :]).max() < 0.01


def test_a_restart_is_followed_at_once():
    clock = ClockOffset()
    errors(clock, stream(20.0))
    again = stream(20.0, offset_s=1.7e9 + 40.0, seed=2)
    wrong = errors(clock, again)
    assert clock.leaps == 1
    assert np.abs(wrong[10 * RATE_HZ :] - LINK_S).max() < 0.002
    assert wrong.max() < 0.2


def test_a_clock_that_leaps_ahead_is_followed_at_once():
    clock = ClockOffset()
    errors(clock, stream(20.0))
    assert clock.time_s(1.6e9, 1.7e9 + 20.0) == 1.7e9 + 20.0
    assert clock.leaps == 1


def test_messages_that_a_link_held_up_keep_their_times():
    clock, messages = ClockOffset(), stream(60.0, jitter_s=0.002)
    errors(clock, messages[: 30 * RATE_HZ])
    held = [
        (boot_s, max(received_s, 1.7e9 + 40.0), true_s) for boot_s, received_s, true_s in messages[30 * RATE_HZ :]
    ]
    assert np.abs(errors(clock, held) - LINK_S).max() < 0.002
    assert clock.leaps == 0


def test_a_clock_that_stood_still_is_given_up_on_after_a_while():
    clock = ClockOffset()
    errors(clock, stream(20.0))
    paused = [(boot_s + 20.0, received_s + 100.0, true_s + 100.0) for boot_s, received_s, true_s in stream(60.0)]
    wrong = errors(clock, paused)
    assert clock.leaps == 1
    assert np.abs(wrong[50 * RATE_HZ :] - LINK_S).max() < 0.005


@given(st.lists(st.tuples(st.floats(0, 1e6), st.floats(0, 1e6)), max_size=100))
def test_whatever_comes_nothing_raises_and_little_is_kept(stamps):
    clock = ClockOffset()
    for boot_s, received_s in stamps:
        assert clock.time_s(boot_s, received_s) == clock.time_s(boot_s, received_s)
    assert len(clock._least) <= WINDOW_S + 2
