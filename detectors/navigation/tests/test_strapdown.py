import pickle
from dataclasses import replace
from math import inf, nan, pi, radians

import numpy as np
import pytest

from detectors.navigation import strapdown as strapdown_module
from detectors.navigation.earth import curvature_radii_m, gravity_mps2
from detectors.navigation.rotation import between, from_euler, matrix, rotate
from detectors.navigation.sample import NavigationState
from detectors.navigation.strapdown import Strapdown, StrapdownError
from detectors.navigation.tests.ecef import Motion, ecef_m, every, ned_axes

START = NavigationState(0.0, 0.6, 0.5, 20.0, (1.0, -0.5, 0.2), (0.1, -0.2, 2.0))
DURATIONS_S = {0.0: 120.0, 45.0: 600.0, -60.0: 120.0, 85.0: 120.0}  # by latitude in degrees


def eased(time_s):
    """0 until 60 s, 1 from 90 s on, smooth to the second derivative; and its rate."""
    share = np.clip((time_s - 60.0) / 30.0, 0.0, 1.0)
    return share**3 * (10.0 - 15.0 * share + 6.0 * share**2), share**2 * (1.0 - share) ** 2


def rocking_circles(time_s):
    """Stands still for a minute; then circles in half a minute, rolls by 9 degrees in 7 s and dives in waves."""
    share, rate = eased(time_s)
    roll, pitch, yaw = 0.15 * np.sin(0.9 * time_s), 0.3 * np.sin(0.25 * time_s), 0.2 * (time_s - 60.0)
    rates = 0.135 * np.cos(0.9 * time_s), 0.075 * np.cos(0.25 * time_s), np.full_like(time_s, 0.2)
    angles = np.array([roll, pitch, yaw])
    return share * angles, share * np.array(rates) + rate * angles


def circling(time_s):
    share, _ = eased(time_s)
    return share * np.array([0.4 * np.cos(0.2 * time_s), 0.4 * np.sin(0.2 * time_s), 0.05 * np.sin(0.1 * time_s)])


def resting(time_s):
    return np.zeros((3, len(time_s)))


def ahead(time_s):
    return np.zeros((3, len(time_s))), np.zeros((3, len(time_s)))


def begun(motion, **biases):
    attitude = tuple(motion.attitude(np.zeros(1))[0][:, 0].tolist())
    start = NavigationState(
        0.0, motion.latitude_rad, motion.longitude_rad, motion.depth_m, motion.velocity_mps, attitude
    )
    return Strapdown(start, **biases)


def driven(strapdown, samples):
    for sample in samples:
        strapdown.advance(*sample)
    return strapdown


def error_m(strapdown, truth):
    return truth.distance_m(strapdown.latitude_rad, strapdown.longitude_rad, strapdown.depth_m)


@pytest.fixture(scope="module", params=DURATIONS_S.items(), ids=lambda param: f"{param[0]} degrees")
def mission(request):
    latitude_deg, duration_s = request.param
    motion = Motion(rocking_circles, circling, radians(latitude_deg))
    return motion, duration_s, motion.truth([duration_s])[0]


@pytest.mark.parametrize(
    ("interval_s", "error_max_m"), [(0.01, 0.002), (0.1, 0.2)], ids=["100 Hz", "10 Hz"]
)  # measured at 600 s: 1 mm and 14 cm; without the terms of coning and sculling 14 cm and 14 m
def test_dead_reckoning_equals_an_integration_in_the_frame_of_the_earth(mission, interval_s, error_max_m):
    motion, duration_s, truth = mission
    ours = driven(begun(motion), motion.samples(every(interval_s, duration_s)))
    assert error_m(ours, truth) < error_max_m * (duration_s / 600.0) ** 2
    np.testing.assert_allclose(ours.velocity_mps, truth.velocity_mps, atol=0.005 * error_max_m)
    np.testing.assert_allclose(matrix(ours.attitude), truth.cosines, atol=3e-5 * error_max_m)


def test_any_intervals_lead_to_the_same_place():
    motion = Motion(rocking_circles, circling, 0.6)
    truth = motion.truth([120.0])[0]
    intervals = np.random.default_rng(3).uniform(0.002, 0.03, size=10000)
    edges = np.concatenate(([0.0], np.cumsum(intervals)))
    edges = np.append(edges[edges < 120.0], 120.0)
    ours = driven(begun(motion), motion.samples(edges))
    assert error_m(ours, truth) < 0.001


