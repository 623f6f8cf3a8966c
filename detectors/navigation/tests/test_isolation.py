import pickle
from functools import cache

import numpy as np
import pytest

from detectors.navigation.config import NavigationConfig
from detectors.navigation.error_model import VELOCITY
from detectors.navigation.installation import ALL_STATES
from detectors.navigation.integration import IntegratedFilter
from detectors.navigation.isolation import COMES_AND_GOES, LEAST_SAMPLES, LINE_SAMPLES, Isolation, Probation
from detectors.navigation.sample import DvlSample, FaultKind, ImuSample, Sensor
from detectors.navigation.tests.dives import Dive, changed_dvl, legs
from detectors.navigation.tests.innovations import NOISE_MPS, dvl_innovation, fix_innovation

CONFIG = NavigationConfig(estimate_installation=False)
DIVE = Dive(motion=legs, duration_s=70.0, imu_hz=20.0, seed=4)
ONSET_S, HEALTHY_S, LIMIT = 45.0, 20.0, 15.0
KNOWING = 1e-6 * np.eye(ALL_STATES)  # a filter that knows nearly all
OFFSET = np.array([0.6, 0.0, -0.3])


@cache
def until_onset():
    """A filter, pickled; and the samples that are to come."""
    navigation, samples = IntegratedFilter(CONFIG, DIVE.initial), DIVE.samples()
    count = next(number for number, sample in enumerate(samples) if sample.time_s > ONSET_S)
    list(innovations(navigation, samples[:count]))
    return pickle.dumps(navigation), samples[count:]


def innovations(navigation, samples):
    for sample in samples:
        if isinstance(sample, ImuSample):
            yield from navigation.advance(sample)
        else:
            navigation.measure(sample)


def put_on_probation(samples):
    """The filter that goes on without the DVL, and its probation."""
    without = pickle.loads(until_onset()[0])  # noqa: S301
    without.excluded.add(DvlSample)
    probation = Probation(Sensor.DVL, without.covariance)
    for one in innovations(without, samples):
        probation.update(one, isolated=isinstance(one.measurement, DvlSample))
    return without, probation


def test_probation_knows_what_the_filter_would_if_it_used_the_sensor():
    """Beside one that does use it."""
    without, probation = put_on_probation(until_onset()[1])
    with_it = pickle.loads(until_onset()[0])  # noqa: S301
    list(innovations(with_it, until_onset()[1]))
    ours, theirs = with_it.strapdown, without.strapdown
    apart = np.subtract(ours.velocity_mps, theirs.velocity_mps)
    np.testing.assert_allclose(probation.error[VELOCITY], apart, atol=0.15 * np.linalg.norm(apart) + 0.01)
    claimed, usual, alone = (
        np.sqrt(np.diag(one)[:15].reshape(5, 3).sum(axis=1))
        for one in (probation.covariance, with_it.covariance, without.covariance)
    )
    np.testing.assert_allclose(claimed, usual, rtol=0.25)
    assert alone[1] > 1.5 * claimed[1]  # velocity
    assert probation.agreed >= 45


def test_on_probation_a_healthy_sensor_is_not_doubted_and_a_drifting_one_is():
    _, healthy = put_on_probation(until_onset()[1])
    assert healthy.doubt() < 10.0
    drift = np.array([0.05, 0.0, 0.0])
    drifting = changed_dvl(until_onset()[1], lambda age_s, velocity: velocity + drift * age_s, since_s=ONSET_S)
    _, lying = put_on_probation(drifting)
    assert lying.doubt() > 30.0


def test_used_again_the_filter_is_as_good_as_if_it_had_been_used_all_along():
    without, probation = put_on_probation(until_onset()[1])
    without.replace(probation.error, probation.covariance)
    apart = np.subtract(without.state(70.0).velocity_mps, DIVE.truth(70.0).velocity_mps)
    assert np.linalg.norm(apart) < 0.2


def isolated(kind=FaultKind.STEP, rate=0.0):
    return Isolation(Sensor.DVL, kind, (0.6, 0.0, -0.3), rate)


def noise(number, seed=0):
    return NOISE_MPS * np.random.default_rng([seed, number]).normal(size=3)


def follow(isolation, error, first, last, *, sound=True):
    """From one second to another, two samples a second, with this error (t); the first time that it was healed."""
    for number in range(2 * first, 2 * last):
        time_s = 0.5 * number
        one = dvl_innovation(time_s, error(time_s) + noise(number))
        isolation.update(one, KNOWING, own=True, sound=sound, limit=LIMIT)
        if isolation.healed(time_s, HEALTHY_S):
            return time_s
    return None


def test_it_is_well_when_it_has_agreed_for_so_long():
    isolation = isolated()
    assert follow(isolation, lambda time_s: OFFSET, 0, 30) is None
    assert follow(isolation, lambda time_s: 0.0 * OFFSET, 30, 90) == pytest.approx(30.0 + HEALTHY_S, abs=1.0)


def test_it_has_to_agree_in_some_samples():
    isolation = isolated()
    for number in range(LEAST_SAMPLES + 1):
        time_s = 100.0 * number
        assert not isolation.healed(time_s, HEALTHY_S)
        isolation.update(dvl_innovation(time_s, noise(number)), KNOWING, own=True, sound=True, limit=LIMIT)
    assert isolation.healed(time_s, HEALTHY_S)


