"""Random dives: what the sensors say is what a vehicle that moves like this would measure."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from hil_tests.dives import VEHICLES, random_dive
from hil_tests.dives.manoeuvres import MARGIN_S, random_motion
from hil_tests.dives.motion import gravity_mps2, motion_of
from hil_tests.dives.sensors import (
    ACCELEROMETER_DENSITY,
    IMU_HZ,
    measured_depth,
    measured_inertial,
    measured_velocity,
    thinned,
)

EARTH_RADPS = np.array([0.0, 0.0, 7.292115e-5])
NOTHING = (0.0, 0.0, 0.0)
SEEDS = (0, 1)  # an AUV, an ROV


@pytest.fixture(scope="module", params=SEEDS)
def dive(request):
    return random_dive(request.param, duration_s=120.0)


def perfect(sensors):
    """Sensors that make no errors."""
    return replace(
        sensors, accelerometer_offset_mps2=NOTHING, gyroscope_offset_radps=NOTHING, accelerometer_scale=NOTHING,
        gyroscope_scale=NOTHING, dvl_noise_mps=0.0, dvl_noise=0.0, dvl_scale=0.0, depth_noise_m=0.0,
    )  # fmt: skip


def to_earth_centred(latitude_rad, longitude_rad, depth_m):
    """(3,) position in m, and the rotation from north-east-down, by the textbook's formula of the ellipsoid."""
    axis_m, flattening = 6378137.0, 1.0 / 298.257223563
    squared = flattening * (2.0 - flattening)
    radius_m = axis_m / np.sqrt(1.0 - squared * np.sin(latitude_rad) ** 2)
    out_m = (radius_m - depth_m) * np.cos(latitude_rad)
    up_m = (radius_m * (1.0 - squared) - depth_m) * np.sin(latitude_rad)
    position_m = np.array([out_m * np.cos(longitude_rad), out_m * np.sin(longitude_rad), up_m])
    return position_m, Rotation.from_euler("ZYX", [longitude_rad, -latitude_rad - np.pi / 2.0, 0.0])


def plumb(position_m):
    """(3,) downwards, normal to the ellipsoid."""
    scaled = position_m / np.array([1.0, 1.0, (1.0 - 1.0 / 298.257223563) ** 2])
    return -scaled / np.linalg.norm(scaled)


def test_the_inertial_sensors_lead_from_the_start_to_the_end(dive):
    """Integrated in the frame of the earth's centre, where there is no north, no radius of curvature and no transport
    rate: nothing is shared with the way in which the samples were made."""
    motion, step_s, end_s = dive.motion, 0.0025, 30.0
    middle_s = np.arange(0.0, end_s, step_s) + 0.5 * step_s
    forces, rates = motion.specific_force_mps2(middle_s), motion.angular_rate_radps(middle_s)
    start = motion.position(0.0)
    position_m, local = to_earth_centred(*start)
    start_m = position_m
    velocity_mps = local.apply(motion.velocity_mps(0.0))
    attitude = (local * motion.frame(np.zeros(1))[0]).as_matrix()
    turned = Rotation.from_rotvec(rates * step_s).as_matrix()
    halfway = Rotation.from_rotvec(rates * 0.5 * step_s).as_matrix()
    earth = Rotation.from_rotvec(-EARTH_RADPS * step_s).as_matrix()
    gravity = gravity_mps2(*motion.position(middle_s)[:, [0, 2]].T)
    for force, turn, half, g_mps2 in zip(forces, turned, halfway, gravity, strict=True):
        acceleration = (
            attitude @ half @ force + g_mps2 * plumb(position_m) - 2.0 * np.cross(EARTH_RADPS, velocity_mps)
        )
        position_m = position_m + step_s * velocity_mps + 0.5 * step_s**2 * acceleration
        velocity_mps = velocity_mps + step_s * acceleration
        attitude = earth @ attitude @ turn
    true_m, local_there = to_earth_centred(*motion.position(end_s))
    assert np.linalg.norm(true_m - start_m) > 2.0
    assert_allclose(position_m, true_m, rtol=0.0, atol=0.01)
    assert_allclose(velocity_mps, local_there.apply(motion.velocity_mps(end_s)), atol=5e-4)
    assert_allclose(attitude, (local_there * motion.frame(np.array([end_s]))[0]).as_matrix(), atol=2e-5)


def test_one_that_rests_feels_gravity_and_the_turning_earth():
    time_s = np.arange(0.0, 10.0, 0.1)
    still = np.zeros((len(time_s), 3))
    motion = motion_of(time_s, still + np.array([0.0, 0.0, np.pi / 2.0]), still, (np.deg2rad(30.0), 1.0, 0.0))
    assert_allclose(motion.specific_force_mps2(time_s[:1])[0], [0.0, 0.0, -9.79325], atol=2e-5)
    # it heads east: the earth's rate, to the north, is to its left
    earth = EARTH_RADPS[2] * np.array([0.0, -np.cos(np.deg2rad(30.0)), -np.sin(np.deg2rad(30.0))])
    assert_allclose(motion.angular_rate_radps(time_s[:1])[0], earth, atol=1e-12)


