import numpy as np
import pytest

from detectors.navigation.config import NavigationConfig
from detectors.navigation.error_filter import STEP_S, ErrorFilter
from detectors.navigation.error_model import VELOCITY, error_dynamics, transition
from detectors.navigation.installation import ALL_STATES, DVL_DELAY, LEVER_ARM, Installation
from detectors.navigation.measurement import Comparison
from detectors.navigation.strapdown import Strapdown
from detectors.navigation.tests.dives import Dive
from detectors.navigation.uncertainty import covariance_at_start, noise_density

CONFIG = NavigationConfig()
FORCE = (0.3, -0.2, -9.8)
CONSIDERED = [*range(ALL_STATES)[LEVER_ARM], DVL_DELAY]


@pytest.fixture
def errors():
    return ErrorFilter(covariance_at_start(CONFIG, Installation.of(CONFIG)), noise_density(CONFIG))


def comparison(size=3):
    rng = np.random.default_rng(size)
    observation = rng.normal(size=(size, ALL_STATES))
    return Comparison(rng.normal(size=size), observation, np.diag(rng.uniform(0.1, 0.5, size)))


def test_time_is_taken_in_at_once_with_the_mean_force(errors):
    before, strapdown = errors.covariance.copy(), Strapdown(Dive().initial)
    errors.elapse(0.06, (0.8, -0.2, -9.8))
    assert not errors.step_due
    errors.elapse(0.06, (-0.2, -0.2, -9.8))
    assert errors.step_due
    errors.propagate(strapdown)
    phi, added = transition(error_dynamics(strapdown, FORCE, ALL_STATES), noise_density(CONFIG), 0.12)
    np.testing.assert_allclose(errors.covariance, phi @ before @ phi.T + added, rtol=1e-9, atol=1e-15)
    assert not errors.step_due


def test_what_has_passed_is_of_all_steps_since_it_was_asked_for(errors):
    before, strapdown = errors.covariance.copy(), Strapdown(Dive().initial)
    for _ in range(5):
        errors.elapse(STEP_S, FORCE)
        errors.propagate(strapdown)
    errors.loosen(np.full(ALL_STATES, 0.01))
    phi, process = errors.passed()
    np.testing.assert_allclose(errors.covariance, phi @ before @ phi.T + process, rtol=1e-9, atol=1e-14)
    again, nothing = errors.passed()
    np.testing.assert_array_equal(again, np.eye(ALL_STATES))
    np.testing.assert_array_equal(nothing, 0.0)


@pytest.mark.parametrize("size", [1, 2, 3])
def test_an_update_is_the_textbooks_in_the_information_form(errors, size):
    before, one = errors.covariance.copy(), comparison(size)
    gain, error = errors.update(one)
    information = one.observation.T @ np.linalg.inv(one.noise) @ one.observation
    after = np.linalg.inv(np.linalg.inv(before) + information)
    np.testing.assert_allclose(errors.covariance, after, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(gain, after @ one.observation.T @ np.linalg.inv(one.noise), rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(error, gain @ one.innovation, rtol=1e-12)


def test_states_that_are_considered_stay_and_cost_certainty(errors):
    before, one = errors.covariance.copy(), comparison()
    sure = ErrorFilter(before.copy(), noise_density(CONFIG))
    sure.update(one)
    gain, error = errors.consider(one, CONSIDERED)
    np.testing.assert_array_equal(error[CONSIDERED], 0.0)
    np.testing.assert_array_equal(gain[CONSIDERED], 0.0)
    block = np.ix_(CONSIDERED, CONSIDERED)
    np.testing.assert_allclose(errors.covariance[block], before[block], rtol=1e-12)
    assert (np.linalg.eigvalsh(errors.covariance - sure.covariance) > -1e-9).all()
    assert np.trace(errors.covariance) < np.trace(before)


def test_states_found_otherwise_go_with_no_others(errors):
    errors.update(comparison())
    before = errors.covariance.copy()
    errors.renew(VELOCITY, 0.25 * np.eye(3))
    others = np.delete(np.arange(ALL_STATES), VELOCITY)
    np.testing.assert_array_equal(errors.covariance[VELOCITY, VELOCITY], 0.25 * np.eye(3))
    assert before[VELOCITY][:, others].any()
    np.testing.assert_array_equal(errors.covariance[VELOCITY][:, others], 0.0)
    np.testing.assert_array_equal(errors.covariance[others][:, VELOCITY], 0.0)
    np.testing.assert_array_equal(errors.covariance[np.ix_(others, others)], before[np.ix_(others, others)])
    assert errors.deviation(VELOCITY.start) == 0.5


@pytest.mark.parametrize("way", [ErrorFilter.update, lambda errors, one: errors.consider(one, CONSIDERED)])
def test_shapes_that_do_not_fit_are_refused(errors, way):
    values, observation, noise = comparison()
    for wrong in (
        Comparison(values[:2], observation, noise),
        Comparison(values, observation[:, :-1], noise),
        Comparison(values, observation, np.diag(noise)),
    ):
        with pytest.raises(ValueError, match="want \\(M,\\)"):
            way(errors, wrong)