def test_what_depends_on_the_latitude_may_be_a_tenth_of_a_second_old(monkeypatch):
    """Ten minutes at 10 m/s to the north-east, near enough to a pole for the axes to turn."""
    motion = Motion(ahead, resting, radians(85.0), velocity_mps=(7.0, 7.0, 0.0))
    samples = motion.samples(every(0.02, 600.0))
    usual = driven(begun(motion), samples)
    monkeypatch.setattr(strapdown_module, "REFRESH_S", 0.0)
    always = driven(begun(motion), samples)
    apart_m = ecef_m(usual.latitude_rad, usual.longitude_rad, usual.depth_m) - ecef_m(
        always.latitude_rad, always.longitude_rad, always.depth_m
    )
    assert np.linalg.norm(apart_m) < 0.1  # of 6 km


def test_a_tilt_swings_with_the_period_of_schuler():
    """84.4 minutes, those of a pendulum as long as the earth's radius; its amplitude, too, follows from the tilt."""
    tilt_rad, interval_s = 1e-4, 1.0
    motion = Motion(ahead, resting, 0.0)
    ours = begun(motion)
    ours.correct(StrapdownError(attitude_rad=(0.0, tilt_rad, 0.0)))
    force, rate, _ = motion.samples((0.0, interval_s))[0]
    north_mps = []
    for _ in range(4000):
        ours.advance(force, rate, interval_s)
        north_mps.append(ours.velocity_mps[0])
    turned_back = np.flatnonzero(np.diff(np.sign(north_mps)))
    gravity, radius = gravity_mps2(0.0, 20.0), curvature_radii_m(0.0)[0] - 20.0
    assert 2.0 * turned_back[0] == pytest.approx(84.4 * 60.0, rel=0.01)
    assert -min(north_mps[:2000]) == pytest.approx(tilt_rad * np.sqrt(gravity * radius), rel=0.01)


@pytest.mark.parametrize("latitude_deg", [89.99, -89.99, 89.9997], ids=["1 km", "1 km south", "33 m and across"])
def test_near_a_pole_it_is_still_the_same_way(latitude_deg):
    motion = Motion(ahead, resting, radians(latitude_deg), velocity_mps=(2.0, 0.5, 0.0))
    truth = motion.truth([40.0])[0]
    ours = driven(begun(motion), motion.samples(every(0.01, 40.0)))
    assert error_m(ours, truth) < 0.3  # of 80 m
    turned = ned_axes(ours.latitude_rad, ours.longitude_rad).T @ matrix(ours.attitude)
    wanted = ned_axes(truth.latitude_rad, truth.longitude_rad).T @ truth.cosines
    np.testing.assert_allclose(turned, wanted, atol=1e-4)
    np.testing.assert_allclose(np.hypot(*ours.velocity_mps[:2]), np.hypot(*truth.velocity_mps[:2]), rtol=5e-3)


def test_across_the_date_line_longitudes_go_on_from_the_other_side():
    motion = Motion(ahead, resting, 0.6, longitude_rad=pi - 1e-6, velocity_mps=(0.0, 2.0, 0.0))
    truth = motion.truth([10.0])[0]
    ours = driven(begun(motion), motion.samples(every(0.1, 10.0)))
    assert ours.longitude_rad == pytest.approx(truth.longitude_rad, abs=1e-12)
    assert -pi < ours.longitude_rad < 0.0
    ours.correct(StrapdownError(position_m=(0.0, -100.0, 0.0)))
    assert 0.0 < ours.longitude_rad < pi
    assert Strapdown(replace(START, longitude_rad=1.5 * pi)).longitude_rad == pytest.approx(-0.5 * pi)


def test_biases_are_taken_off():
    motion = Motion(rocking_circles, circling, 0.6)
    samples = motion.samples(every(0.02, 100.0))
    biases = {"accelerometer_bias_mps2": (0.05, -0.03, 0.1), "gyroscope_bias_radps": (2e-3, -1e-3, 3e-3)}
    off = [
        (
            tuple(np.add(force, biases["accelerometer_bias_mps2"]).tolist()),
            tuple(np.add(rate, biases["gyroscope_bias_radps"]).tolist()),
            interval,
        )
        for force, rate, interval in samples
    ]
    clean, known = driven(begun(motion), samples), driven(begun(motion, **biases), off)
    corrected = begun(motion)
    corrected.correct(StrapdownError(**biases))
    for ours in (known, driven(corrected, off)):
        np.testing.assert_allclose(ours.velocity_mps, clean.velocity_mps, atol=1e-9)


