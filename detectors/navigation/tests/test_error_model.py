from copy import copy
from math import pi

import numpy as np
import pytest
from scipy.linalg import expm

from detectors.navigation import strapdown as strapdown_module
from detectors.navigation.config import NavigationConfig
from detectors.navigation.earth import gravity_mps2
from detectors.navigation.error_model import (
    ACCELEROMETER_BIAS,
    ATTITUDE,
    DEPTH_SENSOR,
    DEPTH_SENSOR_ERROR_M,
    GYROSCOPE_BIAS,
    POSITION,
    STATES,
    VELOCITY,
    error_dynamics,
    initial_covariance,
    process_noise,
    strapdown_error,
    transition,
)
from detectors.navigation.rotation import between
from detectors.navigation.sample import NavigationState
from detectors.navigation.strapdown import Strapdown

# small enough for a linear model, large enough for the digits of a latitude
STEPS = np.repeat((1e-4, 1.0, 1e4, 1e-2, 1e-5), 3)
# in flight rather than at sea: every term of the model is of a size to be seen
START = NavigationState(0.0, 1.0, 0.5, 3000.0, (60.0, -90.0, 15.0), (0.3, -0.4, 2.0))
SAMPLE = ((0.7, -1.1, -9.3), (0.05, -0.03, 0.2))
INTERVAL_S, COUNT = 0.005, 200


def driven(strapdown):
    for _ in range(COUNT):
        strapdown.advance(*SAMPLE, INTERVAL_S)
    return strapdown


def difference(truth, ours):
    """(15,) The true states minus ours, metres by our own radii."""
    meridian, transverse = ours.earth.meridian_m - ours.depth_m, ours.earth.transverse_m - ours.depth_m
    turned = np.remainder(truth.longitude_rad - ours.longitude_rad + pi, 2 * pi) - pi
    return np.concatenate(
        (
            between(ours.attitude, truth.attitude),
            np.subtract(truth.velocity_mps, ours.velocity_mps),
            (
                (truth.latitude_rad - ours.latitude_rad) * meridian,
                turned * transverse * ours.earth.cosine,
                truth.depth_m - ours.depth_m,
            ),
            np.subtract(truth.accelerometer_bias_mps2, ours.accelerometer_bias_mps2),
            np.subtract(truth.gyroscope_bias_radps, ours.gyroscope_bias_radps),
        )
    )


def displaced(strapdown, states):
    moved = copy(strapdown)
    moved.correct(strapdown_error(np.append(states, 0.0)))
    return moved


def numerical_growth():
    """(15, 15) (Phi - I) of a second, by pairs of systems that are driven with the same samples."""
    start = Strapdown(START)
    ours = driven(copy(start))
    columns = []
    for step, unit in zip(STEPS, np.eye(len(STEPS)), strict=True):
        above, below = (difference(driven(displaced(start, sign * step * unit)), ours) for sign in (1, -1))
        columns.append((above - below) / (2.0 * step) - unit)
    return np.array(columns).T


def modelled_growth():
    ours, product = Strapdown(START), np.eye(STATES)
    for _ in range(COUNT):
        middle = copy(ours)
        middle.advance(*SAMPLE, 0.5 * INTERVAL_S)
        ours.advance(*SAMPLE, INTERVAL_S)
        dynamics = error_dynamics(middle, ours.specific_force_mps2)
        dynamics[5, 6] += gravity_by_latitude() / middle.earth.meridian_m
        product = transition(dynamics, np.zeros_like(dynamics), INTERVAL_S)[0] @ product
    return (product - np.eye(STATES))[:DEPTH_SENSOR, :DEPTH_SENSOR]


def gravity_by_latitude():
    """What the model leaves out on purpose."""
    return (gravity_mps2(START.latitude_rad + 1e-4, 0.0) - gravity_mps2(START.latitude_rad - 1e-4, 0.0)) / 2e-4


@pytest.mark.parametrize("cause", [ATTITUDE, VELOCITY, POSITION, ACCELEROMETER_BIAS, GYROSCOPE_BIAS])
def test_errors_grow_as_two_strapdown_systems_drift_apart(monkeypatch, cause):
    monkeypatch.setattr(strapdown_module, "REFRESH_S", 0.0)
    numerical, modelled = numerical_growth(), modelled_growth()
    for errors in (ATTITUDE, VELOCITY, POSITION):
        ours, theirs = modelled[errors, cause], numerical[errors, cause]
        # 3e-14: that the radii change with the latitude is left out, too
        np.testing.assert_allclose(ours, theirs, rtol=0.05, atol=2e-5 * np.abs(theirs).max() + 3e-14)
    np.testing.assert_allclose(numerical[ACCELEROMETER_BIAS.start :], 0.0, atol=1e-10)
    np.testing.assert_array_equal(modelled[ACCELEROMETER_BIAS.start :], 0.0)


