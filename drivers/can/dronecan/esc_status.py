"""What ESCs say of themselves: bits to frozen values and back.

Source: DSDL definitions uavcan.equipment.esc.Status (1034) and StatusExtended (1036); bits as in
`drivers.can.dronecan.bits`.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from drivers.can.dronecan.bits import signed, word_of
from drivers.can.dronecan.transfer import DataType, check_range, split
from drivers.can.frame import CanFrame

ESC_INDEX_MAX = 31
SPEED_BITS = 18
SPEED_MAX_RPM = (1 << SPEED_BITS - 1) - 1

STATUS_PRIORITY = 16

ESC_STATUS = DataType(1034, 0xA9AF28AEA2FBB254, 14)
STATUS_EXTENDED = DataType(1036, 0x02DC203C50960EDC, 7)

# the last four bytes hold rpm (18 bits), power (7), index (5) and 2 bits of padding
_STATUS = struct.Struct("<IeeeHBB")
STATUS_DTYPE = np.dtype(
    [
        ("error_count", "<u4"),
        ("voltage_v", "<f2"),
        ("current_a", "<f2"),
        ("temperature_k", "<f2"),
        ("low", "<u2"),
        ("middle", "u1"),
        ("high", "u1"),
    ]
)


class EscStatus(NamedTuple):
    """uavcan.equipment.esc.Status as it is on the wire: NaN = unknown.

    Attributes:
        error_count: resets when the motor restarts.
        voltage_v, current_a, temperature_k: half precision.
        speed_rpm: -131072..131071, negative in reverse.
        power_percent: 0..127.
        esc_index: 0..31.
    """

    error_count: int
    voltage_v: float
    current_a: float
    temperature_k: float
    speed_rpm: int
    power_percent: int
    esc_index: int


def pack_status(status: EscStatus) -> bytes:
    """Serialise esc.Status.

    Raises:
        ValueError: a field that does not fit the wire; a float beyond half precision goes out as infinity.
    """
    check_range("error_count", status.error_count, 0, 0xFFFF_FFFF)
    check_range("speed_rpm", status.speed_rpm, -SPEED_MAX_RPM - 1, SPEED_MAX_RPM)
    check_range("power_percent", status.power_percent, 0, 127)
    check_range("esc_index", status.esc_index, 0, ESC_INDEX_MAX)
    return _STATUS.pack(
        status.error_count,
        _half(status.voltage_v),
        _half(status.current_a),
        _half(status.temperature_k),
        status.speed_rpm & 0xFFFF,
        (status.speed_rpm >> 16 & 0b11) << 6 | status.power_percent >> 1,
        (status.power_percent & 1) << 7 | status.esc_index << 2,
    )


def _half(value: float) -> float:
    # IEEE 754 rounds 65520 and more to infinity, where struct raises OverflowError.
    return math.copysign(math.inf, value) if abs(value) >= 65520.0 else value


def unpack_status(payload: bytes) -> EscStatus | None:
    """Fields of esc.Status; None where the length is wrong."""
    if len(payload) != _STATUS.size:
        return None
    error_count, voltage_v, current_a, temperature_k, low, middle, high = _STATUS.unpack(payload)
    speed_rpm = low | (middle >> 6) << 16
    if speed_rpm > SPEED_MAX_RPM:
        speed_rpm -= 1 << SPEED_BITS
    power_percent = (middle & 0x3F) << 1 | high >> 7
    return EscStatus(error_count, voltage_v, current_a, temperature_k, speed_rpm, power_percent, high >> 2 & 0x1F)


def encode_esc_status(
    status: EscStatus, source_node: int, transfer_id: int, *, time_s: float = 0.0, priority: int = STATUS_PRIORITY
) -> list[CanFrame]:
    """Frames of one uavcan.equipment.esc.Status.

    Args:
        status: what the ESC says.
        source_node: 1..127.
        transfer_id: counts up from call to call.
        time_s: stamp of the frames.
        priority: 0 (first on the bus) .. 31.

    Raises:
        ValueError: an argument out of range.
    """
    return split(
        ESC_STATUS,
        pack_status(status),
        source_node=source_node,
        transfer_id=transfer_id,
        priority=priority,
        time_s=time_s,
    )


@dataclass(frozen=True, slots=True)
class EscStatusExtended:
    """uavcan.equipment.esc.StatusExtended.

    Attributes:
        input_percent, output_percent: 0..127; command as it came, and as it goes to the motor.
        motor_temperature_c: -256..255.
        motor_angle_deg: 0..511.
        status_flags: 19 bits, the maker's own.
        esc_index: 0..31.
    """

    input_percent: int
    output_percent: int
    motor_temperature_c: int
    motor_angle_deg: int
    status_flags: int
    esc_index: int


# fields of StatusExtended in their order, and their bits
_EXTENDED = (7, 7, 9, 9, 19, 5)


def pack_status_extended(status: EscStatusExtended) -> bytes:
    """Serialise esc.StatusExtended.

    Raises:
        ValueError: a field that does not fit the wire.
    """
    check_range("input_percent", status.input_percent, 0, 127)
    check_range("output_percent", status.output_percent, 0, 127)
    check_range("motor_temperature_c", status.motor_temperature_c, -256, 255)
    check_range("motor_angle_deg", status.motor_angle_deg, 0, 511)
    check_range("status_flags", status.status_flags, 0, 0x7FFFF)
    check_range("esc_index", status.esc_index, 0, ESC_INDEX_MAX)
    values = (
        status.input_percent,
        status.output_percent,
        status.motor_temperature_c,
        status.motor_angle_deg,
        status.status_flags,
        status.esc_index,
    )
    packed = 0
    for value, bits in zip(values, _EXTENDED, strict=True):
        packed = packed << bits | word_of(value, bits)
    return packed.to_bytes(STATUS_EXTENDED.payload_max, "big")


def unpack_status_extended(payload: bytes) -> EscStatusExtended | None:
    """Fields of esc.StatusExtended; None where the length is wrong."""
    if len(payload) != STATUS_EXTENDED.payload_max:
        return None
    # where 7, 7, 9, 9, 19 and 5 bits lie, of each number the low byte first
    a, b, c, d, e, f, g = payload
    return EscStatusExtended(
        input_percent=a >> 1,
        output_percent=(a & 1) << 6 | b >> 2,
        motor_temperature_c=signed((c >> 1 & 1) << 8 | (b & 0b11) << 6 | c >> 2, 9),
        motor_angle_deg=(d & 1) << 8 | (c & 1) << 7 | d >> 1,
        status_flags=(g >> 5) << 16 | f << 8 | e,
        esc_index=g & 0x1F,
    )


def encode_status_extended(
    status: EscStatusExtended,
    source_node: int,
    transfer_id: int,
    *,
    time_s: float = 0.0,
    priority: int = STATUS_PRIORITY,
) -> list[CanFrame]:
    """The frame of one uavcan.equipment.esc.StatusExtended; arguments as for `encode_esc_status`.

    Raises:
        ValueError: an argument out of range.
    """
    return split(
        STATUS_EXTENDED,
        pack_status_extended(status),
        source_node=source_node,
        transfer_id=transfer_id,
        priority=priority,
        time_s=time_s,
    )
