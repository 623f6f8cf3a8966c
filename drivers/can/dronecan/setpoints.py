"""Messages that command ESCs: arrays of signed integers, one for each ESC, by ESC index.

Source: DSDL definitions uavcan.equipment.esc.RawCommand (1030, int14[<=20]) and RPMCommand (1031, int18[<=20]). An
array that ends a message has no length field (tail array optimisation).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from drivers.can.dronecan.bits import Integers, number_of, signed, word_of
from drivers.can.dronecan.transfer import DataType, split
from drivers.can.frame import CanFrame

SETPOINTS_MAX = 20
COMMAND_MAX = 8191
COMMAND_PRIORITY = 7
# three bytes hold any number of either width, wherever it begins in the first of them
_WINDOW_BITS = 24


@dataclass(frozen=True)
class Setpoints:
    """A message that is one array of integers. A `word` is a number in the order of its bits on the wire.

    Attributes:
        data_type: of the message.
        bits: of one number, 9 to 18.
    """

    data_type: DataType
    bits: int

    @property
    def minimum(self) -> int:
        """Least number."""
        return -(1 << self.bits - 1)

    @property
    def maximum(self) -> int:
        """Greatest number."""
        return (1 << self.bits - 1) - 1

    @cached_property
    def mask(self) -> int:
        """Of a word."""
        return (1 << self.bits) - 1

    @cached_property
    def counts(self) -> dict[int, int]:
        """How many numbers a payload of so many bytes has; any other length is wrong."""
        return {(count * self.bits + 7) // 8: count for count in range(SETPOINTS_MAX + 1)}

    def pack(self, numbers: Sequence[int]) -> bytes:
        """Serialise.

        Args:
            numbers: up to 20, by ESC index.

        Raises:
            ValueError: too many, or out of range.
        """
        if len(numbers) > SETPOINTS_MAX:
            raise ValueError(f"commands must be at most {SETPOINTS_MAX}, got {len(numbers)}")
        packed = 0
        for number in numbers:
            if not self.minimum <= number <= self.maximum:
                raise ValueError(f"each command must lie in {self.minimum}..{self.maximum}, got {number}")
            packed = packed << self.bits | word_of(number, self.bits)
        padding = -len(numbers) * self.bits % 8
        return (packed << padding).to_bytes((len(numbers) * self.bits + padding) // 8, "big")

    def unpack(self, payload: bytes) -> list[int] | None:
        """Numbers by ESC index; None where no count of numbers has this length."""
        words = self.words(payload)
        return None if words is None else [self.number(word) for word in words]

    def words(self, payload: bytes) -> list[int] | None:
        """Integers by ESC index; None where no count of numbers has this length."""
        count = self.counts.get(len(payload))
        if count is None:
            return None
        packed, shift, mask = int.from_bytes(payload, "big"), 8 * len(payload), self.mask
        return [packed >> shift - self.bits * place & mask for place in range(1, count + 1)]

    def word_column(self, payloads: NDArray[np.uint8], esc_index: int) -> NDArray[np.int64]:
        """(N,) words of one ESC of (N, bytes) payloads; of a payload that ends before it, whatever stands there."""
        first, offset = divmod(esc_index * self.bits, 8)
        window = np.zeros(len(payloads), np.int64)
        for place in range(first, first + 3):
            window <<= 8
            if place < payloads.shape[1]:
                window |= payloads[:, place]
        return window >> _WINDOW_BITS - self.bits - offset & self.mask

    def number(self, word: Integers) -> Integers:
        """What a word means, or each of many."""
        return signed(number_of(word, self.bits), self.bits)


def _bytes_max(bits: int) -> int:
    return (SETPOINTS_MAX * bits + 7) // 8


RAW_COMMAND = Setpoints(DataType(1030, 0x217F5C87D7EC951D, _bytes_max(14)), 14)
RPM_COMMAND = Setpoints(DataType(1031, 0xCE0F9F621CF7E70B, _bytes_max(18)), 18)


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
    return _encode(RAW_COMMAND, commands, source_node, transfer_id, time_s, priority)


def encode_rpm_command(
    speeds_rpm: Sequence[int],
    source_node: int,
    transfer_id: int,
    *,
    time_s: float = 0.0,
    priority: int = COMMAND_PRIORITY,
) -> list[CanFrame]:
    """Frames of one uavcan.equipment.esc.RPMCommand.

    Args:
        speeds_rpm: up to 20 of -131072..131071, by ESC index.
        source_node, transfer_id, time_s, priority: as for `encode_raw_command`.

    Raises:
        ValueError: an argument out of range.
    """
    return _encode(RPM_COMMAND, speeds_rpm, source_node, transfer_id, time_s, priority)


def _encode(
    message: Setpoints, numbers: Sequence[int], source_node: int, transfer_id: int, time_s: float, priority: int
) -> list[CanFrame]:
    payload = message.pack(numbers)
    return split(
        message.data_type,
        payload,
        source_node=source_node,
        transfer_id=transfer_id,
        priority=priority,
        time_s=time_s,
    )
