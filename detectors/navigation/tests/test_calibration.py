import numpy as np
import pytest

from detectors.navigation.calibration import (
    CAUTION,
    CAUTION_S,
    DELAY_KNOWN_S,
    HORIZON_MAX_S,
    SEARCHED,
    TURNING_RADPS,
    Calibration,
)
from detectors.navigation.config import NavigationConfig
from detectors.navigation.error_filter import ErrorFilter
from detectors.navigation.error_model import DEPTH_SENSOR, VELOCITY
from detectors.navigation.installation import (
    ALL_STATES,
    DEPTH_DELAY,
    DVL_DELAY,
    INSTALLED,
    LEVER_ARM,
    Installation,
)
from detectors.navigation.integration import IntegratedFilter
from detectors.navigation.measurement import Moment
from detectors.navigation.motion import BodyMotion
from detectors.navigation.sample import DepthSample, DvlSample, FixSample, ImuSample
from detectors.navigation.strapdown import Strapdown
from detectors.navigation.tests.dives import Dive, Mounting
from detectors.navigation.uncertainty import covariance_at_start, noise_density

CONFIG = NavigationConfig()


def begun(deviations=None, config=CONFIG):
    """A calibration and its filter, the installation known this well (10,)."""
    guess = Installation.of(config)
    known = guess if deviations is None else Installation(guess.values, np.diag(np.square(deviations)))
    errors = ErrorFilter(covariance_at_start(config, known), noise_density(config))
    return Calibration(config, known, errors), errors


def deviations(dvl_delay_s, depth_delay_s=0.01):
    values = np.full(10, 0.01)
    values[DVL_DELAY - INSTALLED.start], values[DEPTH_DELAY - INSTALLED.start] = dvl_delay_s, depth_delay_s
    return values


@pytest.mark.parametrize(("dvl_delay_s", "searching"), [(0.9 * DELAY_KNOWN_S, False), (1.1 * DELAY_KNOWN_S, True)])
def test_searches_for_a_delay_that_is_not_known(dvl_delay_s, searching):
    assert begun(deviations(dvl_delay_s))[0].searching is searching


def test_caution_goes_with_the_turns_and_comes_back():
    calibration, _ = begun()
    assert calibration.caution == 1.0 + CAUTION
    for _ in range(100):
        calibration.turn((0.0, 0.0, 2.0 * TURNING_RADPS), 0.01 * CAUTION_S)
    assert calibration.caution == pytest.approx(1.0 + CAUTION / np.e)
    calibration.begin_anew()
    assert calibration.caution == 1.0 + CAUTION


def test_what_is_not_estimated_is_not_begun_anew():
    calibration, _ = begun(config=NavigationConfig(estimate_installation=False))
    calibration.turn((0.0, 0.0, TURNING_RADPS), CAUTION_S)
    before = calibration.caution
    calibration.begin_anew()
    assert calibration.caution == before


def test_corrections_are_of_constants_alone():
    calibration, errors = begun()
    error = np.arange(1.0, ALL_STATES + 1.0)
    calibration.correct(error)
    np.testing.assert_array_equal(calibration.constants[:DEPTH_SENSOR], 0.0)
    np.testing.assert_array_equal(calibration.constants[DEPTH_SENSOR:], error[DEPTH_SENSOR:])
    np.testing.assert_array_equal(calibration.installation(errors).values, error[INSTALLED])
    assert calibration.delay_s(DvlSample) == error[DVL_DELAY]
    assert calibration.delay_s(DepthSample) == error[DEPTH_DELAY]
    assert calibration.delay_s(FixSample) == 0.0


@pytest.mark.parametrize(
    ("dvl_s", "depth_s", "horizon_s"),
    [(0.4, 0.1, 0.6), (0.1, 0.7, 0.9), (-0.8, -0.9, 0.0), (9.0, 0.0, HORIZON_MAX_S)],
)
def test_the_horizon_waits_for_the_latest(dvl_s, depth_s, horizon_s):
    calibration, errors = begun(deviations(0.1, 0.1))
    calibration.constants[[DVL_DELAY, DEPTH_DELAY]] = dvl_s, depth_s
    assert calibration.horizon_s(errors) == pytest.approx(horizon_s)


def turning(seconds):
    """Of a vehicle that has turned evenly for so long."""
    motion, strapdown = BodyMotion(), Strapdown(Dive().initial)
    for _ in range(round(20 * seconds)):
        motion.follow(strapdown, (0.0, 0.0, 0.3), 0.05)
    return motion


def test_learns_of_the_lever_arm_from_what_lasts_and_of_nothing_while_searching():
    begins, lasts = turning(0.2), turning(5.0)
    searching, _ = begun()
    assert list(searching.considered(lasts, lasts)) == SEARCHED
    known, _ = begun(deviations(0.5 * DELAY_KNOWN_S))
    assert list(known.considered(lasts, lasts)) == []
    assert list(known.considered(begins, lasts)) == list(range(ALL_STATES)[LEVER_ARM])


def test_while_searching_what_is_unknown_makes_innovations_uncertain():
    observation = np.zeros((3, ALL_STATES))
    observation[:, LEVER_ARM], observation[:, VELOCITY] = 0.3 * np.eye(3), np.eye(3)
    moment = Moment(Strapdown(Dive().initial), turning(5.0), np.zeros(ALL_STATES), interval_s=0.5)
    searching, errors = begun()
    unknown = searching.unknown(observation, moment, errors)
    arm = errors.covariance[LEVER_ARM, LEVER_ARM]
    assert (np.diag(unknown) >= 0.09 * np.diag(arm)).all()
    often = searching.unknown(observation, moment._replace(interval_s=0.1), errors)
    np.testing.assert_allclose(often, 5.0 * unknown)
    known, sure = begun(deviations(0.1))
    np.testing.assert_array_equal(known.unknown(observation, moment, sure), np.zeros((3, 3)))


def test_the_guess_of_the_search_is_where_learning_begins():
    dive = Dive(mounting=Mounting(lever_arm_m=(-1.2, 0.2, 0.4), dvl_delay_s=0.6), duration_s=90.0, imu_hz=20.0)
    navigation = IntegratedFilter(CONFIG, dive.initial)
    for sample in dive.samples():
        if isinstance(sample, ImuSample):
            list(navigation.advance(sample))
            continue
        searching = not navigation.acquainted
        navigation.measure(sample)
        if searching and navigation.acquainted:
            break
    assert navigation.acquainted
    assert navigation.installation.values[DVL_DELAY - INSTALLED.start] == pytest.approx(0.6, abs=0.2)
    assert np.sqrt(navigation.covariance[DVL_DELAY, DVL_DELAY]) < DELAY_KNOWN_S
    others = np.setdiff1d(np.arange(ALL_STATES), SEARCHED)
    np.testing.assert_array_equal(navigation.covariance[np.ix_(SEARCHED, others)], 0.0)
