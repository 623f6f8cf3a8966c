import pickle
from collections import Counter
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from detectors.navigation.config import NavigationConfig
from detectors.navigation.dead_reckoning import GAP_S
from detectors.navigation.error_model import ACCELEROMETER_BIAS, POSITION, VELOCITY
from detectors.navigation.gate import FIX_OUTLIERS_MAX, OUTLIERS_MAX
from detectors.navigation.installation import ALL_STATES, INSTALLED, Installation
from detectors.navigation.integration import IntegratedFilter
from detectors.navigation.sample import AttitudeSample, DepthSample, DvlSample, FixSample, ImuSample
from detectors.navigation.tests.dives import Dive, Mounting, changed_dvl, legs
from detectors.navigation.waiting import WAITING_MAX

CONFIG = NavigationConfig()
FIXED = NavigationConfig(estimate_installation=False)
LATE = Mounting(
    lever_arm_m=(-1.2, 0.2, 0.4),
    rotation_rad=(0.01, -0.015, 0.02),
    scale=0.01,
    dvl_delay_s=0.6,
    depth_delay_s=0.3,
    depth_arm_m=1.0,
)
EARLY = replace(LATE, dvl_delay_s=-0.6, depth_delay_s=-0.3)


def driven(navigation, samples):
    """All innovations."""
    found = []
    for sample in samples:
        if isinstance(sample, ImuSample):
            found += navigation.advance(sample)
        else:
            navigation.measure(sample)
    return found


@cache
def dived(dive, config=CONFIG):
    navigation = IntegratedFilter(config, dive.initial)
    innovations = driven(navigation, dive.samples())
    return navigation, innovations


def constants(mounting):
    depth = (mounting.depth_delay_s, mounting.depth_arm_m)
    return np.array([*mounting.lever_arm_m, *mounting.rotation_rad, mounting.scale, mounting.dvl_delay_s, *depth])


@pytest.mark.parametrize("mounting", [LATE, EARLY], ids=["late", "early"])
def test_learns_how_the_sensors_are_mounted(mounting):
    navigation, _ = dived(Dive(mounting=mounting, imu_hz=20.0))
    learnt = navigation.installation
    errors = np.abs(learnt.values - constants(mounting))
    deviations = np.sqrt(np.diag(learnt.covariance))
    assert (errors < 4.0 * deviations).all()
    # lever arm, mounting, scale, delay of the DVL; those of the depth sensor are barely to be seen
    assert (errors < [0.15, 0.15, 0.15, 0.015, 0.005, 0.015, 0.01, 0.1, 1.0, 1.5]).all()
    assert (deviations < np.sqrt(np.diag(Installation.of(CONFIG).covariance))).all()


def test_learns_the_biases():
    dive = Dive(imu_hz=20.0)
    strapdown = dived(dive)[0].strapdown
    np.testing.assert_allclose(strapdown.accelerometer_bias_mps2, dive.accelerometer_bias_mps2, atol=5e-3)
    np.testing.assert_allclose(strapdown.gyroscope_bias_radps, dive.gyroscope_bias_radps, atol=3e-4)


def test_an_installation_that_was_learnt_is_where_the_next_filter_begins():
    learnt = dived(Dive(mounting=LATE, imu_hz=20.0))[0].installation
    again = IntegratedFilter(CONFIG, Dive().initial, learnt).installation
    np.testing.assert_array_equal(again.values, learnt.values)
    np.testing.assert_array_equal(again.covariance, learnt.covariance)


@pytest.mark.parametrize("mounting", [Mounting(), LATE, EARLY], ids=["plain", "late", "early"])
def test_is_where_the_vehicle_is_now_although_it_runs_behind(mounting):
    """Known from the truth: a present that followed no correction of the past would be 20 m and 0.4 m/s off."""
    dive = Dive(mounting=mounting, imu_hz=20.0)
    navigation, _ = dived(dive)
    state, truth = navigation.state(120.0), dive.truth(120.0)
    assert np.linalg.norm(np.subtract(state.velocity_mps, truth.velocity_mps)) < 0.08
    assert np.linalg.norm(metres_apart(state, truth)[:2]) < 5.0
    assert state.attitude_rad == pytest.approx(truth.attitude_rad, abs=0.05)