def test_what_shows_in_its_samples_speaks_against_it():
    assert follow(isolated(), lambda time_s: 0.0 * OFFSET, 0, 60, sound=False) is None


def test_while_it_contradicts_it_stays_away():
    isolation = isolated()
    assert follow(isolation, lambda time_s: OFFSET, 0, 100) is None
    assert isolation.probation is None


def test_a_small_drift_that_goes_on_is_not_let_in():
    """Each sample is within what the filter expects, for a while."""
    isolation = isolated(FaultKind.DRIFT, 0.004)
    assert follow(isolation, lambda time_s: 0.004 * (time_s % 15.0) * OFFSET / 0.67, 0, 120) is None


def test_others_innovations_do_not_put_it_on_probation():
    isolation = isolated()
    for number in range(100):
        isolation.update(fix_innovation(float(number)), KNOWING, own=False, sound=True, limit=LIMIT)
    assert isolation.probation is None
    assert not isolation.healed(100.0, HEALTHY_S)


def test_a_step_is_followed():
    isolation = isolated()
    follow(isolation, lambda time_s: 2.0 * OFFSET, 0, 20)
    assert isolation.kind is FaultKind.STEP
    np.testing.assert_allclose(isolation.size, 2.0 * OFFSET, atol=4.0 * NOISE_MPS)


@pytest.mark.parametrize("seemed", [FaultKind.STEP, FaultKind.DRIFT, FaultKind.SCALE])
def test_an_error_that_grows_is_a_drift(seemed):
    isolation = isolated(seemed, 0.01)
    follow(isolation, lambda time_s: 0.05 * (time_s + 2.0) * OFFSET, 0, 20)
    assert isolation.kind is FaultKind.DRIFT
    assert isolation.rate == pytest.approx(0.05 * np.linalg.norm(OFFSET), rel=0.1)
    np.testing.assert_allclose(isolation.size, 0.05 * 21.5 * OFFSET, atol=4.0 * NOISE_MPS)


@pytest.mark.parametrize("last_s", [15.0, 40.0])
def test_a_drift_that_ends_is_a_step_from_then_on(last_s):
    isolation, kinds = isolated(FaultKind.DRIFT, 0.03), []
    for second in range(2, 120):
        follow(isolation, lambda time_s: 0.05 * min(time_s, last_s) * OFFSET, second, second + 1)
        kinds.append((second, isolation.kind))
    assert {kind for second, kind in kinds if second < last_s} == {FaultKind.DRIFT}
    assert {kind for second, kind in kinds if second > last_s + LINE_SAMPLES / 2} == {FaultKind.STEP}
    assert isolation.rate == 0.0
    np.testing.assert_allclose(isolation.size, 0.05 * last_s * OFFSET, atol=4.0 * NOISE_MPS)


def test_a_drift_that_pauses_goes_on():
    isolation = isolated(FaultKind.DRIFT, 0.03)
    follow(isolation, lambda time_s: 0.05 * min(time_s, 40.0) * OFFSET, 2, 80)
    assert isolation.kind is FaultKind.STEP
    follow(isolation, lambda time_s: 0.05 * (time_s - 40.0) * OFFSET, 80, 115)
    assert isolation.kind is FaultKind.DRIFT
    assert isolation.rate == pytest.approx(0.05 * np.linalg.norm(OFFSET), rel=0.1)


@pytest.mark.parametrize("kind", [FaultKind.NOISE, FaultKind.STUCK, FaultKind.INTERMITTENT])
def test_what_shows_in_the_samples_keeps_its_name(kind):
    isolation = isolated(kind)
    follow(isolation, lambda time_s: 0.1 * (time_s + 2.0) * OFFSET, 0, 20)
    assert isolation.kind is kind


def test_what_comes_back_again_and_again_is_intermittent():
    isolation, kinds = isolated(), []
    for number in range(COMES_AND_GOES + 2):
        follow(isolation, lambda time_s: OFFSET, 20 * number, 20 * number + 10)
        kinds.append(isolation.kind)
        follow(isolation, lambda time_s: 0.0 * OFFSET, 20 * number + 10, 20 * number + 20)
    assert kinds[0] is FaultKind.STEP
    assert kinds[-1] is FaultKind.INTERMITTENT


def test_pickled_it_goes_on_bit_for_bit():
    whole, parts = isolated(), isolated()
    for number in range(80):
        one = dvl_innovation(0.5 * number, noise(number) + OFFSET * (number < 20))
        for isolation in (whole, parts):
            isolation.update(one, KNOWING, own=True, sound=True, limit=LIMIT)
        parts = pickle.loads(pickle.dumps(parts))  # noqa: S301
        assert parts.healed(one.time_s, HEALTHY_S) == whole.healed(one.time_s, HEALTHY_S)
    assert (parts.kind, parts.size, parts.rate) == (whole.kind, whole.size, whole.rate)
    np.testing.assert_array_equal(parts.probation.covariance, whole.probation.covariance)
    assert parts.probation.doubt() == whole.probation.doubt()
