"""Speed signals of vendor messages: rpm from whatever unit the sensor counts in."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from typing import Literal

from drivers.can.dbc_signal import SignalReader

SpeedUnit = Literal["rpm", "rps", "rad_per_s", "erpm", "pulses_per_s", "pulse_count"]
POLE_PAIR_UNITS = ("erpm", "pulses_per_s", "pulse_count")

# A count tells how fast the shaft turned between two frames, if they are neither one frame repeated nor far apart.
COUNT_INTERVAL_MIN_S = 0.001
COUNT_INTERVAL_MAX_S = 2.0


def rpm_per_unit(unit: SpeedUnit, pole_pairs: int) -> float:
    """Speed in rpm for one unit of the signal; for a pulse count, for one pulse a second.

    One Hall sensor gives one pulse for each pole pair in a turn.
    """
    factors = {"rpm": 1.0, "rps": 60.0, "rad_per_s": 30.0 / math.pi, "erpm": 1.0 / pole_pairs}
    return factors.get(unit, 60.0 / pole_pairs)


class SpeedReader:
    """Reads a thruster's speed out of a message's data.

    Args:
        read: what gives the speed in the signal's unit, from data and time; None where there is none.
        rpm: speed in rpm that one unit stands for, negative where the sensor counts astern as positive.
        limit_rpm: a faster speed is implausible.
        signed: False: the magnitude.
        drops: where implausible speeds are counted.
    """

    def __init__(
        self,
        read: Callable[[bytes, float], float | None],
        rpm: float,
        limit_rpm: float,
        signed: bool,
        drops: Counter[str],
    ) -> None:
        self._read = read
        self._rpm = rpm
        self._limit_rpm = limit_rpm
        self._signed = signed
        self._drops = drops

    def read(self, data: bytes, time_s: float) -> float | None:
        """Speed in rpm; None where this message does not tell it."""
        value = self._read(data, time_s)
        if value is None:
            return None
        speed_rpm = value * self._rpm
        if abs(speed_rpm) > self._limit_rpm:
            self._drops["implausible speed"] += 1
            return None
        return speed_rpm if self._signed else abs(speed_rpm)


class PulseCount:
    """Pulses a second from a count that runs on and wraps round.

    Args:
        reader: the signal that counts.
        signed: True where the count falls when the shaft turns astern.
    """

    def __init__(self, reader: SignalReader, signed: bool) -> None:
        self._reader = reader
        self._span = 1 << reader.bits
        self._signed = signed
        self._count = 0.0
        self._time_s = -math.inf

    def read(self, data: bytes, time_s: float) -> float | None:
        """Mean since the frame before; None where the two cannot be compared."""
        if self._reader.read(data) is None:
            return None
        interval_s = time_s - self._time_s
        if 0.0 <= interval_s < COUNT_INTERVAL_MIN_S:
            return None
        count = self._reader.raw(data)
        pulses = self._since(count)
        self._count, self._time_s = count, time_s
        return pulses * self._reader.scale / interval_s if 0.0 < interval_s <= COUNT_INTERVAL_MAX_S else None

    def _since(self, count: float) -> float:
        pulses = (count - self._count) % self._span
        return pulses - self._span if self._signed and pulses >= self._span / 2 else pulses