def test_what_is_not_to_be_estimated_stays():
    navigation, _ = dived(Dive(mounting=LATE, duration_s=40.0, imu_hz=20.0), FIXED)
    np.testing.assert_array_equal(navigation.installation.values, 0.0)
    np.testing.assert_allclose(navigation.installation.covariance, 0.0, atol=1e-12)


def metres_apart(state, truth):
    north_m = 6.37e6 * (state.latitude_rad - truth.latitude_rad)
    east_m = 6.37e6 * np.cos(truth.latitude_rad) * (state.longitude_rad - truth.longitude_rad)
    return np.array([north_m, east_m, state.depth_m - truth.depth_m])


def test_innovations_are_as_large_as_they_are_expected_or_smaller():
    """Smaller, for the noise in turns allows for more than there is in a simulation."""
    _, innovations = dived(Dive(motion=legs, dvl_noise_mps=0.02, imu_hz=20.0), NavigationConfig(dvl_noise_mps=0.02))
    squared = [one.squared / len(one.values) for one in innovations if one.time_s > 30.0]
    assert 0.2 < np.mean(squared) < 1.1
    assert np.mean(np.array(squared) > 9.0) < 0.005


def test_its_own_uncertainty_holds_for_the_position():
    errors, claimed = [], []
    for seed in range(3):
        dive = Dive(seed=seed, duration_s=60.0, imu_hz=20.0, fix_hz=0.2)
        start = replace(dive.initial, latitude_rad=dive.initial.latitude_rad + 3.0 / 6.37e6)
        navigation = IntegratedFilter(NavigationConfig(fix_noise_m=1.0), start)
        driven(navigation, dive.samples())
        errors.append(metres_apart(navigation.state(60.0), dive.truth(60.0))[:2])
        claimed.append(navigation.position_error_m)
    assert np.sqrt(np.mean(np.sum(np.square(errors), axis=1))) < 1.5 * np.mean(claimed)
    assert np.mean(claimed) < 1.0


def test_fixes_bound_the_position_error():
    start = {"duration_s": 60.0, "imu_hz": 20.0}
    with_fixes, without = (dived(Dive(fix_hz=fix_hz, **start))[0].position_error_m for fix_hz in (0.5, 0.0))
    assert with_fixes < 0.5 * without


def test_innovations_come_in_the_order_of_their_instants_and_all_come():
    dive = Dive(mounting=LATE, duration_s=40.0, imu_hz=20.0)
    _, innovations = dived(dive)
    for kind in (DvlSample, DepthSample):
        stamps = [one.time_s for one in innovations if isinstance(one.measurement, kind)]
        given = [sample.time_s for sample in dive.samples() if isinstance(sample, kind)]
        assert stamps == given[: len(stamps)]
        assert len(stamps) > len(given) - 6


def test_a_measurement_waits_until_the_imu_has_come_to_its_instant():
    dive = Dive(duration_s=4.0)
    navigation = IntegratedFilter(FIXED, dive.initial)
    navigation.measure(DvlSample(2.0, (1.0, 0.0, 0.0)))
    said = [(sample.time_s, one.time_s) for sample in imu_of(dive) for one in navigation.advance(sample)]
    assert [stamp for _, stamp in said] == [2.0]
    assert 2.0 <= said[0][0] <= 2.05


def imu_of(dive):
    return [sample for sample in dive.samples() if isinstance(sample, ImuSample)]


def test_too_many_that_wait_are_dropped_and_counted():
    navigation = IntegratedFilter(CONFIG, Dive().initial)
    for number in range(WAITING_MAX + 3):
        navigation.measure(DepthSample(float(number), 20.0))
        navigation.measure(DvlSample(float(number), (1.0, 0.0, 0.0)))
    assert navigation.refused == Counter({"measurement while the IMU was silent": 6})