def test_a_correction_changes_each_state_by_what_it_says():
    ours = Strapdown(START)
    meridian, transverse = curvature_radii_m(START.latitude_rad)
    ours.correct(StrapdownError((0.01, -0.02, 0.03), (0.1, 0.2, 0.3), (10.0, 20.0, 30.0), (0.01,) * 3, (1e-3,) * 3))
    assert between(Strapdown(START).attitude, ours.attitude) == pytest.approx((0.01, -0.02, 0.03))
    assert ours.velocity_mps == pytest.approx((1.1, -0.3, 0.5))
    assert ours.depth_m == pytest.approx(50.0)
    assert (ours.latitude_rad - START.latitude_rad) * (meridian - 20.0) == pytest.approx(10.0)
    east_m = (ours.longitude_rad - START.longitude_rad) * (transverse - 20.0) * np.cos(START.latitude_rad)
    assert east_m == pytest.approx(20.0)
    assert (ours.accelerometer_bias_mps2, ours.gyroscope_bias_radps) == ((0.01,) * 3, (1e-3,) * 3)


def test_its_state_is_the_one_it_was_given():
    state = Strapdown(START).state(7.0)
    assert (state.time_s, state.latitude_rad, state.longitude_rad, state.depth_m) == (7.0, 0.6, 0.5, 20.0)
    assert state.velocity_mps == START.velocity_mps
    assert state.attitude_rad == pytest.approx(START.attitude_rad)


def test_the_velocity_of_the_body_is_forward_when_it_drives_ahead():
    attitude = (0.3, -0.4, 2.0)
    ours = Strapdown(
        replace(START, attitude_rad=attitude, velocity_mps=rotate(from_euler(attitude), (2.0, 0.1, -0.2)))
    )
    assert ours.body_velocity() == pytest.approx((2.0, 0.1, -0.2))


def test_specific_force_is_told_in_the_axes_of_the_earth():
    ours = Strapdown(replace(START, attitude_rad=(0.0, 0.0, pi / 2.0)), accelerometer_bias_mps2=(0.5, 0.0, 0.0))
    assert ours.specific_force_mps2 == pytest.approx((0.0, 0.0, -gravity_mps2(0.6, 20.0)))
    ours.advance((1.5, 0.0, -9.8), (0.0, 0.0, 0.0), 0.01)
    assert ours.specific_force_mps2 == pytest.approx((0.0, 1.0, -9.8), abs=1e-5)


def test_attitudes_stay_of_unit_length():
    ours = Strapdown(START)
    for _ in range(20000):
        ours.advance((0.1, 0.2, -9.8), (3.0, -2.0, 1.0), 0.01)
    assert np.linalg.norm(ours.attitude) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("interval_s", [0.0, -0.01, 1.01, nan, inf])
def test_intervals_that_are_none_or_gaps_are_refused(interval_s):
    ours = Strapdown(START)
    with pytest.raises(ValueError, match="interval_s"):
        ours.advance((0.0, 0.0, -9.8), (0.0, 0.0, 0.0), interval_s)
    assert ours.state(0.0) == Strapdown(START).state(0.0)


@pytest.mark.parametrize(
    "wrong", [{"latitude_rad": 1.6}, {"longitude_rad": inf}, {"depth_m": nan}, {"velocity_mps": (nan, 0.0, 0.0)}]
)
def test_a_state_that_is_none_is_refused(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        Strapdown(replace(START, **wrong))


def test_pickled_anywhere_it_goes_on_bit_for_bit():
    motion = Motion(rocking_circles, circling, 0.6)
    samples = motion.samples(every(0.05, 70.0))
    whole = driven(begun(motion), samples)
    for cut in (0, 1, 703, len(samples)):
        again = pickle.loads(pickle.dumps(driven(begun(motion), samples[:cut])))  # noqa: S301
        assert driven(again, samples[cut:]).state(0.0) == whole.state(0.0)