def some_dynamics(states=STATES):
    return error_dynamics(Strapdown(START), (0.5, -2.0, -9.5), states)


def test_constants_behind_the_sixteen_states_stay_what_they_are():
    config = NavigationConfig()
    for small, large in (
        (some_dynamics(), some_dynamics(25)),
        (process_noise(config), process_noise(config, 25)),
        (initial_covariance(config), initial_covariance(config, 25)),
    ):
        assert (small.shape, large.shape) == ((16, 16), (25, 25))
        np.testing.assert_array_equal(large[:16, :16], small)
        np.testing.assert_array_equal(large[16:], 0.0)
        np.testing.assert_array_equal(large[:, 16:], 0.0)


@pytest.mark.parametrize("interval_s", [0.01, 0.1, 0.5])
def test_a_step_is_that_of_the_matrix_exponential_to_the_second_order(interval_s):
    """Van Loan's integral of the noise."""
    dynamics, noise = some_dynamics(), process_noise(NavigationConfig())
    phi, covariance = transition(dynamics, noise, interval_s)
    whole = expm(np.block([[-dynamics, noise], [np.zeros((16, 16)), dynamics.T]]) * interval_s)
    exact_phi = whole[16:, 16:].T
    size = np.linalg.norm(dynamics, 2) * interval_s
    np.testing.assert_allclose(phi, exact_phi, atol=size**3 / 6.0 * np.exp(size))
    exact = exact_phi @ whole[:16, 16:]
    np.testing.assert_allclose(
        covariance, exact, atol=np.abs(noise).max() * interval_s * size**2 * np.exp(2.0 * size)
    )
    np.testing.assert_array_equal(covariance, covariance.T)
    assert np.linalg.eigvalsh(covariance).min() > -1e-20


def test_the_error_of_a_depth_sensor_stays_bounded():
    phi, covariance = transition(some_dynamics(), process_noise(NavigationConfig()), 1.0)
    variance = 0.0
    for _ in range(6000):
        variance = phi[DEPTH_SENSOR, DEPTH_SENSOR] ** 2 * variance + covariance[DEPTH_SENSOR, DEPTH_SENSOR]
    assert np.sqrt(variance) == pytest.approx(DEPTH_SENSOR_ERROR_M, rel=1e-3)


def test_uncertainty_is_that_of_many_systems_with_noisy_sensors():
    config = NavigationConfig(gyroscope_noise_radps=1e-3, accelerometer_noise_mps2=1e-2)
    start = NavigationState(0.0, 0.6, 0.5, 20.0, (1.0, 0.5, 0.0), (0.0, 0.1, 0.7))
    force, rate, interval_s, count = np.array([0.98, 0.0, -9.75]), np.array([0.0, 0.0, 0.05]), 0.1, 100
    rng = np.random.default_rng(1)
    truth = Strapdown(start)
    noisy = [copy(truth) for _ in range(200)]
    noise, covariance = process_noise(config), np.zeros((STATES, STATES))
    for _ in range(count):
        truth.advance(tuple(force), tuple(rate), interval_s)
        phi, added = transition(error_dynamics(truth, truth.specific_force_mps2), noise, interval_s)
        covariance = phi @ covariance @ phi.T + added
        forces = force + rng.normal(size=(len(noisy), 3)) * config.accelerometer_noise_mps2 / np.sqrt(interval_s)
        rates = rate + rng.normal(size=(len(noisy), 3)) * config.gyroscope_noise_radps / np.sqrt(interval_s)
        for system, one, other in zip(noisy, forces.tolist(), rates.tolist(), strict=True):
            system.advance(tuple(one), tuple(other), interval_s)
    errors = np.array([difference(truth, system) for system in noisy])[:, :9]
    spread = np.sqrt(np.mean(errors**2, axis=0) / np.diag(covariance)[:9])
    np.testing.assert_allclose(spread, 1.0, atol=0.2)  # of 200: four standard deviations


def test_a_correction_takes_the_error_away():
    ours = Strapdown(START)
    wanted = np.concatenate(
        (np.full(3, 0.01), np.full(3, 0.5), (50.0, -80.0, 3.0), np.full(3, 0.02), np.full(3, 1e-3))
    )
    np.testing.assert_allclose(difference(displaced(ours, wanted), ours), wanted, rtol=1e-9)
