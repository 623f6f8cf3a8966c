"""Types of records in an ArduPilot dataflash log, which the log itself describes, and columns of such records.

Every record begins with A3 95 and its type. Type 128 is FMT, which describes another type: its length, its name of
up to 4 letters, a letter for the kind of each field, and the fields' names (ArduPilot, AP_Logger/LogStructure.h;
"Onboard log messages" in its documentation). Numbers are little-endian and packed.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]
IndexArray: TypeAlias = NDArray[np.intp]
Mask: TypeAlias = NDArray[np.bool_]

HEAD = b"\xa3\x95"
HEAD_BYTES = 3  # with the type
FORMAT_TYPE, FORMAT_BYTES = 128, 89
TIME_US = "TimeUS"

# kind of a field: its numpy type, and by what its number is to be divided; 0: it is no number
_KINDS: dict[str, tuple[str, float]] = {
    "b": ("i1", 1.0),
    "B": ("u1", 1.0),
    "h": ("<i2", 1.0),
    "H": ("<u2", 1.0),
    "i": ("<i4", 1.0),
    "I": ("<u4", 1.0),
    "q": ("<i8", 1.0),
    "Q": ("<u8", 1.0),
    "g": ("<f2", 1.0),
    "f": ("<f4", 1.0),
    "d": ("<f8", 1.0),
    "c": ("<i2", 100.0),
    "C": ("<u2", 100.0),
    "e": ("<i4", 100.0),
    "E": ("<u4", 100.0),
    "L": ("<i4", 1e7),  # degrees of latitude and longitude
    "M": ("u1", 1.0),  # flight mode
    "n": ("S4", 0.0),
    "N": ("S16", 0.0),
    "Z": ("S64", 0.0),
    "a": ("V64", 0.0),  # 32 samples of 16 bits
}
_HEAD = "head"  # no field has this name
_DESCRIPTION = struct.Struct("<BB4s16s64s")


@dataclass(frozen=True, slots=True)
class RecordFormat:
    """A type of records.

    Attributes:
        type: its number.
        name: of up to 4 letters, such as "RCOU".
        dtype: of a whole record, its fields by their names.
        divisors: of each field, by which its number is to be divided; 0: it is none.
    """

    type: int
    name: str
    dtype: np.dtype[Any]
    divisors: dict[str, float]

    @property
    def length(self) -> int:
        """Bytes of a record, with its head."""
        return int(self.dtype.itemsize)

    @staticmethod
    def described_by(record: bytes) -> RecordFormat | None:
        """The type that a FMT record of `FORMAT_BYTES` describes; None where what it says cannot be."""
        number, length, *texts = _DESCRIPTION.unpack(record[HEAD_BYTES:])
        name, kinds, names = (_text(text) for text in texts)
        columns = names.split(",")
        possible = name.isalnum() and kinds and all(kind in _KINDS for kind in kinds)
        if not possible or len(columns) != len(kinds) or len({_HEAD, "", *columns}) != len(kinds) + 2:
            return None
        fields = [(_HEAD, f"V{HEAD_BYTES}"), *((name, _KINDS[k][0]) for name, k in zip(columns, kinds, strict=True))]
        dtype = np.dtype(fields)
        divisors = {name: _KINDS[kind][1] for name, kind in zip(columns, kinds, strict=True)}
        return RecordFormat(number, name, dtype, divisors) if dtype.itemsize == length else None


@dataclass(frozen=True, slots=True)
class Records:
    """N records of one type, in the order of the log.

    Attributes:
        format: their type.
        offset: (N,) where each begins in the log.
        rows: (N,) of `format.dtype`.
    """

    format: RecordFormat
    offset: IndexArray
    rows: NDArray[Any]

    def __len__(self) -> int:
        return len(self.offset)

    def part(self, rows: Mask | IndexArray) -> Records:
        """Some of the records."""
        return Records(self.format, self.offset[rows], self.rows[rows])

    def has(self, *names: str) -> bool:
        """Whether the type has all these fields, as numbers."""
        return all(self.format.divisors.get(name) for name in names)

    def has_texts(self, name: str) -> bool:
        """Whether the type has this field, as letters."""
        return name in self.format.divisors and self.format.dtype[name].kind == "S"

    def numbers(self, name: str) -> FloatArray:
        """(N,) a field in the unit that its name is documented in."""
        with np.errstate(invalid="ignore"):  # of the many NaN, numpy warns of some
            column: FloatArray = self.rows[name].astype(np.float64) / self.format.divisors[name]
        return column

    def columns(self, *names: str) -> FloatArray:
        """(N, number of names) several fields."""
        return np.column_stack([self.numbers(name) for name in names])

    def integers(self, name: str) -> NDArray[np.int64]:
        """(N,) a field as it stands in the log; anything, where a damaged format has made it one of fractions."""
        with np.errstate(invalid="ignore"):
            column: NDArray[np.int64] = self.rows[name].astype(np.int64)
        return column

    def texts(self, name: str) -> list[str]:
        """A field of letters."""
        return [_text(text) for text in self.rows[name].tolist()]

    @property
    def boot_s(self) -> FloatArray:
        """(N,) when each was written, since the autopilot's start."""
        return self.numbers(TIME_US) / 1e6


def _text(padded: bytes) -> str:
    return padded.partition(b"\0")[0].decode("ascii", "replace").strip()
