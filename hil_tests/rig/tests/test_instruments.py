"""The navigation sensors: true to the motion of the hull, as far off as asked for, and broken as scripted."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from math import pi, radians

import numpy as np
import pytest

from detectors.navigation import NavigationState, Sensor
from detectors.navigation.rotation import from_euler, rotate, rotate_back
from detectors.navigation.strapdown import Strapdown
from hil_tests.rig.dvl import DopplerLog, DvlErrors
from hil_tests.rig.geodesy import EARTH_RATE_RADPS, ORIGIN_LATITUDE_RAD, degrees_e7, gravity_mps2, place_m
from hil_tests.rig.helm import box, steer
from hil_tests.rig.inertial import EXACT_IMU, ImuErrors, ImuReading, InertialUnit, highres_imu, raw_imu
from hil_tests.rig.instruments import Equipment, Instruments
from hil_tests.rig.kinematics import Vector, added, attitude_rad, felt
from hil_tests.rig.pilot import SURVEYING, Pilot
from hil_tests.rig.pressure import PressureErrors, PressureSensor
from hil_tests.rig.tilt import Tilt, TiltParameters
from hil_tests.rig.vehicle import Motion, Vehicle, mix
from hil_tests.rig.water import Current, SettingIn
from hil_tests.sensor_faults import SensorFault

PERIOD_S = 0.01
LYING = Motion(
    down_m=7.0, yaw_rad=0.8, forward_mps=1.2, right_mps=-0.1, down_mps=0.05, yaw_rate_radps=0.3,
    roll_rad=-0.03, pitch_rad=0.05, roll_rate_radps=0.02, pitch_rate_radps=-0.04, water_mps=(0.1, -0.2, 0.0),
)  # fmt: skip


def survey(seconds, seed=5) -> Iterator[tuple[float, Motion]]:
    """Round a square, in a current that sets in."""
    water = SettingIn(Current(0.1, 0.4), onset_s=20.0, ramp_s=8.0)
    vehicle, pilot = Vehicle(PERIOD_S, seed, water=water), Pilot(seed, SURVEYING)
    motion = vehicle.hull.motion
    yield 0.0, motion
    for step in range(1, round(seconds / PERIOD_S) + 1):
        time_s = step * PERIOD_S
        motion = vehicle.step(time_s, mix(steer(box(10.0), time_s, pilot.sticks(time_s), motion)))
        yield time_s, motion


@pytest.fixture(scope="module")
def track() -> list[tuple[float, Motion]]:
    return list(survey(100.0))


def begun(motion: Motion) -> Strapdown:
    latitude_e7, longitude_e7 = degrees_e7(motion.north_m, motion.east_m)
    return Strapdown(
        NavigationState(
            0.0, radians(1e-7 * latitude_e7), radians(1e-7 * longitude_e7), motion.down_m,
            motion.velocity_ned_mps(), (motion.roll_rad, motion.pitch_rad, motion.yaw_rad),
        )
    )  # fmt: skip


def off_m(strapdown: Strapdown, motion: Motion) -> tuple[float, float, float]:
    north_m, east_m = place_m(strapdown.latitude_rad, strapdown.longitude_rad)
    return north_m - motion.north_m, east_m - motion.east_m, strapdown.depth_m - motion.down_m


@pytest.mark.parametrize("steps", [1, 2])
def test_a_strapdown_system_finds_the_true_track_from_an_exact_imu(track, steps):
    """The detector's mechanisation and the rig's sensors were written apart from each other: they must agree."""
    imu, strapdown = InertialUnit(EXACT_IMU, seed=1), begun(track[0][1])
    for index, ((_, before), (time_s, after)) in enumerate(pairwise(track), start=1):
        imu.step(before, after, PERIOD_S)
        if index % steps == 0:
            reading = imu.read(time_s)
            strapdown.advance(reading.specific_force_mps2, reading.angular_rate_radps, steps * PERIOD_S)
    end = track[-1][1]
    assert max(abs(motion.roll_rad) for _, motion in track) > radians(0.3)
    assert np.hypot(end.north_m, end.east_m) > 5.0
    assert off_m(strapdown, end) == pytest.approx((0.0, 0.0, 0.0), abs=0.05)
    assert strapdown.velocity_mps == pytest.approx(end.velocity_ned_mps(), abs=0.002)
    attitude_rad = strapdown.state(100.0).attitude_rad
    assert attitude_rad == pytest.approx((end.roll_rad, end.pitch_rad, end.yaw_rad), abs=2e-5)


def test_the_hull_moves_smoothly_enough_to_be_differentiated(track):
    forces = np.array([felt(before, after, PERIOD_S)[0] for (_, before), (_, after) in pairwise(track)])
    assert np.abs(np.diff(forces, axis=0)).max() < 0.5
    assert np.abs(forces[:, :2]).max() < 3.0


def test_at_rest_it_feels_gravity_and_the_turning_earth():
    force, rate = felt(Motion(), Motion(), PERIOD_S)
    assert force == pytest.approx((0.0, 0.0, -gravity_mps2(5.0)))
    assert gravity_mps2(0.0) == pytest.approx(9.8217, abs=1e-3)  # Trondheim, absolute gravity of the national net
    assert np.linalg.norm(rate) == pytest.approx(EARTH_RATE_RADPS)
    assert rate[2] == pytest.approx(-EARTH_RATE_RADPS * np.sin(ORIGIN_LATITUDE_RAD))


def place_of(motion: Motion, lever_arm_m: Vector) -> Vector:
    """Where a place in the body is, by the detector's rotations."""
    return added(
        (motion.north_m, motion.east_m, motion.down_m), rotate(from_euler(attitude_rad(motion)), lever_arm_m)
    )


