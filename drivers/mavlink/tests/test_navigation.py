"""What a navigation watch reads: inertial units, barometers, DVLs and attitudes, against pymavlink's encoder."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as dialect
from scipy.spatial.transform import Rotation

from drivers.mavlink.decoder import MavlinkDecoder
from drivers.mavlink.tests.peer import Peer, messages_in
from drivers.readings import Attitude, BodyVelocity, Inertial, WaterPressure

G = 9.80665
INT16 = st.integers(-(2**15), 2**15 - 1)
FLOAT32 = st.floats(width=32)
SIX_COUNTS = st.tuples(*[INT16] * 6)
MAG = (0, 0, 0)
SCALED = ("SCALED_IMU", "SCALED_IMU2", "SCALED_IMU3")
# the sender of the BlueOS extensions for Water Linked and Cerulean DVLs
EXTENSION = (255, 0)


def decoder(system=1, **options):
    return MavlinkDecoder([], autopilot_system=system, navigation=True, **options)


def generated(name, *values):
    return getattr(dialect, f"MAVLink_{name.lower()}_message")(*values)


def position_delta(sender=EXTENSION, delta=(0.05, -0.01, 0.002), interval_us=100_000, confidence=80.0, time_us=0):
    message = generated("VISION_POSITION_DELTA", time_us, interval_us, (0, 0, 0), delta, confidence)
    return Peer(*sender).pack(message)


def odometry(sender=(1, 197), velocity=(0.5, 0.1, -0.2), frame=12, estimator=2, quality=90, time_us=0):
    nothing = (0.0,) * 21
    pose = (0, 0, 0, (1, 0, 0, 0))
    tail = (nothing, nothing, 0, estimator, quality)
    return Peer(*sender).pack(generated("ODOMETRY", time_us, 20, frame, *pose, *velocity, 0, 0, 0, *tail))


def speed_estimate(velocity, sender=(1, 197), time_us=0):
    return Peer(*sender).pack(generated("VISION_SPEED_ESTIMATE", time_us, *velocity))


# Inertial units -----------------------------------------------------------------------------------


@given(SIX_COUNTS, st.integers(1, 2**60), st.booleans())
def test_raw_imu_against_pymavlink(counts, time_us, mavlink1):
    data = Peer().pack(generated("RAW_IMU", time_us, *counts, *MAG), mavlink1=mavlink1)
    (sent,) = messages_in(data)
    check_counts(decoder(), data, sent, "RAW_IMU", sent.time_usec / 1e6)


@given(SIX_COUNTS, st.integers(0, 2**32 - 1), st.sampled_from(SCALED))
def test_scaled_imus_against_pymavlink(counts, boot_ms, name):
    data = Peer().pack(generated(name, boot_ms, *counts, *MAG))
    (sent,) = messages_in(data)
    decode = decoder()
    check_counts(decode, data, sent, name, sent.time_boot_ms / 1e3)


def check_counts(decode, data, sent, source, boot_s):
    readings = decode.decode(data, 7.0)
    counts = [getattr(sent, name) for name in ("xacc", "yacc", "zacc", "xgyro", "ygyro", "zgyro")]
    readings = [one for one in readings if isinstance(one, Inertial)]
    if not readings:
        force_mps2, rate = max(map(abs, counts[:3])) * G / 1000, max(map(abs, counts[3:])) / 1000
        cause = "IMU absent" if not any(counts) else "implausible IMU"
        assert decode.drops[cause] == 1
        assert not any(counts) or force_mps2 > 199 or rate > 32.7
        return
    (unit,) = readings
    assert (unit.time_s, unit.boot_s, unit.source) == (7.0, boot_s, source)
    measured = [*(force / G for force in unit.specific_force_mps2), *unit.angular_rate_radps]
    for value, count in zip(measured, counts, strict=True):
        assert abs(value) * 1000 == pytest.approx(abs(count) + 0.5 if count else 0.0)
        assert value * count >= 0


@given(st.tuples(*[FLOAT32] * 6), st.integers(1, 2**60), st.integers(0, 2))
def test_highres_imu_against_pymavlink(values, time_us, unit):
    data = Peer().pack(generated("HIGHRES_IMU", time_us, *values, *MAG, 1013.0, 0.0, 0.0, 20.0, 0x3F, unit))
    (sent,) = messages_in(data)
    decode = decoder()
    readings = decode.decode(data, 7.0)
    if not readings:
        assert decode.drops == {"implausible IMU": 1}
        small = all(abs(value) <= 200 for value in values[:3]) and all(abs(value) <= 40 for value in values[3:])
        assert not small
        return
    force, rate = (sent.xacc, sent.yacc, sent.zacc), (sent.xgyro, sent.ygyro, sent.zgyro)
    source = f"HIGHRES_IMU {unit}" if unit else "HIGHRES_IMU"
    assert readings == [Inertial(7.0, sent.time_usec / 1e6, source, force, rate)]


@pytest.mark.parametrize("mean", [-980.3, -3.4, 0.4, 12.25])
def test_cut_off_fractions_leave_no_offset(mean):
    """What an autopilot with noise on its sensors sends comes out right on average, on either side of zero."""
    decode, peer = decoder(), Peer()
    noisy = mean + np.random.default_rng(5).normal(0.0, 2.0, 4000)
    frames = [
        peer.pack(generated("RAW_IMU", time_us, int(value), 0, -1, 0, 0, 0, *MAG))
        for time_us, value in enumerate(noisy, start=1)
    ]
    heard = [one.specific_force_mps2[0] / G * 1000 for one in decode.decode(b"".join(frames), 0.0)]
    assert len(heard) == 4000
    assert np.mean(heard) == pytest.approx(mean, abs=0.15)


def test_a_unit_without_news_or_without_a_measurement():
    decode = decoder()
    still = generated("HIGHRES_IMU", 1, 0, 0, -9.8, 0, 0, 0, *MAG, 1013.0, 0.0, 0.0, 20.0, 0x38)
    assert decode.decode(Peer().pack(still), 0.0) == []
    absent = generated("SCALED_IMU2", 689175, 0, 0, 0, 0, 0, 0, -289, 162, 223)  # a compass, as a BlueROV2 sends it
    assert decode.decode(Peer().pack(absent), 0.0) == []
    assert decode.drops == {"IMU without news": 1, "IMU absent": 1}


def test_repeated_and_late_samples_are_refused():
    decode, peer = decoder(), Peer()
    stamps = [1_000_000, 1_020_000, 1_020_000, 1_000_000, 1_040_000]
    frames = [peer.pack(generated("RAW_IMU", stamp, 0, 0, -1000, 0, 0, 0, *MAG)) for stamp in stamps]
    assert [one.boot_s for one in decode.decode(b"".join(frames), 0.0)] == [1.0, 1.02, 1.04]
    assert decode.drops == {"repeated": 1, "late": 1}


def test_without_navigation_none_of_it_is_read():
    decode = MavlinkDecoder([], autopilot_system=1)
    imu = Peer().pack(generated("RAW_IMU", 1, 0, 0, -1000, 0, 0, 0, *MAG))
    assert decode.decode(imu + position_delta() + odometry(), 0.0) == []
    assert decode.drops == {}


# Barometers ---------------------------------------------------------------------------------------


@given(FLOAT32, INT16, st.sampled_from([1, 2, 3]), st.integers(0, 2**32 - 1))
def test_pressure_against_pymavlink(hectopascals, centidegrees, instance, boot_ms):
    name = "SCALED_PRESSURE" + (str(instance) if instance > 1 else "")
    data = Peer().pack(generated(name, boot_ms, hectopascals, 0.0, centidegrees))
    (sent,) = messages_in(data)
    decode = decoder()
    readings = decode.decode(data, 3.0)
    if not readings:
        assert decode.drops == {"implausible pressure": 1}
        assert not 200 <= sent.press_abs <= 1.3e6
        return
    (one,) = readings
    assert isinstance(one, WaterPressure)
    assert (one.time_s, one.boot_s, one.instance) == (3.0, boot_ms / 1000, instance)
    assert one.pressure_pa == pytest.approx(100.0 * sent.press_abs)
    if -5000 <= sent.temperature <= 12000:
        assert one.temperature_k == pytest.approx(273.15 + sent.temperature / 100)
    else:
        assert one.temperature_k is None


# DVLs ---------------------------------------------------------------------------------------------


@given(st.tuples(*[FLOAT32] * 3), st.integers(0, 2**40), FLOAT32, st.integers(0, 2**60))
def test_position_delta_against_pymavlink(delta, interval_us, confidence, time_us):
    data = position_delta(EXTENSION, delta, interval_us, confidence, time_us)
    (sent,) = messages_in(data)
    decode = decoder()
    readings = decode.decode(data, 3.0)
    if not readings:
        assert sum(decode.drops.values()) == 1
        slow = 0 < interval_us <= 10**7 and all(abs(one) / interval_us * 1e6 <= 20.0 for one in sent.position_delta)
        assert not (slow and confidence > 0.0)
        return
    (one,) = readings
    assert isinstance(one, BodyVelocity)
    assert one.velocity_mps == pytest.approx([metres * 1e6 / interval_us for metres in sent.position_delta])
    assert (one.time_s, one.source) == (3.0, "VISION_POSITION_DELTA 255.0")
    assert one.boot_s == (time_us / 1e6 if time_us else None)


@given(st.tuples(*[FLOAT32] * 3), st.integers(0, 21), st.integers(-128, 127), st.integers(0, 9))
def test_odometry_against_pymavlink(velocity, frame, quality, estimator):
    data = odometry((1, 197), velocity, frame, estimator, quality, 5_000_000)
    (sent,) = messages_in(data)
    decode = decoder()
    readings = decode.decode(data, 3.0)
    good = frame == 12 and quality >= 0 and estimator != 8 and all(abs(one) <= 20 for one in velocity)
    wanted = BodyVelocity(3.0, 5.0, (sent.vx, sent.vy, sent.vz), "ODOMETRY 1.197")
    assert readings == ([wanted] if good else [])
    assert sum(decode.drops.values()) == (not good)


ANGLE = st.floats(-3, 3, width=32)


@given(st.tuples(*[st.floats(-10, 10, width=32)] * 3), ANGLE, st.floats(-1.5, 1.5, width=32), ANGLE)
def test_speed_estimate_is_turned_into_the_frame_of_the_body(velocity, roll, pitch, yaw):
    decode = decoder()
    decode.decode(Peer().pack(dialect.MAVLink_attitude_message(1, roll, pitch, yaw, 0, 0, 0)), 3.0)
    (one,) = decode.decode(speed_estimate(velocity), 3.1)
    wanted = Rotation.from_euler("ZYX", [yaw, pitch, roll]).inv().apply(velocity)
    assert one.velocity_mps == pytest.approx(list(wanted), abs=1e-5)
    assert (one.boot_s, one.source) == (None, "VISION_SPEED_ESTIMATE 1.197")


def test_speed_estimate_needs_a_fresh_attitude():
    decode = decoder()
    assert decode.decode(speed_estimate((1, 0, 0)), 3.0) == []
    decode.decode(Peer().attitude(), 3.0)
    assert decode.decode(speed_estimate((1, 0, 0)), 3.6) == []
    assert decode.drops == {"velocity without attitude": 2}


def test_no_bottom_lock_is_no_measurement():
    decode = decoder()
    lost = position_delta(delta=(0, 0, 0), confidence=0.0) + odometry(quality=-1)
    assert decode.decode(lost, 0.0) == []
    assert decode.drops == {"DVL without bottom lock": 2}


def test_senders_of_the_vehicle_and_ground_station_ids_are_heard_and_others_are_not():
    decode = decoder()
    senders = [EXTENSION, (255, 190), (1, 1), (1, 197), (1, 192), (2, 197), (254, 0)]
    heard = [one.source for sender in senders for one in decode.decode(position_delta(sender), 0.0)]
    assert heard == [f"VISION_POSITION_DELTA {system}.{component}" for system, component in senders[:4]]
    assert decode.drops == {"not our vehicle": 2, "another's, with our ids": 1}


def test_dvl_of_an_unknown_vehicle_waits_for_its_autopilot():
    decode = decoder(system=None)
    assert decode.decode(position_delta(), 0.0) == []
    assert len(decode.decode(Peer().heartbeat() + position_delta(), 0.1)) == 2


def test_a_second_route_to_a_sender_without_a_clock_gives_nothing_new():
    decode = decoder()
    assert len(decode.decode(position_delta(), 0.0)) == 1
    assert decode.decode(position_delta(), 0.015) == []
    assert len(decode.decode(position_delta(), 0.1)) == 1  # the same value again is how a stuck DVL looks
    assert len(decode.decode(position_delta(delta=(0.06, 0.0, 0.0)), 0.11)) == 1
    assert decode.drops == {"repeated": 1}


def test_a_second_route_to_a_sender_with_a_clock_gives_nothing_new():
    decode = decoder()
    frames = [position_delta(time_us=stamp) for stamp in (10**6, 10**6, 11 * 10**5)]
    assert [one.boot_s for frame in frames for one in decode.decode(frame, 0.0)] == [1.0, 1.1]


# Attitude as a quaternion --------------------------------------------------------------------------


@given(st.tuples(*[st.floats(-1, 1)] * 4), st.tuples(*[FLOAT32] * 3))
def test_attitude_quaternion(quaternion, rates):
    length = math.hypot(*quaternion)
    assume(length > 0.01)
    data = Peer().pack(generated("ATTITUDE_QUATERNION", 5000, *(part / length for part in quaternion), *rates))
    (sent,) = messages_in(data)
    decode = decoder()
    readings = decode.decode(data, 1.0)
    if not readings:
        assert decode.drops == {"implausible attitude": 1}
        assert not all(abs(rate) <= 100 for rate in rates)
        return
    (one,) = readings
    assert isinstance(one, Attitude)
    turned = Rotation.from_euler("ZYX", [one.yaw_rad, one.pitch_rad, one.roll_rad])
    wanted = Rotation.from_quat([sent.q2, sent.q3, sent.q4, sent.q1])
    assert (turned * wanted.inv()).magnitude() < 2e-3  # near straight up, the arcsine of a 32-bit float
    assert (one.roll_rate_radps, one.boot_s) == (sent.rollspeed, 5.0)


def test_a_quaternion_of_another_length_is_none():
    decode = decoder()
    for parts in [(0, 0, 0, 0), (1, 1, 0, 0), (math.nan, 0, 0, 0)]:
        assert decode.decode(Peer().pack(generated("ATTITUDE_QUATERNION", 0, *parts, 0, 0, 0)), 1.0) == []
    assert decode.drops == {"implausible attitude": 3}


def test_the_quaternion_stands_in_where_angles_do_not_come():
    decode, peer = decoder(), Peer()

    def quaternion(boot_ms):
        return peer.pack(generated("ATTITUDE_QUATERNION", boot_ms, 1, 0, 0, 0, 0, 0, 0))

    assert len(decode.decode(quaternion(100), 0.1)) == 1
    assert len(decode.decode(peer.attitude(boot_ms=200), 0.2)) == 1
    assert decode.decode(quaternion(300), 0.3) == []
    assert len(decode.decode(quaternion(2300), 2.3)) == 1
