from copy import copy
from dataclasses import replace
from math import pi, remainder

import numpy as np
import pytest

from detectors.navigation.error_model import GYROSCOPE_BIAS, strapdown_error
from detectors.navigation.installation import (
    ALL_STATES,
    DEPTH_ARM,
    DEPTH_DELAY,
    DVL_DELAY,
    INSTALLED,
    LEVER_ARM,
    MOUNTING,
    SCALE,
)
from detectors.navigation.measurement import (
    ROUGH_S,
    Moment,
    compare_depth,
    compare_dvl,
    compare_fix,
    compare_heading,
)
from detectors.navigation.motion import BodyMotion
from detectors.navigation.rotation import from_euler, rotate, rotate_back
from detectors.navigation.sample import AttitudeSample, DepthSample, DvlSample, FixSample, NavigationState
from detectors.navigation.strapdown import Strapdown

STATE = NavigationState(10.0, 0.6, 0.5, 40.0, (1.1, -0.7, 0.4), (0.15, -0.3, 2.0))
RATE, CHANGE = (0.05, -0.1, 0.3), (0.2, -0.15, 0.1)
NOISE_MPS = np.array([0.01, 0.02, 0.03])
CONSTANTS = np.zeros(ALL_STATES)
CONSTANTS[LEVER_ARM] = -1.5, 0.3, 0.2
CONSTANTS[MOUNTING] = 0.005, -0.01, 0.008
CONSTANTS[SCALE], CONSTANTS[DVL_DELAY], CONSTANTS[DEPTH_DELAY], CONSTANTS[DEPTH_ARM] = 0.01, 0.4, -0.2, 1.2
CONSTANTS[INSTALLED.start - 1] = 0.1  # the depth sensor's own error


def moving(rate=RATE, change=CHANGE):
    motion = BodyMotion()
    motion.rate_radps, motion.acceleration_mps2 = rate, change
    return motion


def moment(**changes):
    return Moment(Strapdown(STATE), moving(), CONSTANTS)._replace(**changes)


def erring(one, states, *, delay):
    """The moment as it is if its states err by so much: what the filter would have if it corrected them."""
    strapdown = copy(one.strapdown)
    strapdown.correct(strapdown_error(states))
    motion = moving(tuple(np.subtract(one.motion.rate_radps, states[GYROSCOPE_BIAS])), one.motion.acceleration_mps2)
    ahead_s = one.ahead_s - states[delay]
    return one._replace(strapdown=strapdown, motion=motion, constants=one.constants + states, ahead_s=ahead_s)


SAMPLES = {
    "dvl": (lambda one: compare_dvl(DvlSample(10.0, (1.0, 0.2, 0.1)), one, NOISE_MPS), DVL_DELAY),
    "depth": (lambda one: compare_depth(DepthSample(10.0, 39.0), one, 0.05), DEPTH_DELAY),
    "fix": (lambda one: compare_fix(FixSample(10.0, 0.60001, 0.50001), one, 3.0), DVL_DELAY),
    "heading": (lambda one: compare_heading(AttitudeSample(10.0, (0.0, 0.0, 2.1)), one, 0.05), DVL_DELAY),
}


@pytest.mark.parametrize(("compare", "delay"), SAMPLES.values(), ids=SAMPLES)
def test_derivatives_by_each_state_are_the_differences(compare, delay):
    here, step = moment(), 1e-4
    numerical = np.zeros_like(compare(here).observation)
    for state, unit in enumerate(np.eye(ALL_STATES)):
        above, below = (compare(erring(here, sign * step * unit, delay=delay)).innovation for sign in (1.0, -1.0))
        numerical[:, state] = (below - above) / (2.0 * step)  # measured minus expected: the other way round
    # the mounting (0.01) and the scale (0.01) are left out where they are second
    for modelled, difference in zip(compare(here).observation.T, numerical.T, strict=True):
        np.testing.assert_allclose(modelled, difference, atol=0.03 * np.abs(difference).max() + 2e-5)
    assert np.abs(numerical).max() > 0.1


def small_rotation(vector):
    """Small rotation vector as a quaternion, by its series."""
    half = 0.5 * vector
    return (float(np.sqrt(1.0 - half @ half)), *half.tolist())


def test_what_a_dvl_on_a_turning_vehicle_sees_is_no_innovation():
    body = rotate_back(from_euler(STATE.attitude_rad), STATE.velocity_mps)
    place = np.add(body, np.cross(RATE, CONSTANTS[LEVER_ARM])) + 0.05 * np.array(CHANGE)
    seen = 1.01 * np.array(rotate_back(small_rotation(CONSTANTS[MOUNTING]), tuple(place.tolist())))
    comparison = compare_dvl(DvlSample(10.0, tuple(seen.tolist())), moment(ahead_s=0.05), NOISE_MPS)
    np.testing.assert_allclose(comparison.innovation, 0.0, atol=3e-4)  # the mounting squared


