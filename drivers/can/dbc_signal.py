"""One signal of a DBC message, compiled: where its bits lie, what they mean, and which of its values are no value."""

from __future__ import annotations

import math
import struct
import sys
from collections import Counter
from collections.abc import Callable
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from cantools.database.can import Message, Signal

_FLOATS = {16: struct.Struct("<e"), 32: struct.Struct("<f"), 64: struct.Struct("<d")}
_LARGEST = sys.float_info.max
# Integers this wide are not driven to the end of their range: all ones (65535) often marks "not available", and a
# sensor at its end is saturated. Narrower ones, such as a percent in a byte, do use their whole range.
SENTINEL_BITS = 16


class SignalReader:
    """Reads one signal out of a message's data; signals that nobody wants are not decoded, and no value raises.

    Args:
        message: the message, as cantools read it.
        signal: one of its signals.
        quantity: what it stands for, in the causes of `drops`: "speed" is counted as "implausible speed".
        drops: where values that are no value are counted.
        limits: True: values outside the range that the database gives are none.
        sentinels: True: the ends of the range of a wide integer mean "not available".

    Raises:
        ValueError: the signal does not fit into its message.
    """

    def __init__(
        self,
        message: Message,
        signal: Signal,
        quantity: str,
        drops: Counter[str],
        *,
        limits: bool = True,
        sentinels: bool = False,
    ) -> None:
        self.bits = signal.length
        self.scale = float(signal.conversion.scale)
        self._offset = float(signal.conversion.offset)
        self.raw = _raw_reader(message, signal)
        self._selectors = _selectors(message, signal)
        self._lowest, self._highest = _limits(signal) if limits else (-_LARGEST, _LARGEST)
        self._not_available = _sentinels(signal) if sentinels else frozenset()
        if signal.raw_invalid is not None:
            self._not_available |= {signal.raw_invalid}
        self._implausible = f"implausible {quantity}"
        self._drops = drops

    def present(self, data: bytes) -> bool:
        """False where the message's multiplexer says that it carries other signals this time."""
        return all(select(data) in wanted for select, wanted in self._selectors)

    def read(self, data: bytes, _time_s: float = 0.0) -> float | None:
        """Physical value; None where there is none.

        Args:
            data: as long as the message, or longer.
            _time_s: not used; readers that look at two frames need it.
        """
        if self._selectors and not self.present(data):
            return None
        raw = self.raw(data)
        value = raw * self.scale + self._offset
        if raw in self._not_available or not self._lowest <= value <= self._highest:  # the latter also false for NaN
            self._drops["non-finite" if not math.isfinite(value) else self._implausible] += 1
            return None
        return value


def _raw_reader(message: Message, signal: Signal) -> Callable[[bytes], float]:
    """Function from data to the raw value, an integer or an IEEE 754 float."""
    bits, mask, half, span = signal.length, (1 << signal.length) - 1, 1 << signal.length - 1, 1 << signal.length
    order, shift = _position(message, signal)

    def unsigned(data: bytes) -> int:
        return int.from_bytes(data, order) >> shift & mask

    def signed(data: bytes) -> int:
        raw = int.from_bytes(data, order) >> shift & mask
        return raw - span if raw >= half else raw

    if not signal.is_float:
        return signed if signal.is_signed else unsigned
    layout = _FLOATS[bits]

    def floating(data: bytes) -> float:
        return float(layout.unpack((int.from_bytes(data, order) >> shift & mask).to_bytes(bits // 8, "little"))[0])

    return floating


def _position(message: Message, signal: Signal) -> tuple[Literal["little", "big"], int]:
    """Byte order of the data as one integer, and how far the signal's lowest bit is up in it."""
    total = message.length * 8
    little = signal.byte_order == "little_endian"
    # Big endian: `start` is the highest bit, its number counted within its byte from the lowest.
    first = signal.start if little else signal.start // 8 * 8 + 7 - signal.start % 8
    end = first + signal.length
    if end > total:
        raise ValueError(
            f"{message.name}.{signal.name} ends at bit {end}, its message has {total}: mend the database"
        )
    return ("little", first) if little else ("big", total - end)


def _selectors(message: Message, signal: Signal) -> list[tuple[Callable[[bytes], float], frozenset[int]]]:
    """The multiplexers that must select the signal, each with the values that do; nested ones included."""
    selectors = []
    while signal.multiplexer_ids is not None and signal.multiplexer_signal is not None:
        wanted = frozenset(signal.multiplexer_ids)
        signal = message.get_signal_by_name(signal.multiplexer_signal)
        selectors.append((_raw_reader(message, signal), wanted))
    return selectors


def _limits(signal: Signal) -> tuple[float, float]:
    """Range that the database gives, wider by half a step for rounding; all finite numbers where it gives none."""
    slack = abs(float(signal.conversion.scale)) / 2.0
    lowest = -_LARGEST if signal.minimum is None else float(signal.minimum) - slack
    highest = _LARGEST if signal.maximum is None else float(signal.maximum) + slack
    return lowest, highest


def _sentinels(signal: Signal) -> frozenset[float]:
    if signal.is_float or signal.length < SENTINEL_BITS:
        return frozenset()
    if signal.is_signed:
        return frozenset({-(1 << signal.length - 1), (1 << signal.length - 1) - 1})
    return frozenset({(1 << signal.length) - 1})
