import numpy as np

from detectors.navigation.config import NavigationConfig
from detectors.navigation.error_model import STATES
from detectors.navigation.installation import (
    ALL_STATES,
    DEPTH_ARM,
    DEPTH_DELAY,
    DVL_DELAY,
    INSTALLED,
    LEVER_ARM,
    MOUNTING,
    SCALE,
    Installation,
    installation_noise,
)

GIVEN = NavigationConfig(dvl_lever_arm_m=(-1.85, 0.0, 0.1), dvl_mounting_rad=(0.0, 0.01, -0.02), dvl_delay_s=-0.5)
FIXED = NavigationConfig(
    dvl_lever_arm_m=(-1.85, 0.0, 0.1),
    dvl_mounting_rad=(0.0, 0.01, -0.02),
    dvl_delay_s=-0.5,
    estimate_installation=False,
)


def test_each_state_behind_the_paper_s_sixteen_has_one_place():
    places = np.arange(ALL_STATES)
    taken = [*places[LEVER_ARM], *places[MOUNTING], SCALE, DVL_DELAY, DEPTH_DELAY, DEPTH_ARM]
    assert taken == list(range(STATES, ALL_STATES)) == places[INSTALLED].tolist()


def test_begins_with_what_the_configuration_says():
    states = np.zeros(ALL_STATES)
    states[INSTALLED] = Installation.of(GIVEN).values
    assert tuple(states[LEVER_ARM]) == GIVEN.dvl_lever_arm_m
    assert tuple(states[MOUNTING]) == GIVEN.dvl_mounting_rad
    assert states[DVL_DELAY] == GIVEN.dvl_delay_s
    assert (states[SCALE], states[DEPTH_DELAY], states[DEPTH_ARM]) == (0.0, 0.0, 0.0)


def test_a_first_guess_is_doubted_and_a_last_word_is_not():
    guess = Installation.of(GIVEN).covariance
    assert (np.diag(guess) > 0.0).all()
    np.testing.assert_array_equal(guess, np.diag(np.diag(guess)))
    assert (installation_noise(GIVEN) > 0.0).all()
    assert not Installation.of(FIXED).covariance.any()
    assert not installation_noise(FIXED).any()
    np.testing.assert_array_equal(Installation.of(FIXED).values, Installation.of(GIVEN).values)
