import numpy as np
import pytest

from detectors.navigation.config import NavigationConfig
from detectors.navigation.error_model import (
    ACCELEROMETER_BIAS,
    ATTITUDE,
    DEPTH_SENSOR,
    GYROSCOPE_BIAS,
    POSITION,
    VELOCITY,
    initial_covariance,
)
from detectors.navigation.installation import ALL_STATES, INSTALLED, Installation
from detectors.navigation.uncertainty import covariance_at_start, noise_density, variances_anew, variances_of_gap

CONFIG = NavigationConfig()
FIXED = NavigationConfig(estimate_installation=False)


def test_at_the_start_it_is_the_papers_states_and_the_mounting():
    installation = Installation(np.zeros(10), np.diag(np.arange(1.0, 11.0)))
    covariance = covariance_at_start(CONFIG, installation)
    papers = slice(0, INSTALLED.start)
    np.testing.assert_array_equal(covariance[papers, papers], initial_covariance(CONFIG))
    np.testing.assert_array_equal(covariance[INSTALLED, INSTALLED], installation.covariance)


@pytest.mark.parametrize(("config", "wanders"), [(CONFIG, True), (FIXED, False)])
def test_the_mounting_wanders_where_it_is_estimated(config, wanders):
    assert (np.diag(noise_density(config))[INSTALLED] > 0.0).all() == wanders


def test_a_gap_takes_what_the_imu_would_have_told():
    """Twice as long: attitude and velocity twice as far off, the position four times."""
    once, twice = variances_of_gap(2.0), variances_of_gap(4.0)
    np.testing.assert_allclose(twice[ATTITUDE] / once[ATTITUDE], 4.0)
    np.testing.assert_allclose(twice[VELOCITY] / once[VELOCITY], 4.0)
    np.testing.assert_allclose(twice[POSITION] / once[POSITION], 16.0)
    for kept in (ACCELEROMETER_BIAS, GYROSCOPE_BIAS, DEPTH_SENSOR, INSTALLED):
        np.testing.assert_array_equal(twice[kept], 0.0)


@pytest.mark.parametrize("shaken", [False, True])
def test_begun_anew_only_the_position_stays(shaken):
    variances = variances_anew(CONFIG, shaken=shaken)
    np.testing.assert_array_equal(variances[POSITION], 0.0)
    assert (np.delete(variances, POSITION) > 0.0).all()


def test_a_jump_makes_more_uncertain_than_a_start():
    shaken, usual = (variances_anew(CONFIG, shaken=shaken) for shaken in (True, False))
    for states in (VELOCITY, ACCELEROMETER_BIAS, GYROSCOPE_BIAS):
        assert (shaken[states] > usual[states]).all()
    others = np.setdiff1d(np.arange(ALL_STATES), np.r_[0:6, ACCELEROMETER_BIAS, GYROSCOPE_BIAS])
    np.testing.assert_array_equal(shaken[others], usual[others])
