"""Numbers in the order of their bits on the wire ("words").

Source: DroneCAN specification, part 3 "Data structure description language". Of a number the least significant byte
goes first, and of each byte the most significant bit; a last byte that is not full carries the highest bits.
"""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

Integers = TypeVar("Integers", int, NDArray[np.int64])


def word_of(number: int, bits: int) -> int:
    """The bits of a number, first sent first; of a negative one those of its two's complement."""
    whole, rest = divmod(bits, 8)
    low = (number & (1 << 8 * whole) - 1).to_bytes(whole, "little")
    return int.from_bytes(low, "big") << rest | number >> 8 * whole & (1 << rest) - 1


def number_of(word: Integers, bits: int) -> Integers:
    """The number of a word, or of each of many; not negative."""
    whole, rest = divmod(bits, 8)
    number = (word & (1 << rest) - 1) << 8 * whole
    for place in range(whole):
        number = number | (word >> rest + 8 * (whole - 1 - place) & 0xFF) << 8 * place
    return number


def signed(number: Integers, bits: int) -> Integers:
    """A number, or each of many, read as two's complement."""
    sign = 1 << bits - 1
    return (number ^ sign) - sign
