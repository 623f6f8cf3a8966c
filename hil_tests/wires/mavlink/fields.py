"""Fields of a payload, read and written in place: all other bytes stay as they are."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from math import isnan
from struct import Struct, calcsize

from drivers.mavlink.formats import MessageFormat

_CODES = re.compile(r"(\d*)([a-zA-Z])")
FLOAT_MAX = 3.4028234663852886e38


@dataclass(frozen=True, slots=True)
class Fields:
    """Neighbouring fields of one type.

    Attributes:
        offset: of the first one from the payload's start.
        layout: of all of them.
        lowest, highest: what one can hold; values beyond are put to the nearest.
        whole: True for integers.
    """

    offset: int
    layout: Struct
    lowest: float
    highest: float
    whole: bool

    @classmethod
    def of(cls, message: MessageFormat, first: int, count: int = 1) -> Fields:
        """So many fields of a message from the `first` one on, elements of arrays counted one by one, from 0.

        Raises:
            ValueError: there are not so many, or they are not of one type.
        """
        codes = "".join(code * int(times or 1) for times, code in _CODES.findall(message.payload.format))
        chosen = codes[first : first + count]
        if len(chosen) < count or len(set(chosen)) != 1:
            raise ValueError(f"first = {first!r}, count = {count!r}: want fields of one type among {codes!r}")
        lowest, highest = _limits(chosen[0])
        layout = Struct(f"<{chosen}")
        return cls(calcsize(f"<{codes[:first]}"), layout, lowest, highest, whole=chosen[0] not in "fd")

    def read(self, payload: bytes | bytearray) -> tuple[float, ...]:
        """Their values, of a payload of full size."""
        return self.layout.unpack_from(payload, self.offset)

    def write(self, payload: bytearray, values: Sequence[float]) -> None:
        """Put values, which must not be NaN for integers, into a payload of full size; integers are rounded."""
        self.layout.pack_into(payload, self.offset, *map(self._held, values))

    def _held(self, value: float) -> float:
        if isnan(value):  # NaN is how some messages say that there is nothing
            return value
        held = max(self.lowest, min(value, self.highest))
        return round(held) if self.whole else held


def _limits(code: str) -> tuple[float, float]:
    if code in "fd":
        return -FLOAT_MAX, FLOAT_MAX
    bits = 8 * calcsize(f"<{code}")
    return (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if code.islower() else (0, 2**bits - 1)