def test_one_that_circles_is_pulled_inwards():
    time_s = np.arange(0.0, 60.0, 0.1)
    attitude_rad = np.column_stack([0.0 * time_s, 0.0 * time_s, 0.2 * time_s])
    motion = motion_of(time_s, attitude_rad, np.tile((1.5, 0.0, 0.0), (len(time_s), 1)), (0.5, 0.5, 10.0))
    now_s = np.array([30.0])
    assert_allclose(motion.specific_force_mps2(now_s)[0, :2], [0.0, 0.3], atol=1e-3)
    assert_allclose(motion.angular_rate_radps(now_s)[0], [0.0, 0.0, 0.2], atol=1e-4)
    # a place in the bow goes sideways, one to starboard is slower in a turn to starboard
    assert_allclose(motion.body_velocity_mps(now_s, (2.0, 1.0, 0.0))[0], [1.5 - 0.2, 0.4, 0.0], atol=1e-6)


def test_depth_and_position_follow_the_velocity(dive):
    time_s = np.arange(0.0, 120.0, 0.1)
    velocity_mps = dive.motion.velocity_mps(time_s)
    depth_m = dive.motion.position(time_s)[:, 2]
    risen_m = np.concatenate([[0.0], np.cumsum(0.05 * (velocity_mps[1:, 2] + velocity_mps[:-1, 2]))])
    assert_allclose(depth_m - depth_m[0], risen_m, atol=5e-3)
    ends_m = [to_earth_centred(*dive.motion.position(when_s))[0] for when_s in (0.0, 120.0)]
    way_m = np.trapezoid(velocity_mps, time_s, axis=0)
    assert np.linalg.norm(ends_m[1] - ends_m[0]) == pytest.approx(np.linalg.norm(way_m), abs=0.3)


def test_the_dvl_measures_at_its_place_time_and_angle(dive):
    sensors = replace(
        perfect(dive.sensors), dvl_delay_s=0.7, dvl_arm_m=(1.0, 0.0, 0.5), dvl_mounting_rad=(0.0, 0.0, 0.05)
    )
    rows = measured_velocity(np.random.default_rng(0), sensors, dive.motion, 100.0)
    then_s = rows[:, 0] - 0.7
    there_mps = dive.motion.body_velocity_mps(then_s) + np.cross(dive.motion.turning_radps(then_s), (1.0, 0.0, 0.5))
    heading_rad = np.arctan2(there_mps[:, 1], there_mps[:, 0]) - np.arctan2(rows[:, 2], rows[:, 1])
    assert_allclose((heading_rad + np.pi) % (2.0 * np.pi) - np.pi, 0.05, atol=1e-9)
    assert_allclose(rows[:, 3], there_mps[:, 2], atol=1e-12)
    off = replace(sensors, dvl_scale=0.01)
    assert_allclose(measured_velocity(np.random.default_rng(0), off, dive.motion, 100.0)[:, 1:], 1.01 * rows[:, 1:])


def test_noise_offsets_and_scales_are_those_that_were_drawn():
    dive = random_dive(0, duration_s=400.0)
    sensors, true = dive.sensors, dive.motion
    middle_s = dive.imu[:, 0] - 0.5 / IMU_HZ
    off_mps2 = dive.imu[:, 1:4] - true.specific_force_mps2(middle_s)
    white = np.hypot(ACCELEROMETER_DENSITY * np.sqrt(IMU_HZ), sensors.vibration_mps2)
    assert_allclose(off_mps2.std(axis=0), white, rtol=0.02)
    gravity_share = np.array([0.0, 0.0, -9.8]) * sensors.accelerometer_scale
    assert_allclose(off_mps2.mean(axis=0), sensors.accelerometer_offset_mps2 + gravity_share, atol=3e-3)
    off_radps = dive.imu[:, 4:] - true.angular_rate_radps(middle_s)
    assert_allclose(off_radps.mean(axis=0), sensors.gyroscope_offset_radps, atol=2e-4)
    then_s = dive.dvl[:, 0] - sensors.dvl_delay_s
    speed_mps = np.linalg.norm(true.body_velocity_mps(then_s, sensors.dvl_arm_m), axis=1)
    scaled = np.linalg.norm(dive.dvl[:, 1:], axis=1) / speed_mps
    assert scaled.mean() == pytest.approx(1.0 + sensors.dvl_scale, abs=1e-3)
    noise_mps = sensors.dvl_noise_mps + sensors.dvl_noise * speed_mps.mean()
    assert scaled.std() * speed_mps.mean() == pytest.approx(noise_mps, rel=0.1)
    depth_m = dive.depth[:, 1] - true.position(dive.depth[:, 0] - sensors.depth_delay_s)[:, 2]
    assert depth_m.mean() == pytest.approx(sensors.depth_offset_m, abs=0.01)
    assert depth_m.std() == pytest.approx(sensors.depth_noise_m, rel=0.1)