def velocities(errors: DvlErrors, track, faults=()) -> list[tuple]:
    """When each message is sent, the velocity that it tells, and the message."""
    log = DopplerLog(errors, seed=1, faults=faults)
    told = []
    for time_s, motion in track:
        if message := log.due(time_s, motion):
            scale = 1e6 / message.time_delta_usec
            told.append((1e-6 * message.time_usec, tuple(scale * way_m for way_m in message.position_delta), message))
    return told


def test_an_exact_dvl_tells_how_its_place_in_the_body_moves(track):
    lever_arm_m = (-0.5, 0.2, 0.3)
    told = velocities(DvlErrors(noise_mps=0.0, lever_arm_m=lever_arm_m, delay_s=0.0), track)
    assert [time_s for time_s, *_ in told] == pytest.approx([0.2 * ping for ping in range(len(told))])
    assert len(told) == pytest.approx(500, abs=1)
    for index, (_, velocity_mps, _) in enumerate(told[1:-1], start=1):
        (_, before), (_, motion), (_, after) = track[20 * index - 1 : 20 * index + 2]
        moved_m = np.subtract(place_of(after, lever_arm_m), place_of(before, lever_arm_m))
        expected_mps = rotate_back(from_euler(attitude_rad(motion)), tuple(moved_m / (2.0 * PERIOD_S)))
        assert velocity_mps == pytest.approx(expected_mps, abs=0.02)  # the hull's steps are those of 10 ms


def test_dvl_and_imu_tell_of_the_same_motion(track):
    """At the IMU's own place."""
    imu, strapdown = InertialUnit(EXACT_IMU, seed=1), begun(track[0][1])
    errors = DvlErrors(noise_mps=0.0, lever_arm_m=(0.0, 0.0, 0.0), delay_s=0.0)
    told = {round(time_s, 3): velocity_mps for time_s, velocity_mps, _ in velocities(errors, track)}
    for (_, before), (time_s, after) in pairwise(track):
        imu.step(before, after, PERIOD_S)
        reading = imu.read(time_s)
        strapdown.advance(reading.specific_force_mps2, reading.angular_rate_radps, PERIOD_S)
        if velocity_mps := told.get(round(time_s, 3)):
            assert strapdown.body_velocity() == pytest.approx(velocity_mps, abs=0.002)


def test_a_dvl_speaks_after_a_delay_with_its_noise_and_confidence(track):
    errors = DvlErrors(noise_mps=0.01, delay_s=0.25, interval_s=0.1)
    told = velocities(errors, track)
    exact = velocities(replace(errors, noise_mps=0.0), track)
    assert told[0][0] == pytest.approx(0.25)
    off = np.array([one[1] for one in told]) - np.array([one[1] for one in exact])
    assert off.std(axis=0) == pytest.approx(0.01, rel=0.1)
    message = told[7][2]
    assert message.confidence == pytest.approx(97.5)
    turned_rad = np.subtract(attitude_rad(track[70][1]), attitude_rad(track[60][1]))
    assert message.angle_delta == pytest.approx(turned_rad, abs=1e-9)