def test_what_a_depth_sensor_in_the_bow_sees_is_no_innovation():
    bow_m = rotate(from_euler(STATE.attitude_rad), (1.2, 0.0, 0.0))[2]
    depth_m = STATE.depth_m + 0.1 + bow_m + 0.05 * STATE.velocity_mps[2]
    comparison = compare_depth(DepthSample(10.0, depth_m), moment(ahead_s=0.05), 0.05)
    np.testing.assert_allclose(comparison.innovation, 0.0, atol=1e-12)


def test_a_fix_across_the_date_line_is_near():
    here = Strapdown(replace(STATE, longitude_rad=pi - 1e-6))
    over = FixSample(10.0, STATE.latitude_rad, -pi + 1e-6)
    north_m, east_m = compare_fix(over, moment(strapdown=here), 3.0).innovation
    assert north_m == pytest.approx(0.0, abs=1e-6)
    assert east_m == pytest.approx(2e-6 * 6.3848e6 * np.cos(0.6), rel=1e-3)


def test_a_heading_on_the_other_side_of_south_is_near():
    here = Strapdown(replace(STATE, attitude_rad=(0.0, 0.0, pi - 0.01)))
    for turns in (0.0, 2.0 * pi, -6.0 * pi):
        sample = AttitudeSample(10.0, (0.0, 0.0, -pi + 0.01 + turns))
        assert compare_heading(sample, moment(strapdown=here), 0.05).innovation[0] == pytest.approx(0.02)


def test_of_a_vehicle_that_points_straight_up_a_heading_says_little():
    level, up = (
        compare_heading(
            AttitudeSample(10.0, (0.0, 0.0, 0.0)),
            moment(strapdown=Strapdown(replace(STATE, attitude_rad=(0.0, pitch, 0.0)))),
            0.05,
        )
        for pitch in (0.0, 0.5 * pi)
    )
    assert level.noise[0, 0] == pytest.approx(0.05**2)
    assert up.noise[0, 0] > 50.0 * level.noise[0, 0]
    assert np.isfinite(up.observation).all()
    assert remainder(level.innovation[0], 2.0 * pi) == pytest.approx(0.0)


STEADY = moving((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def dvl_noise(**changes):
    return compare_dvl(DvlSample(10.0, (1.0, 0.0, 0.0)), moment(**changes), NOISE_MPS).noise


def depth_noise(**changes):
    return compare_depth(DepthSample(10.0, 40.0), moment(**changes), 0.05).noise[0, 0]


def test_straight_on_the_noise_is_the_sensor_s_own():
    level = Strapdown(replace(STATE, velocity_mps=(1.0, 0.0, 0.0)))
    np.testing.assert_allclose(dvl_noise(motion=STEADY), np.diag(NOISE_MPS**2))
    assert depth_noise(motion=STEADY, strapdown=level) == pytest.approx(0.05**2)


@pytest.mark.parametrize("noise", [dvl_noise, depth_noise])
def test_noise_grows_with_the_manoeuvre_and_what_is_not_known_of_the_delay(noise):
    steady = noise(motion=STEADY)
    turning = noise(motion=moving((0.1, 0.2, 0.3), (0.0, 0.0, 0.0)))
    harder = noise(motion=moving((0.2, 0.4, 0.6), (0.0, 0.0, 0.0)))
    errors = {"dvl_delay_error_s": 0.5, "depth_delay_error_s": 0.5}
    unsteady = noise(motion=STEADY, unsteady_radps=0.2, unsteady_mps2=0.3, **errors)
    assert (np.diag(np.atleast_2d(turning - steady)) > 0.0).all()
    np.testing.assert_allclose(harder - steady, 4.0 * (turning - steady), rtol=1e-9)
    assert (np.diag(np.atleast_2d(unsteady - steady)) > 0.0).all()
    np.testing.assert_array_equal(noise(motion=STEADY, unsteady_radps=0.2, unsteady_mps2=0.3), steady)


def test_noise_of_a_dvl_grows_with_acceleration_and_caution():
    steady, pushed = dvl_noise(motion=STEADY), dvl_noise(motion=moving((0.0, 0.0, 0.0), (0.3, 0.0, 0.0)))
    assert (np.diag(pushed - steady) > 0.0).all()
    np.testing.assert_allclose(dvl_noise(caution=3.0) - steady, 9.0 * (dvl_noise() - steady), rtol=1e-9)


@pytest.mark.parametrize("noise", [dvl_noise, depth_noise])
def test_samples_that_come_faster_do_not_say_more_of_what_lasts(noise):
    level = {"strapdown": Strapdown(replace(STATE, velocity_mps=(1.0, 0.0, 0.0)))}
    own = noise(motion=STEADY, **level)
    slow, fast = (noise(interval_s=interval_s, **level) - own for interval_s in (ROUGH_S, 0.1 * ROUGH_S))
    np.testing.assert_allclose(fast, 10.0 * slow, rtol=1e-9)
    np.testing.assert_allclose(noise(interval_s=5.0 * ROUGH_S, **level) - own, slow, rtol=1e-9)
    assert np.isfinite(noise(interval_s=0.0)).all()
