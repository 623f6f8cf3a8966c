"""A number among the bits of a frame's data: of one frame, or of many at once."""

from __future__ import annotations

import struct
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray

Kind = Literal["unsigned", "signed", "float"]
Column: TypeAlias = NDArray[Any]

WORD_BITS = 64
_CODES = {
    "unsigned": {8: "B", 16: "H", 32: "I", 64: "Q"},
    "signed": {8: "b", 16: "h", 32: "i", 64: "q"},
    "float": {16: "e", 32: "f", 64: "d"},
}
_FLOATS = {bits: struct.Struct("<" + code) for bits, code in _CODES["float"].items()}


@dataclass(frozen=True, slots=True)
class BitField:
    """Where the bits of a number lie, and what they mean.

    Attributes:
        first: its first bit, from 0. Little endian: its lowest one, where bit 0 is the lowest of byte 0 and bit 8 the
            lowest of byte 1. Big endian: its highest one, where bit 0 is the highest of byte 0 and bit 8 the highest
            of byte 1.
        bits: 1 to 64; of a float 16, 32 or 64 (IEEE 754).
        big_endian: True: the most significant byte is sent first.
        kind: what its bits are; "signed" is two's complement.

    Raises:
        ValueError: bits out of range.
    """

    first: int
    bits: int
    big_endian: bool = False
    kind: Kind = "unsigned"

    def __post_init__(self) -> None:
        if self.first < 0:
            raise ValueError(f"first must be at least 0, got {self.first}")
        if self.kind not in get_args(Kind):
            raise ValueError(f"kind must be one of {', '.join(get_args(Kind))}, got {self.kind!r}")
        if self.kind == "float" and self.bits not in _FLOATS:
            raise ValueError(f"a float must have {', '.join(map(str, _FLOATS))} bits, got {self.bits}")
        if not 1 <= self.bits <= WORD_BITS:
            raise ValueError(f"bits must lie in 1..{WORD_BITS}, got {self.bits}")

    @property
    def end(self) -> int:
        """The bit behind its last one, counted as `first` is."""
        return self.first + self.bits

    @property
    def struct_code(self) -> str | None:
        """The letter of `struct` for it; None where it does not begin and end with a byte, or has an odd width."""
        return _CODES[self.kind].get(self.bits) if self.first % 8 == 0 else None

    def reader(self, length: int) -> Callable[[bytes], float]:
        """Function from `length` bytes of data to the number: an integer, or a float."""
        bits, mask, half = self.bits, (1 << self.bits) - 1, 1 << self.bits - 1
        order: Literal["big", "little"] = "big" if self.big_endian else "little"
        shift = 8 * length - self.end if self.big_endian else self.first

        def unsigned(data: bytes) -> int:
            return int.from_bytes(data, order) >> shift & mask

        def signed(data: bytes) -> int:
            return (int.from_bytes(data, order) >> shift & mask ^ half) - half

        if self.kind != "float":
            return signed if self.kind == "signed" else unsigned
        layout = _FLOATS[bits]

        def floating(data: bytes) -> float:
            return float(layout.unpack(unsigned(data).to_bytes(bits // 8, "little"))[0])

        return floating

    def column(self, data: NDArray[np.uint8]) -> Column:
        """The numbers of many frames.

        Args:
            data: (N, W) with W of 8 or more, and long enough for the field.

        Returns:
            (N,) uint64, int64 or float64.
        """
        raw = _bits(data, self.first, self.bits, self.big_endian)
        if self.kind == "signed":
            unused = WORD_BITS - self.bits
            return (raw << unused).view(np.int64) >> unused
        if self.kind == "float":
            exact = raw.astype(f"u{self.bits // 8}").view(f"f{self.bits // 8}")
            return exact.astype(np.float64)
        return raw


def _bits(data: NDArray[np.uint8], first: int, bits: int, big_endian: bool) -> NDArray[np.uint64]:
    """(N,) bits as unsigned numbers, out of the eight bytes that hold them."""
    begin, end = first // 8, first + bits
    if end > 8 * begin + WORD_BITS:  # nine bytes hold them: in two parts, of which the upper one is `bits - 32` wide
        low_first, high_first = (end - 32, first) if big_endian else (first, first + 32)
        high = _bits(data, high_first, bits - 32, big_endian)
        return high << np.uint64(32) | _bits(data, low_first, 32, big_endian)
    begin = min(begin, data.shape[1] - 8)
    words = np.ascontiguousarray(data[:, begin : begin + 8]).view(">u8" if big_endian else "<u8")
    shift = 8 * begin + WORD_BITS - end if big_endian else first - 8 * begin
    raw: NDArray[np.uint64] = words[:, 0].astype(np.uint64) >> np.uint64(shift) & np.uint64((1 << bits) - 1)
    return raw