def still_readings(errors: ImuErrors, seed: int, count: int, faults=()) -> list[ImuReading | None]:
    imu, readings = InertialUnit(errors, seed, faults), []
    for index in range(count):
        for _ in range(2):
            imu.step(Motion(), Motion(), PERIOD_S)
        readings.append(imu.read(0.02 * index))
    return readings


def test_an_imu_has_its_noise_and_keeps_its_offset():
    readings = still_readings(ImuErrors(), seed=3, count=4000)
    force = np.array([reading.specific_force_mps2 for reading in readings])
    rate = np.array([reading.angular_rate_radps for reading in readings])
    assert force.std(axis=0) == pytest.approx(1.0e-3 / np.sqrt(0.02), rel=0.05)
    assert rate.std(axis=0) == pytest.approx(7.0e-5 / np.sqrt(0.02), rel=0.05)
    true_force, true_rate = felt(Motion(), Motion(), PERIOD_S)
    offsets = np.concatenate([force.mean(axis=0) - true_force, rate.mean(axis=0) - true_rate])
    assert np.all(np.abs(offsets[:3]) < 0.1)
    assert np.abs(offsets[:3]).max() > 1e-2
    assert np.all(np.abs(offsets[3:]) < 2e-3)
    other = still_readings(ImuErrors(), seed=4, count=1)[0]
    assert other != readings[0]


def test_offsets_are_as_large_as_asked_for():
    exact, _ = felt(Motion(), Motion(), PERIOD_S)
    errors = replace(EXACT_IMU, accelerometer_bias_mps2=0.2)
    offsets = [np.subtract(still_readings(errors, seed, 1)[0].specific_force_mps2, exact) for seed in range(300)]
    assert np.std(offsets) == pytest.approx(0.2, rel=0.1)


def test_it_is_read_for_what_has_been_since_the_last_time():
    imu = InertialUnit(EXACT_IMU, seed=1)
    assert imu.read(0.0) is None
    imu.step(Motion(), Motion(forward_mps=0.1), 0.1)
    imu.step(Motion(forward_mps=0.1), Motion(forward_mps=0.1), 0.1)
    assert imu.read(0.2).specific_force_mps2[0] == pytest.approx(0.5, abs=1e-4)
    assert imu.read(0.2) is None


def test_raw_imu_is_in_whole_thousandths_cut_off_and_says_its_time():
    message = raw_imu(61.24, ImuReading((0.014, -0.0097, -9.81), (0.0309, -0.0009, 2.0)))
    assert message.time_usec == 61_240_000
    assert (message.xacc, message.yacc, message.zacc) == (1, 0, -1000)  # 1 mG = 0.0098 m/s2
    assert (message.xgyro, message.ygyro, message.zgyro) == (30, 0, 2000)
    beyond = raw_imu(0.0, ImuReading((1e6, -1e6, 0.0), (1e6, -1e6, 0.0)))
    assert (beyond.xacc, beyond.ygyro) == (32767, -32767)


def test_highres_imu_is_in_si_units_and_says_what_is_new():
    message = highres_imu(61.24, ImuReading((0.014, -0.0097, -9.81), (0.0309, -0.0009, 2.0)))
    assert message.time_usec == 61_240_000
    assert (message.xacc, message.yacc, message.zacc) == (0.014, -0.0097, -9.81)
    assert (message.xgyro, message.ygyro, message.zgyro) == (0.0309, -0.0009, 2.0)
    assert message.fields_updated == 0b111111  # accelerations and rates


def test_pressure_is_that_of_the_water_above():
    exact = PressureSensor(PressureErrors(noise_m=0.0), seed=1)
    assert exact.read(0.0, Motion(down_m=0.0)) == 101_325.0
    assert exact.read(0.0, Motion(down_m=10.0)) == pytest.approx(101_325.0 + 10.0 * 9.82 * 1025.0, rel=1e-4)
    noisy = PressureSensor(PressureErrors(noise_m=0.02), seed=1)
    pressures = [noisy.read(0.1 * step, Motion(down_m=10.0)) for step in range(4000)]
    assert np.std(pressures) == pytest.approx(0.02 * 9.82 * 1025.0, rel=0.05)


def fault(sensor: Sensor, kind, **keys) -> SensorFault:
    return SensorFault(sensor=sensor, kind=kind, **({"onset_s": 50.0, "end_s": 70.0} | keys))


