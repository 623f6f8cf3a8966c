"""Numbers put into the bits of a frame's data, every other bit left as it is: the inverse of `BitField.reader`."""

from __future__ import annotations

import struct
from typing import Literal

from drivers.can.messages.bit_field import BitField
from drivers.can.messages.signal_reader import Signal, ends_of_range

FLOAT_CODES = {16: "e", 32: "f", 64: "d"}


def with_number(data: bytes, field: BitField, number: float) -> bytes:
    """The data with another number in a field.

    Args:
        data: of a frame, long enough for the field.
        field: where.
        number: raw; of an integer field a whole number that fits.
    """
    order: Literal["big", "little"] = "big" if field.big_endian else "little"
    shift = 8 * len(data) - field.end if field.big_endian else field.first
    mask = (1 << field.bits) - 1
    word = int.from_bytes(data, order) & ~(mask << shift)
    return (word | (_bits(field, number) & mask) << shift).to_bytes(len(data), order)


def _bits(field: BitField, number: float) -> int:
    if field.kind == "float":
        return int.from_bytes(struct.pack("<" + FLOAT_CODES[field.bits], number), "little")
    return int(number)


def raw_number(signal: Signal, value: float) -> float:
    """What stands for a physical value, or for the nearest that the field can tell.

    The ends of a wide integer's range are left out: readers take them for "not available".
    """
    raw = (value - signal.offset) / signal.scale
    if signal.field.kind == "float":
        return raw
    lowest, highest = _range(signal.field)
    return min(highest, max(lowest, round(raw)))


def _range(field: BitField) -> tuple[int, int]:
    signed = field.kind == "signed"
    lowest = -(1 << field.bits - 1) if signed else 0
    highest = (1 << field.bits - signed) - 1
    ends = ends_of_range(field)
    return lowest + (lowest in ends), highest - (highest in ends)