def test_what_is_recorded_begins_and_ends_with_the_dive(dive):
    assert dive.reference is not None
    assert_allclose(np.diff(dive.imu[:, 0]), 1.0 / IMU_HZ)
    for rows, rate_hz in ((dive.dvl, dive.sensors.dvl_rate_hz), (dive.depth, dive.sensors.depth_rate_hz)):
        assert_allclose(np.diff(rows[:, 0]), 1.0 / rate_hz)
        assert 0.0 <= rows[0, 0] < 1.0 / rate_hz
        assert 120.0 - 1.0 / rate_hz <= rows[-1, 0] < 120.0
    begin = dive.initial
    assert_allclose([begin.latitude_rad, begin.longitude_rad, begin.depth_m], dive.motion.position(0.0))
    assert_allclose(begin.velocity_mps, dive.motion.velocity_mps(0.0))
    assert_allclose(dive.motion.frame(np.zeros(1))[0].as_euler("ZYX")[::-1], begin.attitude_rad)
    assert all(one.time_s <= other.time_s for one, other in pairwise(dive.samples()))


def test_a_dive_is_its_seed():
    dive, again, other = (
        random_dive(2, duration_s=30.0),
        random_dive(2, duration_s=30.0),
        random_dive(4, duration_s=30.0),
    )
    for name in ("imu", "dvl", "depth", "reference"):
        assert_array_equal(getattr(dive, name), getattr(again, name))
    assert not np.array_equal(dive.imu, other.imu)
    assert dive.drawn != other.drawn
    assert [random_dive(seed, duration_s=20.0).vehicle for seed in range(4)] == ["auv", "rov", "auv", "rov"]


def test_a_slower_imu_says_the_means():
    fast, slow = random_dive(3, duration_s=30.0), random_dive(3, duration_s=30.0, imu_hz=25.0)
    assert_array_equal(slow.imu, thinned(fast.imu, 25.0))
    assert_allclose(slow.imu[10, 1:], fast.imu[40:44, 1:].mean(axis=0))
    assert slow.imu[10, 0] == fast.imu[43, 0]
    assert_array_equal(slow.dvl, fast.dvl)
    with pytest.raises(ValueError, match=r"rate_hz = 30.0: want a whole fraction of 100.0"):
        thinned(fast.imu, 30.0)


def test_rates_can_be_chosen():
    chosen = random_dive(0, duration_s=30.0, dvl_hz=5.0, depth_hz=4.0)
    assert_allclose(np.diff(chosen.dvl[:, 0]), 0.2)
    assert_allclose(np.diff(chosen.depth[:, 0]), 0.25)
    assert_array_equal(chosen.imu, random_dive(0, duration_s=30.0).imu)


def test_rough_dives_lose_samples_and_plain_ones_do_not():
    gaps_s = []
    for seed in range(3):
        plain, rough = (random_dive(seed, style=style, duration_s=200.0) for style in ("plain", "rough"))
        assert_array_equal(plain.reference, rough.reference)
        assert len(rough.imu) < len(plain.imu) == 20_000
        assert len(rough.dvl) < len(plain.dvl)
        gaps_s.append(np.diff(rough.dvl[:, 0]).max())
    assert max(gaps_s) > 3.0


@pytest.mark.parametrize("name", VEHICLES)
def test_vehicles_stay_in_the_water_and_upright(name):
    time_s = np.arange(0.0, 600.0)
    for seed in range(20):
        motion = random_motion(np.random.default_rng(seed), VEHICLES[name], 600.0)
        depth_m = motion.position(time_s)[:, 2]
        assert depth_m.min() > 0.0
        assert depth_m.max() < 80.0
        assert np.abs(motion.attitude_rad(time_s)[:, :2]).max() < 0.7
        speed_mps = np.linalg.norm(motion.velocity_mps(time_s), axis=1)
        assert speed_mps.max() < VEHICLES[name].speed_mps[1] + 0.6


def test_sensors_that_look_back_have_something_to_see():
    dive = random_dive(0, duration_s=20.0)
    late = replace(dive.sensors, dvl_delay_s=MARGIN_S - 0.1, depth_delay_s=MARGIN_S - 0.1)
    early = replace(dive.sensors, dvl_delay_s=0.1 - MARGIN_S)
    for sensors in (late, early):
        rng = np.random.default_rng(0)
        assert np.abs(measured_velocity(rng, sensors, dive.motion, 20.0)[:, 1:]).max() < 4.0
    assert np.ptp(measured_depth(np.random.default_rng(0), late, dive.motion, 20.0)[:, 1]) < 20.0
    assert len(measured_inertial(np.random.default_rng(0), late, dive.motion, 20.0)) == 2000


@pytest.mark.parametrize(
    "arguments",
    [
        {"seed": -1},
        {"seed": 0, "vehicle": "ship"},
        {"seed": 0, "style": "odd"},
        {"seed": 0, "duration_s": 1.0},
        {"seed": 0, "dvl_hz": 0.0},
    ],
)
def test_arguments_out_of_range_are_named(arguments):
    with pytest.raises(ValueError, match=list(arguments)[-1]):
        random_dive(**arguments)
