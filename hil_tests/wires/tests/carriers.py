"""Messages that carry each signal, written and read by pymavlink alone: an independent view of what a wire does."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import asin, cos, degrees, isnan, radians, remainder, sin

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from drivers.mavlink.tests.peer import EscStatusMessage
from hil_tests.scenario.failures import Target

G = 9.80665
FIRST_LATITUDE, FIRST_LONGITUDE = 437_000_000, 73_000_000
METRES_PER_DEGREE = radians(6_371_000.0)
PA_PER_M = 1025.0 * G
ESC_STATUS_ID = 291


@dataclass(frozen=True)
class Carrier:
    """A message with a signal in it.

    Attributes:
        target: whose signal.
        make: message at a time, in seconds, with a value.
        read: the value in a message; None: it says that there is none.
        value: true one at a time.
        close: within which it is told.
        silent: how the message says that nothing came; "withheld": it is not sent.
    """

    name: str
    target: Target
    make: Callable
    read: Callable
    value: Callable
    close: float
    silent: str = "withheld"


def boot_ms(time_s):
    return round(1000.0 * (time_s + 10.0))


def boot_us(time_s):
    return 1000 * boot_ms(time_s)


def velocity(time_s):
    return 1.0 + 0.1 * sin(time_s), 0.2 * cos(time_s), -0.1


def heading(time_s):
    return (170.0 + 5.0 * time_s + 180.0) % 360.0 - 180.0


def place(time_s):
    return 0.5 * time_s, -0.2 * time_s


def position_delta(time_s, value):
    deltas = [0.1 * one for one in value]
    return mavlink.MAVLink_vision_position_delta_message(0, 100_000, [0.0, 0.0, 0.01], deltas, 100.0)


def odometry(time_s, value, estimator=0, child_frame=12):
    return mavlink.MAVLink_odometry_message(
        boot_us(time_s), 20, child_frame, 1.0, 2.0, 3.0, [1.0, 0.0, 0.0, 0.0], *value, 0.1, 0.2, 0.3,
        [float("nan")] * 21, [0.01] * 21, 0, estimator, 90,
    )  # fmt: skip


def counts(message, time_stamp, forces, rates):
    milli = [int(1000.0 * force / G) for force in forces] + [int(1000.0 * rate) for rate in rates]
    return message(time_stamp, *milli, 1, 2, 3)


def forces(time_s):
    return 0.5 * sin(time_s), 0.4, -9.8


def rates(time_s):
    return 0.1 * sin(time_s), 0.02, 0.3


def highres(time_s, forces, rates):
    return mavlink.MAVLink_highres_imu_message(
        boot_us(time_s), *forces, *rates, 0.1, 0.2, 0.3, 1013.0, 0.0, 5.0, 20.0, 63
    )


def forces_of(message):
    return tuple(one * G / 1000.0 for one in (message.xacc, message.yacc, message.zacc))


def rates_of(message):
    return tuple(one / 1000.0 for one in (message.xgyro, message.ygyro, message.zgyro))


def attitude(time_s, value):
    return mavlink.MAVLink_attitude_message(boot_ms(time_s), 0.1, -0.2, radians(value[0]), 0.01, 0.02, 0.03)


def quaternion(time_s, value):
    """Yaw, then pitch of 0.3, roll 0."""
    half, pitched = radians(value[0]) / 2.0, 0.15
    parts = cos(half) * cos(pitched), -sin(half) * sin(pitched), cos(half) * sin(pitched), sin(half) * cos(pitched)
    return mavlink.MAVLink_attitude_quaternion_message(boot_ms(time_s), *parts, 0.01, 0.02, 0.03)


def yaw_of_quaternion(message):
    w, x, y, z = message.q1, message.q2, message.q3, message.q4
    pitch = asin(2.0 * (w * y - z * x))
    assert abs(pitch - 0.3) < 1e-6  # only the heading is changed
    forward = w * w + x * x - y * y - z * z, 2.0 * (w * z + x * y)
    turned = degrees(asin(max(-1.0, min(forward[1] / cos(pitch), 1.0))))
    return (turned if forward[0] >= 0.0 else 180.0 - turned if turned >= 0.0 else -180.0 - turned,)


def global_position(time_s, *, north_m=0.0, east_m=0.0, altitude_mm=-5000, heading_cdeg=100):
    latitude = FIRST_LATITUDE + round(1e7 * north_m / METRES_PER_DEGREE)
    longitude = FIRST_LONGITUDE + round(1e7 * east_m / METRES_PER_DEGREE / cos(radians(FIRST_LATITUDE * 1e-7)))
    return mavlink.MAVLink_global_position_int_message(
        boot_ms(time_s), latitude, longitude, altitude_mm, altitude_mm, 1, 2, 3, heading_cdeg
    )


def place_of(message):
    north = (message.lat - FIRST_LATITUDE) * 1e-7 * METRES_PER_DEGREE
    return north, (message.lon - FIRST_LONGITUDE) * 1e-7 * METRES_PER_DEGREE * cos(radians(FIRST_LATITUDE * 1e-7))


def gps_raw(time_s, value):
    fix = global_position(time_s, north_m=value[0], east_m=value[1])
    return mavlink.MAVLink_gps_raw_int_message(boot_us(time_s), 3, fix.lat, fix.lon, -5000, 100, 100, 0, 0, 12)


def gps_input(time_s, value):
    fix = global_position(time_s, north_m=value[0], east_m=value[1])
    return mavlink.MAVLink_gps_input_message(
        boot_us(time_s), 0, 0, 0, 0, 3, fix.lat, fix.lon, -5.0, 1.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.8, 1.0, 12
    )


def pressure(message):
    return lambda time_s, value: message(boot_ms(time_s), 1013.25 + value[0] * PA_PER_M / 100.0, 0.5, 1200)


def depth_of(message):
    return ((message.press_abs - 1013.25) * 100.0 / PA_PER_M,)


def esc_telemetry(time_s, value):
    """The third of the second four, beside others."""
    return mavlink.MAVLink_esc_telemetry_5_to_8_message(
        [20] * 4, [1600] * 4, [150] * 4, [0] * 4, [500, 600, round(abs(value[0])), 700], [round(20 * time_s) + 1] * 4
    )


def esc_status(time_s, value):
    return EscStatusMessage(4, boot_us(time_s), (500, -600, round(value[0]), 700), [16.0] * 4, [1.5] * 4)


def servo_output(time_s, value, port=0):
    """Channel 9, behind the port."""
    pulses = [1100, 1200, 1300, 1400, 1500, 1600, 1700, 1800, round(1500 + 400 * value[0]), 1900]
    return mavlink.MAVLink_servo_output_raw_message(boot_us(time_s) % 2**32, port, *pulses)


def fraction_of(pulse_us):
    return None if pulse_us == 0 or isnan(pulse_us) else ((pulse_us - 1500.0) / 400.0,)


def actuator_output(time_s, value):
    outputs = [1100.0, 1500.0 + 400.0 * value[0], 1300.0] + [0.0] * 29
    return mavlink.MAVLink_actuator_output_status_message(boot_us(time_s), 3, outputs)


CARRIERS = (
    Carrier(
        "VISION_POSITION_DELTA", Target.DVL, position_delta,
        lambda message: tuple(10.0 * one for one in message.position_delta), velocity, 1e-5,
    ),
    Carrier("ODOMETRY", Target.DVL, odometry, lambda message: (message.vx, message.vy, message.vz), velocity, 1e-5),
    *(
        Carrier(
            name, Target.ACCELEROMETER,
            lambda time_s, value, message=message, stamp=stamp: counts(message, stamp(time_s), value, rates(time_s)),
            forces_of, forces, 0.02,
        )
        for name, message, stamp in (
            ("RAW_IMU", mavlink.MAVLink_raw_imu_message, boot_us),
            ("SCALED_IMU2", mavlink.MAVLink_scaled_imu2_message, boot_ms),
        )
    ),
    Carrier(
        "HIGHRES_IMU", Target.ACCELEROMETER, lambda time_s, value: highres(time_s, value, rates(time_s)),
        lambda message: (message.xacc, message.yacc, message.zacc), forces, 1e-5,
    ),
    Carrier(
        "RAW_IMU rates", Target.GYROSCOPE,
        lambda time_s, value: counts(mavlink.MAVLink_raw_imu_message, boot_us(time_s), forces(time_s), value),
        rates_of, rates, 0.002,
    ),
    Carrier(
        "HIGHRES_IMU rates", Target.GYROSCOPE, lambda time_s, value: highres(time_s, forces(time_s), value),
        lambda message: (message.xgyro, message.ygyro, message.zgyro), rates, 1e-5,
    ),
    Carrier(
        "ATTITUDE", Target.HEADING, attitude, lambda message: (degrees(message.yaw),),
        lambda time_s: (heading(time_s),), 1e-4,
    ),
    Carrier(
        "ATTITUDE_QUATERNION", Target.HEADING, quaternion, yaw_of_quaternion,
        lambda time_s: (heading(time_s),), 1e-2,
    ),
    Carrier(
        "GLOBAL_POSITION_INT heading", Target.HEADING,
        lambda time_s, value: global_position(time_s, heading_cdeg=round(100.0 * value[0]) % 36_000),
        lambda message: None if message.hdg == 65_535 else (remainder(message.hdg / 100.0, 360.0),),
        lambda time_s: (heading(time_s),), 0.011, "unknown",
    ),
    Carrier(
        "LOCAL_POSITION_NED", Target.POSITION,
        lambda time_s, value: mavlink.MAVLink_local_position_ned_message(boot_ms(time_s), *value, 5.0, 0.1, 0.2, 0.3),
        lambda message: (message.x, message.y), place, 1e-5,
    ),
    Carrier(
        "GLOBAL_POSITION_INT", Target.POSITION,
        lambda time_s, value: global_position(time_s, north_m=value[0], east_m=value[1]), place_of, place, 0.02,
    ),
    Carrier("GPS_RAW_INT", Target.POSITION, gps_raw, place_of, place, 0.02),
    Carrier("GPS_INPUT", Target.POSITION, gps_input, place_of, place, 0.02),
    *(
        Carrier(name, Target.DEPTH, pressure(message), depth_of, lambda time_s: (5.0 + sin(time_s),), 1e-3)
        for name, message in (
            ("SCALED_PRESSURE2", mavlink.MAVLink_scaled_pressure2_message),
            ("SCALED_PRESSURE3", mavlink.MAVLink_scaled_pressure3_message),
        )
    ),
    Carrier(
        "GLOBAL_POSITION_INT altitude", Target.DEPTH,
        lambda time_s, value: global_position(time_s, altitude_mm=round(-1000.0 * value[0])),
        lambda message: (-message.alt / 1000.0,), lambda time_s: (5.0 + sin(time_s),), 1e-3,
    ),
    Carrier(
        "ESC_TELEMETRY_5_TO_8", Target.RPM, esc_telemetry, lambda message: (float(message.rpm[2]),),
        lambda time_s: (float(round(1000.0 + 100.0 * sin(time_s))),), 1.0, "repeated",
    ),
    Carrier(
        "RPM", Target.RPM, lambda time_s, value: mavlink.MAVLink_rpm_message(500.0, abs(value[0])),
        lambda message: None if message.rpm2 < 0.0 else (message.rpm2,),
        lambda time_s: (1000.0 + 100.0 * sin(time_s),), 0.01, "unknown",
    ),
    Carrier(
        "SERVO_OUTPUT_RAW", Target.COMMAND, servo_output, lambda message: fraction_of(message.servo9_raw),
        lambda time_s: (round(400.0 * (0.4 + 0.2 * sin(time_s))) / 400.0,), 0.00126, "unknown",
    ),
    Carrier(
        "ACTUATOR_OUTPUT_STATUS", Target.COMMAND, actuator_output, lambda message: fraction_of(message.actuator[1]),
        lambda time_s: (0.4 + 0.2 * sin(time_s),), 1e-5, "unknown",
    ),
)  # fmt: skip
