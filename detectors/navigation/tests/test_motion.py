import numpy as np
import pytest

from detectors.navigation.motion import LASTING_S, SMOOTHING_S, BodyMotion
from detectors.navigation.sample import ImuSample
from detectors.navigation.strapdown import Strapdown
from detectors.navigation.tests.dives import Dive, manoeuvring

EXACT = {"accelerometer_noise_mps2": 0.0, "gyroscope_noise_radps": 0.0, "dvl_hz": 0.0, "depth_hz": 0.0}
BIAS_MPS2, BIAS_RADPS = (0.1, -0.1, 0.2), (0.02, -0.01, 0.01)


def followed(motion, duration_s, imu_hz=50.0):
    """(N,) times, (N, 12) what is said of a dive at each sample: smoothed and lasting rate and acceleration."""
    dive = Dive(
        motion=motion,
        duration_s=duration_s,
        imu_hz=imu_hz,
        accelerometer_bias_mps2=BIAS_MPS2,
        gyroscope_bias_radps=BIAS_RADPS,
        **EXACT,
    )
    strapdown = Strapdown(dive.initial, accelerometer_bias_mps2=BIAS_MPS2, gyroscope_bias_radps=BIAS_RADPS)
    body, times_s, rows = BodyMotion(), [], []
    for sample in dive.samples():
        assert isinstance(sample, ImuSample)
        strapdown.advance(sample.specific_force_mps2, sample.angular_rate_radps, 1.0 / imu_hz)
        body.follow(strapdown, sample.angular_rate_radps, 1.0 / imu_hz)
        times_s.append(sample.time_s)
        lasting = (*body.lasting_rate_radps, *body.lasting_acceleration_mps2)
        rows.append((*body.rate_radps, *body.acceleration_mps2, *lasting))
    return np.array(times_s), np.array(rows)


def prescribed(motion, time_s):
    """(6, N) Turn rate and change of the body's velocity, from the motion itself."""
    step = 1e-3
    roll, pitch, _ = motion(time_s)[:3]
    changes = (motion(time_s + step) - motion(time_s - step)) / (2.0 * step)
    roll_rate, pitch_rate, yaw_rate = changes[:3]
    rate = [
        roll_rate - yaw_rate * np.sin(pitch),
        pitch_rate * np.cos(roll) + yaw_rate * np.sin(roll) * np.cos(pitch),
        yaw_rate * np.cos(roll) * np.cos(pitch) - pitch_rate * np.sin(roll),
    ]
    return np.concatenate((rate, changes[3:]))


@pytest.mark.parametrize("imu_hz", [10.0, 50.0])
def test_follows_the_motion_a_little_later(imu_hz):
    times_s, rows = followed(manoeuvring, 30.0, imu_hz)
    late_s = SMOOTHING_S + 0.5 / imu_hz  # a mean over an interval is that of its middle
    np.testing.assert_allclose(rows[100:, :6], prescribed(manoeuvring, times_s[100:] - late_s).T, atol=0.02)
    lasting = prescribed(manoeuvring, times_s[100:] - LASTING_S)
    assert np.abs(rows[100:, 6:] - lasting.T).max() < 0.25
    assert np.abs(rows[100:, 6:] - rows[100:, :6]).max() > 0.1


def circling(time_s):
    """A steady circle, banked: the body's velocity does not change along its axes, for all the force that is felt."""
    one = np.ones_like(time_s)
    return np.array([0.3 * one, 0.1 * one, 0.25 * time_s, 1.5 * one, 0.2 * one, -0.1 * one])


def test_in_a_steady_circle_nothing_changes_but_the_heading():
    _, rows = followed(circling, 20.0)
    np.testing.assert_allclose(rows[-1, :6], prescribed(circling, np.array([10.0]))[:, 0], atol=2e-3)


def said(rate=(0.0, 0.0, 0.0), change=(0.0, 0.0, 0.0), lasting_rate=None, lasting_change=None):
    motion = BodyMotion()
    motion.rate_radps, motion.acceleration_mps2 = rate, change
    motion.lasting_rate_radps = rate if lasting_rate is None else lasting_rate
    motion.lasting_acceleration_mps2 = change if lasting_change is None else lasting_change
    return motion


def test_what_goes_on_as_before_is_steady():
    assert said((0.1, 0.2, 0.3), (1.0, 2.0, 3.0)).unsteady(said((0.1, 0.2, 0.3), (1.0, 2.0, 3.0))) == (0.0, 0.0)


def test_unsteady_is_what_differs_from_before_or_from_later():
    turned = said((0.0, 0.3, 0.4), (0.0, 0.6, 0.8))
    assert turned.unsteady(said()) == pytest.approx((0.5, 1.0))
    assert said().unsteady(turned) == pytest.approx((0.5, 1.0))
    began = said((0.0, 0.3, 0.4), (0.0, 0.6, 0.8), lasting_rate=(0.0,) * 3, lasting_change=(0.0,) * 3)
    assert began.unsteady(turned) == pytest.approx((0.5, 1.0))
