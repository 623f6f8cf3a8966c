"""A physical value in a message: what its raw number means, and which of its numbers are no value."""

from __future__ import annotations

import math
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from drivers.can.messages.bit_field import WORD_BITS, BitField, Column
from drivers.can.messages.field_layout import FieldLayout

LARGEST = sys.float_info.max
# Integers this wide are not driven to the end of their range: all ones (65535) often marks "not available", and a
# sensor at its end is saturated. Narrower ones, such as a percent in a byte, do use their whole range.
SENTINEL_BITS = 16


@dataclass(frozen=True, slots=True)
class Signal:
    """One signal, as a database or a protocol describes it: value = raw * scale + offset.

    Attributes:
        field: where its bits lie.
        scale, offset: to its physical unit.
        lowest, highest: values outside are none; NaN and infinity never are.
        not_available: raw numbers that mean "no value".
        selectors: multiplexers, each with those of its numbers that say that the signal is there; all must.

    Raises:
        ValueError: a scale or offset that is no number, or a multiplexer that is no integer below 64 bits.
    """

    field: BitField
    scale: float = 1.0
    offset: float = 0.0
    lowest: float = -LARGEST
    highest: float = LARGEST
    not_available: frozenset[float] = frozenset()
    selectors: tuple[tuple[BitField, frozenset[int]], ...] = ()

    def __post_init__(self) -> None:
        if not (math.isfinite(self.scale) and math.isfinite(self.offset)):
            raise ValueError(f"scale and offset must be finite, got {self.scale} and {self.offset}")
        for selector, _ in self.selectors:
            if selector.kind == "float" or selector.bits >= WORD_BITS:
                raise ValueError(f"a multiplexer must be an integer of less than {WORD_BITS} bits, got {selector}")

    def fields(self) -> list[BitField]:
        """Itself, and what says whether it is there."""
        return [self.field, *(selector for selector, _ in self.selectors)]


def ends_of_range(field: BitField) -> frozenset[float]:
    """Numbers at the ends of a wide integer's range, which mean "not available" or "saturated"."""
    if field.kind == "float" or field.bits < SENTINEL_BITS:
        return frozenset()
    if field.kind == "signed":
        return frozenset({-(1 << field.bits - 1), (1 << field.bits - 1) - 1})
    return frozenset({(1 << field.bits) - 1})


class SignalReader:
    """Reads a signal out of what a message's layout has unpacked; no number raises.

    Args:
        signal: what to read.
        layout: of its message.
        quantity: what it stands for, in the causes of `drops`: "speed" is counted as "implausible speed".
        drops: where numbers that are no value are counted.

    Attributes:
        place: of the signal's raw number.
        read: function from the numbers of one frame to the physical value; None where there is none.
    """

    def __init__(self, signal: Signal, layout: FieldLayout, quantity: str, drops: Counter[str]) -> None:
        self.signal = signal
        self.place = layout.place(signal.field)
        self._selectors = [(layout.place(field), wanted) for field, wanted in signal.selectors]
        self._implausible = f"implausible {quantity}"
        self._drops = drops
        self.read = self._compiled()

    def column(self, columns: Sequence[Column]) -> NDArray[np.float64]:
        """`read` of many frames: (N,), NaN where there is none.

        Args:
            columns: of the layout.
        """
        signal, raw = self.signal, columns[self.place]
        value = raw * signal.scale + signal.offset
        refused = ~((signal.lowest <= value) & (value <= signal.highest))  # NaN, too
        for number in signal.not_available:
            refused |= raw == number
        absent = np.zeros(len(raw), dtype=bool)
        for place, wanted in self._selectors:
            absent |= ~np.isin(columns[place].astype(np.int64), sorted(wanted))
        self._count(value[refused & ~absent])
        value[refused | absent] = np.nan
        return value

    def _count(self, refused: NDArray[np.float64]) -> None:
        finite = int(np.isfinite(refused).sum())
        for cause, count in ((self._implausible, finite), ("non-finite", len(refused) - finite)):
            if count:
                self._drops[cause] += count

    def _refuse(self, value: float) -> None:
        self._drops[self._implausible if math.isfinite(value) else "non-finite"] += 1

    def _compiled(self) -> Callable[[Sequence[float]], float | None]:
        """A closure: it is called for every signal of every frame, and finds what it needs soonest in its cells."""
        signal, place, selectors, refuse = self.signal, self.place, self._selectors, self._refuse
        scale, offset, lowest, highest = signal.scale, signal.offset, signal.lowest, signal.highest
        not_available = signal.not_available

        def plain(numbers: Sequence[float]) -> float | None:
            raw = numbers[place]
            value = raw * scale + offset
            if lowest <= value <= highest and raw not in not_available:
                return value
            refuse(value)
            return None

        def multiplexed(numbers: Sequence[float]) -> float | None:
            for selector, wanted in selectors:
                if numbers[selector] not in wanted:
                    return None
            return plain(numbers)

        return multiplexed if selectors else plain
