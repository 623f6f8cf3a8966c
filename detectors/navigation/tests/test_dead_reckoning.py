import numpy as np
import pytest

from detectors.navigation.dead_reckoning import CATCH_UP_S, GAP_S, DeadReckoning
from detectors.navigation.error_model import GYROSCOPE_BIAS, VELOCITY
from detectors.navigation.installation import ALL_STATES
from detectors.navigation.sample import ImuSample
from detectors.navigation.strapdown import Strapdown
from detectors.navigation.tests.dives import Dive

DIVE = Dive(duration_s=6.0, imu_hz=20.0)
IMU = [sample for sample in DIVE.samples() if isinstance(sample, ImuSample)]
LAG_S = 1.0


def driven(samples, lag_s=LAG_S, error_at=None):
    """Reckoning that follows so much later; at an instant, an error of the states is fed back to it."""
    reckoning, followed = DeadReckoning(DIVE.initial), []
    for sample in samples:
        reckoning.advance(sample)
        followed += reckoning.follow(sample.time_s - lag_s)
        if error_at is not None and sample.time_s == error_at[0]:
            reckoning.correct(error_at[1])
        reckoning.catch_up()
    return reckoning, followed


def alone(samples):
    """A strapdown system on its own."""
    strapdown, last_s = Strapdown(DIVE.initial), DIVE.initial.time_s
    for sample in samples:
        strapdown.advance(sample.specific_force_mps2, sample.angular_rate_radps, sample.time_s - last_s)
        last_s = sample.time_s
    return strapdown


def test_one_system_is_behind_and_one_is_here():
    reckoning, followed = driven(IMU)
    assert reckoning.behind_s == pytest.approx(6.0 - LAG_S)
    assert sum(followed) == pytest.approx(6.0 - LAG_S)
    until_then = [sample for sample in IMU if sample.time_s <= 6.0 - LAG_S]
    assert reckoning.behind.state(0.0) == alone(until_then).state(0.0)
    assert reckoning.state(6.0) == alone(IMU).state(6.0)


def test_the_present_soon_shows_what_a_corrected_bias_has_done_since():
    error = np.zeros(ALL_STATES)
    error[GYROSCOPE_BIAS] = 0.0, 0.0, 0.1
    changed_s = IMU[60].time_s
    heading = {}
    for until_s in (changed_s, changed_s + CATCH_UP_S):
        samples = [sample for sample in IMU if sample.time_s <= until_s]
        with_it, without = driven(samples, error_at=(changed_s, error))[0], driven(samples)[0]
        heading[until_s] = with_it.state(0.0).attitude_rad[2] - without.state(0.0).attitude_rad[2]
    at_once, then = heading.values()
    assert abs(at_once) <= 0.1 * LAG_S + 0.01
    # the whole time between the two systems, not only that since the correction
    assert then == pytest.approx(-0.1 * (LAG_S + CATCH_UP_S), abs=0.02)


def test_corrections_are_of_both_systems():
    error = np.zeros(ALL_STATES)
    error[VELOCITY] = 0.3, 0.2, 0.1
    samples = IMU[:-3]  # between two times of catching up
    with_it, without = driven(samples, error_at=(samples[-1].time_s, error))[0], driven(samples)[0]
    for ours, theirs in ((with_it.behind, without.behind), (with_it.state(0.0), without.state(0.0))):
        np.testing.assert_allclose(np.subtract(ours.velocity_mps, theirs.velocity_mps), error[VELOCITY], atol=1e-9)


def test_over_a_gap_the_vehicle_goes_on_as_it_went():
    gap_s = GAP_S + 0.5
    before = IMU[:40]
    after = ImuSample(before[-1].time_s + gap_s, (99.0, 99.0, 99.0), (9.0, 9.0, 9.0))
    reckoning, followed = driven([*before, after], lag_s=0.0)
    expected = alone(before)
    expected.coast(gap_s)
    assert followed[-1] == pytest.approx(gap_s)
    assert reckoning.behind.velocity_mps == alone(before).velocity_mps
    assert reckoning.behind.latitude_rad == pytest.approx(expected.latitude_rad, abs=1e-12)
    assert reckoning.motion.rate_radps == (0.0, 0.0, 0.0)


def test_a_sample_that_is_not_later_moves_nothing():
    reckoning, _ = driven(IMU[:20], lag_s=0.0)
    before = reckoning.state(1.0)
    reckoning.advance(IMU[5])
    assert list(reckoning.follow(1.0)) == []
    assert reckoning.state(1.0) == before


def test_features_are_of_the_time_since_they_were_taken():
    reckoning, _ = driven(IMU[:20], lag_s=0.0)
    taken = reckoning.take_features()
    np.testing.assert_allclose(taken[:3], reckoning.behind.body_velocity())
    np.testing.assert_allclose(taken[3:6], np.mean([one.angular_rate_radps for one in IMU[:20]], axis=0))
    assert reckoning.take_features() is None


def test_located_both_are_there():
    reckoning, _ = driven(IMU)
    reckoning.locate(0.1, -2.0)
    for state in (reckoning.behind.state(0.0), reckoning.state(0.0)):
        assert (state.latitude_rad, state.longitude_rad) == (0.1, -2.0)
