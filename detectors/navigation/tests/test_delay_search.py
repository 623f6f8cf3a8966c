import pickle

import numpy as np
import pytest

from detectors.navigation.delay_search import EARLIEST_S, LATEST_S, DelaySearch
from detectors.navigation.sample import DvlSample
from detectors.navigation.tests.dives import Dive, Mounting, legs, manoeuvring

NOISE_MPS, INTERVAL_S = 0.01, 0.05
BIAS_MPS2 = np.array([0.02, -0.02, 0.01])


def felt(motion, time_s):
    """(6, N) Change of the body's velocity, with an error, and turn rate: from the motion itself."""
    step = 1e-3
    roll, pitch, _ = motion(time_s)[:3]
    changes = (motion(time_s + step) - motion(time_s - step)) / (2.0 * step)
    roll_rate, pitch_rate, yaw_rate = changes[:3]
    rate = [
        roll_rate - yaw_rate * np.sin(pitch),
        pitch_rate * np.cos(roll) + yaw_rate * np.sin(roll) * np.cos(pitch),
        yaw_rate * np.cos(roll) * np.cos(pitch) - pitch_rate * np.sin(roll),
    ]
    return np.concatenate((changes[3:] + BIAS_MPS2[:, None], rate))


def searched(mounting, *, motion=manoeuvring, until_s=100.0, outlier=0.0, search=None, pickled=False):
    """A guess and the time of it; or none, and the search."""
    dive = Dive(motion=motion, mounting=mounting, duration_s=until_s, imu_hz=1.0, depth_hz=0.0)
    search = DelaySearch(0.0, (0.0, 0.0, 0.0), NOISE_MPS) if search is None else search
    waiting = [sample for sample in dive.samples() if isinstance(sample, DvlSample)]
    times_s = np.arange(1, round(until_s / INTERVAL_S)) * INTERVAL_S
    for time_s, row in zip(times_s.tolist(), felt(motion, times_s).T.tolist(), strict=True):
        if pickled and round(time_s / INTERVAL_S) % 70 == 0:
            search = pickle.loads(pickle.dumps(search))  # noqa: S301
        search.move(time_s, tuple(row[:3]), tuple(row[3:]), INTERVAL_S)
        while waiting and waiting[0].time_s <= time_s:
            sample = waiting.pop(0)
            off = outlier * (round(2.0 * sample.time_s) % 15 == 0)
            search.measure(DvlSample(sample.time_s, tuple(one + off for one in sample.velocity_mps)))
            if (guess := search.guess()) is not None:
                return time_s, guess
    return None, search


@pytest.mark.parametrize("delay_s", [-0.9, -0.3, 0.0, 0.6, 1.5])
def test_finds_delay_and_lever_arm(delay_s):
    mounting = Mounting(lever_arm_m=(-1.2, 0.2, 0.4), dvl_delay_s=delay_s)
    _, guess = searched(mounting)
    assert guess.delay_s == pytest.approx(delay_s, abs=0.12)
    np.testing.assert_allclose(guess.arm_m, mounting.lever_arm_m, atol=0.4)
    assert (np.sqrt(np.diag(guess.covariance)) < 0.4).all()


def test_tries_about_what_it_was_told():
    about = DelaySearch(2.0, (-1.0, 0.0, 0.5), NOISE_MPS)
    mounting = Mounting(lever_arm_m=(-1.2, 0.2, 0.4), dvl_delay_s=LATEST_S + 0.5)
    _, guess = searched(mounting, search=about)
    assert guess.delay_s == pytest.approx(mounting.dvl_delay_s, abs=0.12)
    np.testing.assert_allclose(guess.arm_m, mounting.lever_arm_m, atol=0.4)


@pytest.mark.parametrize("delay_s", [EARLIEST_S - 0.5, LATEST_S + 0.6])
def test_a_delay_beyond_those_tried_is_not_guessed_at(delay_s):
    """At the edge, the best one tried is not the best."""
    assert searched(Mounting(dvl_delay_s=delay_s), until_s=60.0)[0] is None


def ahead(time_s):
    still = np.zeros_like(time_s)
    return np.array([still, still, still, 1.5 + still, still, still])


def test_straight_on_nothing_can_be_known():
    assert searched(Mounting(dvl_delay_s=0.6), motion=ahead)[0] is None


def test_the_harder_it_turns_the_sooner_it_is_known():
    mounting = Mounting(lever_arm_m=(-1.2, 0.2, 0.4), dvl_delay_s=0.6)
    hard_s, _ = searched(mounting)
    easy_s, guess = searched(mounting, motion=legs, until_s=200.0)
    assert hard_s < 60.0
    assert easy_s is None or easy_s > hard_s
    assert easy_s is None or guess.delay_s == pytest.approx(0.6, abs=0.2)


def test_outliers_do_not_mislead():
    _, guess = searched(Mounting(lever_arm_m=(-1.2, 0.2, 0.4), dvl_delay_s=0.6), outlier=3.0)
    assert guess.delay_s == pytest.approx(0.6, abs=0.12)


def test_pickled_it_goes_on_bit_for_bit():
    mounting = Mounting(lever_arm_m=(-1.2, 0.2, 0.4), dvl_delay_s=-0.4)
    whole_s, whole = searched(mounting)
    parts_s, parts = searched(mounting, pickled=True)
    assert (parts_s, parts.delay_s) == (whole_s, whole.delay_s)
    np.testing.assert_array_equal(parts.arm_m, whole.arm_m)
    np.testing.assert_array_equal(parts.covariance, whole.covariance)
