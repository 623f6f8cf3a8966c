import numpy as np
import pytest

from detectors.navigation.calibration import Calibration
from detectors.navigation.config import NavigationConfig
from detectors.navigation.dead_reckoning import DeadReckoning
from detectors.navigation.error_filter import ErrorFilter
from detectors.navigation.installation import ALL_STATES, DEPTH_DELAY, DVL_DELAY, Installation
from detectors.navigation.measurement import Moment
from detectors.navigation.motion import BodyMotion
from detectors.navigation.observation import FIRST_S, STRAIGHT_RADPS, ObservationModel
from detectors.navigation.sample import AttitudeSample, DepthSample, DvlSample, FixSample
from detectors.navigation.strapdown import Strapdown
from detectors.navigation.tests.dives import Dive
from detectors.navigation.uncertainty import covariance_at_start, noise_density

CONFIG = NavigationConfig()
INITIAL = Dive().initial


@pytest.fixture
def parts():
    installation = Installation.of(CONFIG)
    errors = ErrorFilter(covariance_at_start(CONFIG, installation), noise_density(CONFIG))
    return DeadReckoning(INITIAL), Calibration(CONFIG, installation, errors), errors


def test_the_interval_is_that_of_the_kind(parts):
    model = ObservationModel(CONFIG)
    samples = [
        DvlSample(5.0, (0.0,) * 3),
        DepthSample(5.3, 20.0),
        DvlSample(5.5, (0.0,) * 3),
        DepthSample(6.0, 20.0),
    ]
    assert [model.moment(one, *parts).interval_s for one in samples] == pytest.approx([FIRST_S, FIRST_S, 0.5, 0.7])


def test_the_moment_is_as_far_off_as_the_delays_say(parts):
    model, (_, calibration, errors) = ObservationModel(CONFIG), parts
    calibration.constants[[DVL_DELAY, DEPTH_DELAY]] = 0.4, 0.1
    ahead_s = [model.moment(one, *parts).ahead_s for one in (DvlSample(0.5, (0.0,) * 3), DepthSample(0.5, 20.0))]
    assert ahead_s == pytest.approx([0.1, 0.4])
    moment = model.moment(DvlSample(1.0, (0.0,) * 3), *parts)
    assert moment.dvl_delay_error_s == errors.deviation(DVL_DELAY)
    assert moment.depth_delay_error_s == errors.deviation(DEPTH_DELAY)
    assert moment.caution == calibration.caution


def test_every_kind_is_compared_with_what_is_expected_of_it():
    """Of exact measurements nothing is left over."""
    strapdown, model = Strapdown(INITIAL), ObservationModel(CONFIG)
    moment = Moment(strapdown, BodyMotion(), np.zeros(ALL_STATES))
    exact = [
        DvlSample(0.0, strapdown.body_velocity()),
        DepthSample(0.0, INITIAL.depth_m),
        FixSample(0.0, INITIAL.latitude_rad, INITIAL.longitude_rad),
        AttitudeSample(0.0, INITIAL.attitude_rad),
    ]
    for sample, size in zip(exact, (3, 1, 2, 1), strict=True):
        comparison = model.compare(sample, moment)
        np.testing.assert_allclose(comparison.innovation, np.zeros(size), atol=1e-9)
        assert comparison.noise.shape == (size, size)


def noise_after(rate_radps, interrupted=False):
    """The DVL's, after samples that scatter more than it is configured to."""
    motion, strapdown, model = BodyMotion(), Strapdown(INITIAL), ObservationModel(CONFIG)
    motion.rate_radps = (0.0, 0.0, rate_radps)
    rng = np.random.default_rng(1)
    moment = Moment(strapdown, motion, np.zeros(ALL_STATES))
    for number in range(100):
        said = strapdown.body_velocity() + 2.0 * CONFIG.dvl_noise_mps * rng.normal(size=3)
        model.compare(DvlSample(float(number), tuple(said.tolist())), moment)
        if interrupted:
            model.interrupt()
    straight = Moment(strapdown, BodyMotion(), np.zeros(ALL_STATES))
    return np.sqrt(np.diag(model.compare(DvlSample(100.0, (0.0,) * 3), straight).noise))


def test_noise_is_learnt_on_straight_courses_from_samples_in_a_row():
    assert (noise_after(0.5 * STRAIGHT_RADPS) > 1.5 * CONFIG.dvl_noise_mps).all()
    np.testing.assert_allclose(noise_after(2.0 * STRAIGHT_RADPS), CONFIG.dvl_noise_mps)
    np.testing.assert_allclose(noise_after(0.0, interrupted=True), CONFIG.dvl_noise_mps)
