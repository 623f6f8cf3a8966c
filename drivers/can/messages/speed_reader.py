"""Speed signals: rpm from whatever unit the sensor counts in."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from drivers.can.messages.bit_field import Column
from drivers.can.messages.field_layout import FieldLayout
from drivers.can.messages.pulse_count import PulseCount
from drivers.can.messages.signal_reader import Signal, SignalReader

SpeedUnit = Literal["rpm", "rps", "rad_per_s", "erpm", "pulses_per_s", "pulse_count"]
POLE_PAIR_UNITS = ("erpm", "pulses_per_s", "pulse_count")
# No propeller in water turns nearly as fast: above are sentinels, ERPM taken for RPM, and garbage.
SPEED_LIMIT_RPM = 30_000.0

FloatArray: TypeAlias = NDArray[np.float64]


def rpm_per_unit(unit: SpeedUnit, pole_pairs: int) -> float:
    """Speed in rpm for one unit of the signal; for a pulse count, for one pulse a second.

    One Hall sensor gives one pulse for each pole pair in a turn.
    """
    factors = {"rpm": 1.0, "rps": 60.0, "rad_per_s": 30.0 / math.pi, "erpm": 1.0 / pole_pairs}
    return factors.get(unit, 60.0 / pole_pairs)


@dataclass(frozen=True, slots=True)
class SpeedSignal:
    """A signal that tells a thruster's speed.

    Attributes:
        signal: in the sensor's unit.
        rpm: that one unit stands for, negative where the sensor counts astern as positive.
        limit_rpm: a faster speed is implausible.
        signed: False: the magnitude.
        counts: True: the signal is a count that runs on and wraps round, its unit one pulse a second.
    """

    signal: Signal
    rpm: float = 1.0
    limit_rpm: float = SPEED_LIMIT_RPM
    signed: bool = True
    counts: bool = False

    def __post_init__(self) -> None:
        if self.counts and self.signal.field.kind == "float":
            raise ValueError("a pulse count must be an integer, got a float")


class SpeedReader:
    """Reads a thruster's speed; a count's is from the frame before to this one.

    Args:
        speed: what to read.
        layout: of its message.
        drops: where implausible speeds are counted.

    Attributes:
        read: function from the numbers of one frame and its time to the speed in rpm; None where it tells none.
    """

    def __init__(self, speed: SpeedSignal, layout: FieldLayout, drops: Counter[str]) -> None:
        self._speed = speed
        self._drops = drops
        self._reader = SignalReader(speed.signal, layout, "speed", drops)
        self._count = PulseCount(self._reader, speed.signed) if speed.counts else None
        self.read = self._compiled()

    def column(self, columns: Sequence[Column], time_s: FloatArray) -> FloatArray:
        """`read` of many frames: (N,), NaN where there is none."""
        value = self._reader.column(columns) if self._count is None else self._count.column(columns, time_s)
        speed_rpm = value * self._speed.rpm
        beyond = np.abs(speed_rpm) > self._speed.limit_rpm
        if beyond.any():
            self._drops["implausible speed"] += int(beyond.sum())
            speed_rpm[beyond] = np.nan
        return speed_rpm if self._speed.signed else np.abs(speed_rpm)

    def _compiled(self) -> Callable[[Sequence[float], float], float | None]:
        read, count, drops = self._reader.read, self._count, self._drops
        rpm, limit_rpm, signed = self._speed.rpm, self._speed.limit_rpm, self._speed.signed

        def speed(numbers: Sequence[float], time_s: float) -> float | None:
            value = read(numbers) if count is None else count.read(numbers, time_s)
            if value is None:
                return None
            speed_rpm = value * rpm
            if -limit_rpm <= speed_rpm <= limit_rpm:
                return speed_rpm if signed else abs(speed_rpm)
            drops["implausible speed"] += 1
            return None

        return speed