def outlying(samples, since_s, until_s):
    return changed_dvl(
        samples, lambda age_s, velocity: velocity + (2.0 if age_s < until_s - since_s else 0.0), since_s=since_s
    )


def test_a_single_outlier_does_not_move_the_filter():
    dive = Dive(duration_s=60.0, imu_hz=20.0)
    clean, _ = dived(dive)
    spoilt = IntegratedFilter(CONFIG, dive.initial)
    innovations = driven(spoilt, outlying(dive.samples(), 50.0, 50.1))
    hit = [one for one in innovations if isinstance(one.measurement, DvlSample) and one.gain is None]
    assert [one.time_s for one in hit] == [50.0]
    apart = np.subtract(spoilt.state(60.0).velocity_mps, clean.state(60.0).velocity_mps)
    assert np.linalg.norm(apart) < 0.02


def test_after_five_in_a_row_it_is_not_the_sample_that_is_off():
    dive = Dive(duration_s=60.0, imu_hz=20.0)
    innovations = driven(IntegratedFilter(CONFIG, dive.initial), outlying(dive.samples(), 50.0, 100.0))
    used = [
        one.gain is not None for one in innovations if isinstance(one.measurement, DvlSample) and one.time_s >= 50
    ]
    assert used[: OUTLIERS_MAX + 1] == [False] * OUTLIERS_MAX + [True]


def test_what_is_excluded_is_compared_but_not_used():
    dive = Dive(duration_s=40.0, imu_hz=20.0)
    navigation = IntegratedFilter(CONFIG, dive.initial)
    samples = dive.samples()
    half = next(number for number, sample in enumerate(samples) if sample.time_s > 20.0)
    driven(navigation, samples[:half])
    navigation.excluded.add(DvlSample)
    before = navigation.covariance.copy()
    innovations = driven(navigation, samples[half:])
    assert {one.gain is None for one in innovations if isinstance(one.measurement, DvlSample)} == {True}
    assert {one.gain is None for one in innovations if isinstance(one.measurement, DepthSample)} == {False}
    grown = np.diag(navigation.covariance) - np.diag(before)
    assert (grown[VELOCITY][:2] > 0.0).all()
    assert (grown[POSITION][:2] > 0.0).all()


@pytest.mark.parametrize("gap_s", [2.0, 4.0])
def test_over_a_gap_of_the_imu_it_doubts_and_finds_itself_again(gap_s):
    dive = Dive(motion=legs, duration_s=80.0, imu_hz=20.0)
    samples = [
        sample
        for sample in dive.samples()
        if not (isinstance(sample, ImuSample) and 50.0 < sample.time_s < 50.0 + gap_s)
    ]
    navigation = IntegratedFilter(CONFIG, dive.initial)
    until = next(number for number, sample in enumerate(samples) if sample.time_s > 50.0)
    driven(navigation, samples[:until])
    before = navigation.position_error_m
    after = next(
        number
        for number, sample in enumerate(samples)
        if isinstance(sample, ImuSample) and sample.time_s > 52.6 + gap_s
    )
    driven(navigation, samples[until:after])
    assert navigation.position_error_m > before + 0.1
    driven(navigation, samples[after:])
    apart = np.subtract(navigation.state(80.0).velocity_mps, dive.truth(80.0).velocity_mps)
    assert np.linalg.norm(apart) < 0.3
    assert navigation.strapdown.state(0.0).depth_m == pytest.approx(dive.truth(79.5).depth_m, abs=0.5)


def test_a_sample_that_is_lost_on_a_slow_link_is_no_gap():
    """At 5 Hz, the slowest; the other way round the uncertainty would jump each time."""
    dive = Dive(duration_s=40.0, imu_hz=5.0)
    whole, lossy = dived(dive)[0], IntegratedFilter(CONFIG, dive.initial)
    driven(lossy, [sample for number, sample in enumerate(dive.samples()) if number % 17 or number < 20])
    assert GAP_S > 2.0 / 5.0
    assert lossy.position_error_m == pytest.approx(whole.position_error_m, rel=0.2)