@pytest.mark.parametrize(
    ("broken", "during"),
    [
        (fault(Sensor.DVL, "drift", size=0.1, axis=0), lambda time_s, true: added(true, (0.1 * time_s - 5.0, 0, 0))),
        (fault(Sensor.DVL, "zero"), lambda time_s, true: (0.0, 0.0, 0.0)),
        (fault(Sensor.DVL, "scale", size=-0.2), lambda time_s, true: tuple(0.8 * part for part in true)),
        (fault(Sensor.DVL, "stop"), lambda time_s, true: None),
        (fault(Sensor.DEPTH, "step", size=2.0), lambda time_s, true: true),
    ],
)
def test_a_broken_dvl_tells_what_its_fault_makes_of_the_truth(track, broken, during):
    errors = DvlErrors(delay_s=0.0)
    told = {round(time_s, 3): velocity for time_s, velocity, _ in velocities(errors, track, [broken])}
    for time_s, true, _ in velocities(errors, track):
        expected = during(time_s, true) if 50.0 <= time_s < 70.0 else true
        assert told.get(round(time_s, 3)) == (None if expected is None else pytest.approx(expected, abs=1e-6))


def test_the_others_break_too():
    faults = [
        fault(Sensor.GYROSCOPE, "step", size=0.1, axis=2, onset_s=1.0, end_s=2.0),
        fault(Sensor.ACCELEROMETER, "stop", onset_s=3.0, end_s=4.0),
        fault(Sensor.DEPTH, "quadratic", size=0.5, onset_s=1.0, end_s=4.0),
    ]
    readings = still_readings(EXACT_IMU, 1, 300, faults)
    assert [reading is None for reading in readings] == [3.0 <= 0.02 * index < 4.0 for index in range(300)]
    assert readings[70].angular_rate_radps[2] - readings[0].angular_rate_radps[2] == pytest.approx(0.1)
    assert readings[110].angular_rate_radps == pytest.approx(readings[0].angular_rate_radps)
    depth = PressureSensor(PressureErrors(noise_m=0.0), seed=1, faults=faults)
    true_pa = depth.read(0.5, Motion())
    assert depth.read(3.0, Motion()) - true_pa == pytest.approx(2.0 * 1025.0 * gravity_mps2(5.0))


def test_instruments_of_one_vehicle_make_messages_of_their_own(track):
    instruments = Instruments(Equipment(faults=[fault(Sensor.DEPTH, "stop", onset_s=1.0)]), 1, track[0][1])
    assert instruments.raw_imu(0.0) is None
    for time_s, motion in track[1:51]:
        instruments.step(motion, PERIOD_S)
        if message := instruments.vision_position_delta(time_s):
            assert message.get_type() == "VISION_POSITION_DELTA"
    assert -1020 < instruments.raw_imu(0.5).zacc < -980
    assert instruments.scaled_pressure2(0.5).press_abs == pytest.approx(1013.25 + 502.0, abs=10.0)
    assert instruments.scaled_pressure2(1.0) is None


def test_a_tilt_swings_in_and_comes_back():
    tilt = Tilt(TiltParameters())
    angles = []
    for index in range(1000):
        tilt.step(40.0 if index < 500 else 0.0, PERIOD_S)
        angles.append(tilt.angle_rad)
    assert angles[499] == pytest.approx(radians(2.0), rel=0.01)
    assert angles[-1] == pytest.approx(0.0, abs=radians(0.02))
    assert max(angles) < radians(2.2)
    for _ in range(20):
        tilt.step(40.0, 5.0)
    assert abs(tilt.angle_rad) < 0.5 * pi


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: ImuErrors(gyroscope_noise_radps=-1.0), "gyroscope_noise_radps = -1.0: want a standard deviation"),
        (lambda: DvlErrors(interval_s=0.0), "interval_s = 0.0: want seconds above 0"),
        (lambda: DvlErrors(noise_mps=0.5), "noise_mps = 0.5: want 0 to below 0.4"),
        (lambda: DvlErrors(lever_arm_m=(0.0, 0.0, float("nan"))), "lever_arm_m = .*: want three finite numbers"),
        (lambda: DvlErrors(delay_s=-0.1), "delay_s = -0.1: want 0 or more seconds"),
        (lambda: PressureErrors(noise_m=-1.0), "noise_m = -1.0: want a standard deviation"),
        (lambda: PressureErrors(density_kgm3=0.0), "density_kgm3 = 0.0: want a number above 0"),
    ],
)
def test_impossible_errors_are_refused(make, says):
    with pytest.raises(ValueError, match=says):
        make()
