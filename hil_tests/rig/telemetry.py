"""The messages by which an autopilot tells what it knows of the vehicle."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from math import degrees
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mavlink

from hil_tests.rig.commander import Commander
from hil_tests.rig.esc_messages import ESC_INFO_ID, ESC_STATUS_ID, ESCS_PER_MESSAGE, EscReport, esc_info, esc_status
from hil_tests.rig.geodesy import degrees_e7
from hil_tests.rig.instruments import Instruments
from hil_tests.rig.kinematics import attitude_rad, body_rates
from hil_tests.rig.vehicle import Motion

NEUTRAL_US, HALF_RANGE_US = 1500, 400


@dataclass(frozen=True, slots=True)
class Telemetry:
    """What the autopilot knows of the vehicle at one instant; `motion` is its estimate of it.

    Attributes:
        boot_s: its own time.
        motion: where it takes the vehicle to be.
        commands: to the thrusters.
        instruments: the sensors that it reads; None: none of which it tells.
        escs: what its ESCs report, in their order; empty: they report nothing.
    """

    boot_s: float
    motion: Motion
    commands: Sequence[float]
    instruments: Instruments | None = None
    escs: Sequence[EscReport] = ()


def _heartbeat(_: Telemetry, commander: Commander) -> Any:
    base_mode = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | mavlink.MAV_MODE_FLAG_MANUAL_INPUT_ENABLED
    if commander.armed:
        base_mode |= mavlink.MAV_MODE_FLAG_SAFETY_ARMED
    return mavlink.MAVLink_heartbeat_message(
        commander.vehicle_type, commander.autopilot, base_mode, commander.custom_mode, commander.system_status, 3
    )


def _attitude(now: Telemetry, _: Commander) -> Any:
    motion = now.motion
    rates = body_rates(attitude_rad(motion), (motion.roll_rate_radps, motion.pitch_rate_radps, motion.yaw_rate_radps))
    return mavlink.MAVLink_attitude_message(_boot_ms(now), *attitude_rad(motion), *rates)


def _global_position(now: Telemetry, _: Commander) -> Any:
    motion = now.motion
    altitude_mm = round(-1e3 * motion.down_m)
    velocity_cmps = [round(1e2 * velocity) for velocity in motion.velocity_ned_mps()]
    return mavlink.MAVLink_global_position_int_message(
        _boot_ms(now), *degrees_e7(motion.north_m, motion.east_m), altitude_mm, altitude_mm, *velocity_cmps,
        round(100.0 * degrees(motion.yaw_rad)) % 36000,
    )  # fmt: skip


def _local_position(now: Telemetry, _: Commander) -> Any:
    motion = now.motion
    place = motion.north_m, motion.east_m, motion.down_m
    return mavlink.MAVLink_local_position_ned_message(_boot_ms(now), *place, *motion.velocity_ned_mps())


def _servo_output(now: Telemetry, _: Commander) -> Any:
    pulses_us = [round(NEUTRAL_US + HALF_RANGE_US * command) for command in now.commands]
    first_eight = (pulses_us + [0] * 8)[:8]  # 0: channel not in use
    return mavlink.MAVLink_servo_output_raw_message(_boot_ms(now) * 1000 % 2**32, 0, *first_eight)


def _raw_imu(now: Telemetry, _: Commander) -> Any | None:
    return now.instruments and now.instruments.raw_imu(now.boot_s)


def _highres_imu(now: Telemetry, _: Commander) -> Any | None:
    return now.instruments and now.instruments.highres_imu(now.boot_s)


def _scaled_pressure2(now: Telemetry, _: Commander) -> Any | None:
    return now.instruments and now.instruments.scaled_pressure2(now.boot_s)


def _version(_: Telemetry, __: Commander) -> Any:
    capabilities = mavlink.MAV_PROTOCOL_CAPABILITY_MAVLINK2 | mavlink.MAV_PROTOCOL_CAPABILITY_COMMAND_INT
    release = 4 << 24 | 7 << 16
    return mavlink.MAVLink_autopilot_version_message(
        capabilities, release, 0, 0, 0, [0] * 8, [0] * 8, [0] * 8, 0, 0, 0
    )


def _system_time(now: Telemetry, _: Commander) -> Any:
    return mavlink.MAVLink_system_time_message(0, _boot_ms(now))  # no GPS under water: it knows no date


def _boot_ms(now: Telemetry) -> int:
    return round(1e3 * now.boot_s)


Composer = Callable[[Telemetry, Commander], Any]

# A composer that returns None has nothing to tell now.
COMPOSERS: dict[int, Composer] = {
    mavlink.MAVLINK_MSG_ID_HEARTBEAT: _heartbeat,
    mavlink.MAVLINK_MSG_ID_ATTITUDE: _attitude,
    mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT: _global_position,
    mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED: _local_position,
    mavlink.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW: _servo_output,
    mavlink.MAVLINK_MSG_ID_RAW_IMU: _raw_imu,
    mavlink.MAVLINK_MSG_ID_HIGHRES_IMU: _highres_imu,
    mavlink.MAVLINK_MSG_ID_SCALED_PRESSURE2: _scaled_pressure2,
    mavlink.MAVLINK_MSG_ID_SYSTEM_TIME: _system_time,
    mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION: _version,
}
# Messages that come in several at once, one for each four ESCs.
ESC_COMPOSERS = {ESC_STATUS_ID: esc_status, ESC_INFO_ID: esc_info}


def compose(message_id: int, now: Telemetry, commander: Commander) -> Iterator[Any]:
    """All that there is to tell now under a message id: messages of pymavlink."""
    if message_id in ESC_COMPOSERS:
        for first in range(0, len(now.escs), ESCS_PER_MESSAGE):
            yield ESC_COMPOSERS[message_id](now.boot_s, now.escs, first)
    elif (message := COMPOSERS[message_id](now, commander)) is not None:
        yield message