def test_far_away_a_fix_is_believed_at_once_and_later_after_some():
    dive = Dive(duration_s=40.0, imu_hz=20.0)
    navigation = IntegratedFilter(CONFIG, dive.initial)
    far = FixSample(3.0, 0.1, -2.0)
    samples = [*dive.samples(), far, *(FixSample(20.0 + number, 0.2, 2.0) for number in range(10))]
    places = []
    for sample in sorted(samples, key=lambda one: one.time_s):
        driven(navigation, [sample])
        places.append((sample.time_s, navigation.state(0.0).latitude_rad))
    assert next(place for time_s, place in places if time_s >= 8.0) == pytest.approx(0.1, abs=1e-4)
    moved_s = next(time_s for time_s, place in places if time_s > 20.0 and place > 0.15)
    assert 20.0 + FIX_OUTLIERS_MAX <= moved_s < 20.0 + FIX_OUTLIERS_MAX + 4.0


def test_many_headings_say_no_more_than_some():
    dive = Dive(duration_s=30.0, imu_hz=20.0, attitude_hz=10.0)
    _, innovations = dived(dive)
    stamps = [one.time_s for one in innovations if isinstance(one.measurement, AttitudeSample)]
    assert 20 <= len(stamps) <= 30
    assert min(np.diff(stamps)) >= 0.99


def test_corrections_from_outside_are_taken_in():
    navigation, _ = dived(Dive(duration_s=30.0, imu_hz=20.0))
    navigation = pickle.loads(pickle.dumps(navigation))  # noqa: S301
    error, own = np.zeros(ALL_STATES), 0.01 * np.eye(ALL_STATES)
    error[VELOCITY], error[ACCELEROMETER_BIAS] = (1.0, 2.0, 3.0), (0.1, 0.2, 0.3)
    was, bias = navigation.state(30.0).velocity_mps, navigation.strapdown.accelerometer_bias_mps2
    covariance = navigation.covariance.copy()
    navigation.correct(error, own)
    np.testing.assert_allclose(np.subtract(navigation.state(30.0).velocity_mps, was), (1.0, 2.0, 3.0))
    np.testing.assert_allclose(np.subtract(navigation.strapdown.accelerometer_bias_mps2, bias), (0.1, 0.2, 0.3))
    np.testing.assert_allclose(navigation.covariance, covariance + own)
    navigation.replace(-error, own)
    np.testing.assert_allclose(navigation.state(30.0).velocity_mps, was)
    np.testing.assert_array_equal(navigation.covariance, own)


def test_begun_anew_it_keeps_the_position():
    navigation, _ = dived(Dive(duration_s=30.0, imu_hz=20.0))
    navigation = pickle.loads(pickle.dumps(navigation))  # noqa: S301
    before, error_m = np.diag(navigation.covariance).copy(), navigation.position_error_m
    navigation.begin_anew()
    grown = np.diag(navigation.covariance) - before
    assert navigation.position_error_m == error_m
    assert (grown[INSTALLED] > 0.0).all()
    assert (grown[VELOCITY] > 0.0).all()


def test_pickled_it_goes_on_bit_for_bit():
    dive = Dive(duration_s=30.0, imu_hz=20.0, mounting=LATE, fix_hz=0.2, attitude_hz=1.0)
    whole, _ = dived(dive)
    parts, samples = IntegratedFilter(CONFIG, dive.initial), dive.samples()
    for begin in range(0, len(samples), 97):
        driven(parts, samples[begin : begin + 97])
        parts = pickle.loads(pickle.dumps(parts))  # noqa: S301
    assert parts.state(30.0) == whole.state(30.0)
    np.testing.assert_array_equal(parts.covariance, whole.covariance)
    np.testing.assert_array_equal(parts.installation.values, whole.installation.values)
