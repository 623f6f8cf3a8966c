"""What an autopilot's own log says of the vehicle, as the messages in which it would have told it over a link.

Only what was logged is told, and as exactly as the message can: ArduPilot's inertial units in whole thousandths, as
it sends them, altitudes in millimetres. Which reading becomes which message stands in `TOLD_AS`. Nothing is made of
what a log has beside that: batteries, parameters, texts.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from math import degrees
from typing import Any, TypeAlias

from drivers.mavlink import formats
from drivers.mavlink.formats import MessageFormat
from drivers.mavlink.inertial import CELSIUS_ZERO_K, FORCE_AND_RATE_UPDATED, SATURATED, STANDARD_GRAVITY_MPS2
from drivers.mavlink.vehicle import MODE_FLAG_ARMED
from drivers.readings import (
    Attitude,
    AutopilotHeartbeat,
    GlobalPosition,
    Inertial,
    LocalPosition,
    PositionFix,
    Reading,
    WaterPressure,
)

CUSTOM_MODE_ENABLED = 1  # MAV_MODE_FLAG
MAVLINK_VERSION = 3
FIX_3D = 3  # GPS_FIX_TYPE
UINT16_UNKNOWN, UINT8_UNKNOWN = 0xFFFF, 0xFF
UINT32_MASK = 0xFFFF_FFFF
SCALED_UNITS = dict(zip(("SCALED_IMU", "SCALED_IMU2", "SCALED_IMU3"), formats.SCALED_IMUS, strict=True))

Told: TypeAlias = tuple[MessageFormat, tuple[Any, ...]]  # a message, and its fields in wire order


def told(reading: Reading, boot_s: float) -> Told | None:
    """The message that tells a reading; None where there is none.

    Args:
        reading: of a log.
        boot_s: when that was, since the autopilot's start.
    """
    tell = TOLD_AS.get(type(reading))
    return None if tell is None else tell(reading, boot_s)


def _heartbeat(beat: AutopilotHeartbeat, _: float) -> Told:
    base_mode = CUSTOM_MODE_ENABLED | (MODE_FLAG_ARMED if beat.armed else 0)
    state = beat.vehicle_type, beat.autopilot, base_mode, beat.system_status
    return formats.HEARTBEAT, (beat.custom_mode, *state, MAVLINK_VERSION)


def _attitude(attitude: Attitude, boot_s: float) -> Told:
    angles = attitude.roll_rad, attitude.pitch_rad, attitude.yaw_rad
    rates = attitude.roll_rate_radps, attitude.pitch_rate_radps, attitude.yaw_rate_radps
    return formats.ATTITUDE, (_milliseconds(boot_s), *angles, *rates)


def _local_position(local: LocalPosition, boot_s: float) -> Told:
    return formats.LOCAL_POSITION_NED, (_milliseconds(boot_s), *local.position_m, *local.velocity_mps)


def _global_position(position: GlobalPosition, boot_s: float) -> Told:
    altitude_mm = round(-1e3 * position.depth_m)
    velocity_cmps = (_int16(1e2 * component) for component in position.velocity_mps)
    place = _degrees_e7(position.latitude_rad), _degrees_e7(position.longitude_rad)
    fields = *place, altitude_mm, altitude_mm, *velocity_cmps, UINT16_UNKNOWN
    return formats.GLOBAL_POSITION_INT, (_milliseconds(boot_s), *fields)


def _fix(fix: PositionFix, boot_s: float) -> Told:
    place = _degrees_e7(fix.latitude_rad), _degrees_e7(fix.longitude_rad), round(-1e3 * (fix.depth_m or 0.0))
    unknown = UINT16_UNKNOWN, UINT16_UNKNOWN, UINT16_UNKNOWN, UINT16_UNKNOWN
    return formats.GPS_RAW_INT, (_microseconds(boot_s), *place, *unknown, FIX_3D, UINT8_UNKNOWN, 0, 0, 0, 0, 0, 0)


def _inertial(felt: Inertial, boot_s: float) -> Told | None:
    if felt.source == "HIGHRES_IMU":
        vectors = *felt.specific_force_mps2, *felt.angular_rate_radps
        return formats.HIGHRES_IMU, (_microseconds(boot_s), *vectors, *(0.0,) * 7, FORCE_AND_RATE_UPDATED, 0)
    forces = (_thousandths(part / STANDARD_GRAVITY_MPS2) for part in felt.specific_force_mps2)
    counts = *forces, *map(_thousandths, felt.angular_rate_radps)
    if felt.source == "RAW_IMU":
        return formats.RAW_IMU, (_microseconds(boot_s), *counts, 0, 0, 0, 0, 0)
    scaled = SCALED_UNITS.get(felt.source)
    return None if scaled is None else (scaled, (_milliseconds(boot_s), *counts, 0, 0, 0, 0))


def _pressure(water: WaterPressure, boot_s: float) -> Told:
    celsius = 0.0 if water.temperature_k is None else water.temperature_k - CELSIUS_ZERO_K
    message = formats.SCALED_PRESSURES[water.instance - 1]
    return message, (_milliseconds(boot_s), 1e-2 * water.pressure_pa, 0.0, _int16(1e2 * celsius), 0)


# Velocities of a DVL are told by others than the autopilot: see `autopilot_log`.
TOLD_AS: Mapping[type[Any], Callable[[Any, float], Told | None]] = {
    AutopilotHeartbeat: _heartbeat,
    Attitude: _attitude,
    LocalPosition: _local_position,
    GlobalPosition: _global_position,
    PositionFix: _fix,
    Inertial: _inertial,
    WaterPressure: _pressure,
}


def _milliseconds(boot_s: float) -> int:
    return round(1e3 * boot_s) & UINT32_MASK


def _microseconds(boot_s: float) -> int:
    return max(round(1e6 * boot_s), 0)


def _degrees_e7(angle_rad: float) -> int:
    return round(1e7 * degrees(angle_rad))


def _int16(value: float) -> int:
    return max(-SATURATED, min(SATURATED, round(value)))


def _thousandths(value: float) -> int:
    """Cut off towards zero, as autopilots do, and never the number that stands for too much."""
    return max(1 - SATURATED, min(SATURATED - 1, int(1e3 * value)))
