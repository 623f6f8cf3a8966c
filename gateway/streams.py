"""Which messages the autopilot is asked for: those that this configuration reads, and no others.

A link to an autopilot is often a serial line, shared with the pilot's own telemetry. What is not asked for still
comes, and is read, as often as the autopilot sends it anyway.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from drivers.mavlink import formats
from drivers.mavlink.formats import MessageFormat
from drivers.mavlink.streams import AUTOPILOT_PX4, Stream
from gateway.config import Config
from gateway.config_sections import MAVLINK, Navigation, Speed, Thruster

# ArduSub's telemetry hardly gives more over a network; over a radio it gives less
INERTIAL_RATE_HZ, PRESSURE_RATE_HZ = 50.0, 10.0
THRUSTER_RATE_HZ, ATTITUDE_RATE_HZ, POSITION_RATE_HZ, FIX_RATE_HZ = 20.0, 20.0, 10.0, 5.0
SYSTEM_TIME_RATE_HZ, ESC_INFO_RATE_HZ = 1.0, 1.0

INERTIAL: Mapping[str, MessageFormat] = {
    "raw_imu": formats.RAW_IMU,
    "scaled_imu": formats.SCALED_IMUS[0],
    "scaled_imu2": formats.SCALED_IMUS[1],
    "scaled_imu3": formats.SCALED_IMUS[2],
    "highres_imu": formats.HIGHRES_IMU,
}
PRESSURES: Mapping[str, Sequence[MessageFormat]] = {
    "auto": formats.SCALED_PRESSURES[1:],
    "scaled_pressure": formats.SCALED_PRESSURES[:1],
    "scaled_pressure2": formats.SCALED_PRESSURES[1:2],
    "scaled_pressure3": formats.SCALED_PRESSURES[2:],
}


def streams(config: Config, autopilot: int) -> list[Stream]:
    """What an autopilot is asked for, each message once.

    Args:
        config: what is watched.
        autopilot: MAV_AUTOPILOT.
    """
    wanted = [
        *thruster_streams(config.thruster, autopilot),
        *(() if config.speed is None else speed_streams(config.speed)),
        *(() if config.navigation is None else navigation_streams(config.navigation, autopilot)),
        # always comes, and by its time since boot a restart is noticed
        Stream(formats.SYSTEM_TIME.message_id, SYSTEM_TIME_RATE_HZ),
    ]
    fastest: dict[int, Stream] = {}
    for one in wanted:
        known = fastest.get(one.message_id)
        fastest[one.message_id] = one if known is None or one.rate_hz > known.rate_hz else known
    return list(fastest.values())


def thruster_streams(thrusters: Sequence[Thruster], autopilot: int) -> Iterator[Stream]:
    """Commands and speeds of the thrusters that are read over MAVLink."""
    measured = [one.rpm for one in thrusters if one.rpm.link == MAVLINK]
    commands = [one.command for one in thrusters if one.command.link == MAVLINK]
    if any(command.servo_channel is not None for command in commands):
        yield Stream(formats.SERVO_OUTPUT_RAW.message_id, THRUSTER_RATE_HZ)
    if any(command.actuator is not None for command in commands):
        yield Stream(formats.ACTUATOR_OUTPUT_STATUS.message_id, THRUSTER_RATE_HZ)
    if any(rpm.rpm_sensor is not None for rpm in measured):
        yield Stream(formats.RPM.message_id, THRUSTER_RATE_HZ)
    if not any(rpm.esc_index is not None for rpm in measured):
        return
    if autopilot == AUTOPILOT_PX4:
        yield Stream(formats.ESC_STATUS.message_id, THRUSTER_RATE_HZ)
        yield Stream(formats.ESC_INFO.message_id, ESC_INFO_RATE_HZ)
    else:
        # the first of these messages brings all groups: asking ArduPilot for the others is DENIED
        yield Stream(formats.ESC_TELEMETRY[0].message_id, THRUSTER_RATE_HZ)


def speed_streams(speed: Speed) -> Iterator[Stream]:
    """Heading and positions of the watched kinds. The depth of a fix is that of the autopilot's global position."""
    yield Stream(formats.ATTITUDE.message_id, ATTITUDE_RATE_HZ)
    if speed.position in ("auto", "local") and speed.origin() is None:
        yield Stream(formats.LOCAL_POSITION_NED.message_id, POSITION_RATE_HZ)
    if speed.position != "local":
        yield Stream(formats.GLOBAL_POSITION_INT.message_id, POSITION_RATE_HZ)
    if speed.position in ("auto", "fix"):
        yield Stream(formats.GPS_RAW_INT.message_id, FIX_RATE_HZ)


def navigation_streams(navigation: Navigation, autopilot: int) -> Iterator[Stream]:
    """Inertial unit, pressure, attitude and the autopilot's position. A DVL's messages come unasked."""
    standard = "highres_imu" if autopilot == AUTOPILOT_PX4 else "raw_imu"
    imu = INERTIAL[standard if navigation.imu == "auto" else navigation.imu]
    yield Stream(imu.message_id, INERTIAL_RATE_HZ)
    for pressure in PRESSURES.get(navigation.depth, ()):
        yield Stream(pressure.message_id, PRESSURE_RATE_HZ)
    yield Stream(formats.ATTITUDE.message_id, ATTITUDE_RATE_HZ)
    if navigation.depth in ("auto", "global_position") or navigation.fix == "global_position":
        yield Stream(formats.GLOBAL_POSITION_INT.message_id, POSITION_RATE_HZ)
