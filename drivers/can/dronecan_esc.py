"""Payloads of the DroneCAN ESC messages: bits to frozen values and back.

Source: DSDL definitions uavcan.equipment.esc.RawCommand (1030) and uavcan.equipment.esc.Status (1034). Of a field
the least significant byte goes first, and of each byte the most significant bit; a last byte that is not full carries
the field's highest bits. An array that ends a message has no length field (tail array optimisation).
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence
from dataclasses import dataclass

from drivers.can.dronecan_transfer import DataType, split
from drivers.can.frame import CanFrame

COMMAND_BITS = 14
COMMAND_MIN = -8192
COMMAND_MAX = 8191
COMMANDS_MAX = 20
ESC_INDEX_MAX = 31
SPEED_BITS = 18
SPEED_MAX_RPM = (1 << SPEED_BITS - 1) - 1

COMMAND_PRIORITY = 7
STATUS_PRIORITY = 16

RAW_COMMAND = DataType(1030, 0x217F5C87D7EC951D, (COMMANDS_MAX * COMMAND_BITS + 7) // 8)
ESC_STATUS = DataType(1034, 0xA9AF28AEA2FBB254, 14)

_STATUS = struct.Struct(
    "<IeeeHBB"
)  # the last four bytes hold rpm (18 bits), power (7), index (5) and 2 bits of padding


@dataclass(frozen=True, slots=True)
class EscStatus:
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


def pack_commands(commands: Sequence[int]) -> bytes:
    """Serialise esc.RawCommand.

    Args:
        commands: up to 20 of -8192..8191, by ESC index.

    Raises:
        ValueError: too many, or out of range.
    """
    if len(commands) > COMMANDS_MAX:
        raise ValueError(f"commands must be at most {COMMANDS_MAX}, got {len(commands)}")
    bits = 0
    for command in commands:
        if not COMMAND_MIN <= command <= COMMAND_MAX:
            raise ValueError(f"each command must lie in {COMMAND_MIN}..{COMMAND_MAX}, got {command}")
        bits = bits << COMMAND_BITS | (command & 0xFF) << 6 | command >> 8 & 0x3F
    padding = -len(commands) * COMMAND_BITS % 8
    return (bits << padding).to_bytes((len(commands) * COMMAND_BITS + padding) // 8, "big")


def unpack_commands(payload: bytes) -> list[int] | None:
    """Commands by ESC index, -8192..8191; None where no number of commands has this length."""
    count, padding = divmod(len(payload) * 8, COMMAND_BITS)
    if count > COMMANDS_MAX or padding >= 8:
        return None
    bits = int.from_bytes(payload, "big") >> padding
    return [_command(bits >> shift) for shift in range((count - 1) * COMMAND_BITS, -1, -COMMAND_BITS)]


def _command(bits: int) -> int:
    value = (bits & 0x3F) << 8 | bits >> 6 & 0xFF
    return value - 0x4000 if value & 0x2000 else value


def pack_status(status: EscStatus) -> bytes:
    """Serialise esc.Status.

    Raises:
        ValueError: a field that does not fit the wire; a float beyond half precision goes out as infinity.
    """
    _check_range("error_count", status.error_count, 0, 0xFFFF_FFFF)
    _check_range("speed_rpm", status.speed_rpm, -SPEED_MAX_RPM - 1, SPEED_MAX_RPM)
    _check_range("power_percent", status.power_percent, 0, 127)
    _check_range("esc_index", status.esc_index, 0, ESC_INDEX_MAX)
    return _STATUS.pack(
        status.error_count,
        _half(status.voltage_v),
        _half(status.current_a),
        _half(status.temperature_k),
        status.speed_rpm & 0xFFFF,
        (status.speed_rpm >> 16 & 0b11) << 6 | status.power_percent >> 1,
        (status.power_percent & 1) << 7 | status.esc_index << 2,
    )


def _check_range(name: str, value: int, lowest: int, highest: int) -> None:
    if not lowest <= value <= highest:
        raise ValueError(f"{name} must lie in {lowest}..{highest}, got {value}")


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


def encode_raw_command(
    commands: Sequence[int],
    source_node: int,
    transfer_id: int,
    *,
    time_s: float = 0.0,
    priority: int = COMMAND_PRIORITY,
) -> list[CanFrame]:
    """Frames of one uavcan.equipment.esc.RawCommand.

    Args:
        commands: up to 20 of -8192..8191, by ESC index.
        source_node: 1..127.
        transfer_id: counts up from call to call.
        time_s: stamp of the frames.
        priority: 0 (first on the bus) .. 31.

    Raises:
        ValueError: an argument out of range.
    """
    return split(
        RAW_COMMAND,
        pack_commands(commands),
        source_node=source_node,
        transfer_id=transfer_id,
        priority=priority,
        time_s=time_s,
    )


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
