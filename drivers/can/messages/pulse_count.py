"""A count of pulses that runs on and wraps round: pulses a second, of one frame after the other or of many."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from drivers.can.messages.bit_field import WORD_BITS, Column
from drivers.can.messages.signal_reader import SignalReader

FloatArray: TypeAlias = NDArray[np.float64]

# A count tells how fast the shaft turned between two frames, if they are neither one frame repeated nor far apart.
INTERVAL_MIN_S = 0.001
INTERVAL_MAX_S = 2.0


class PulseCount:
    """Pulses a second since the frame before.

    Args:
        reader: the signal that counts, an integer.
        signed: True where the count falls when the shaft turns astern.
    """

    def __init__(self, reader: SignalReader, signed: bool) -> None:
        self._reader = reader
        self._place, self._scale = reader.place, reader.signal.scale
        self._bits = reader.signal.field.bits
        self._signed = signed
        self._count = 0
        self._time_s = -math.inf

    def read(self, numbers: Sequence[float], time_s: float) -> float | None:
        """Mean since the frame before; None where the two cannot be compared."""
        if self._reader.read(numbers) is None:
            return None
        interval_s = time_s - self._time_s
        if 0.0 <= interval_s < INTERVAL_MIN_S:
            return None
        count = int(numbers[self._place])
        pulses = self._since(count)
        self._count, self._time_s = count, time_s
        return pulses * self._scale / interval_s if 0.0 < interval_s <= INTERVAL_MAX_S else None

    def _since(self, count: int) -> int:
        span = 1 << self._bits
        pulses = (count - self._count) % span
        return pulses - span if self._signed and pulses >= span // 2 else pulses

    def column(self, columns: Sequence[Column], time_s: FloatArray) -> FloatArray:
        """`read` of many frames: (N,), NaN where there is none."""
        pulse_rate = np.full(len(time_s), np.nan)
        counted = np.flatnonzero(~np.isnan(self._reader.column(columns)))
        counted = counted[_apart(time_s[counted], self._time_s)]
        if len(counted) == 0:
            return pulse_rate
        moments_s, counts = time_s[counted], columns[self._place][counted]
        intervals_s = np.diff(moments_s, prepend=self._time_s)
        comparable = (intervals_s > 0.0) & (intervals_s <= INTERVAL_MAX_S)
        pulses = self._between(counts)[comparable]
        pulse_rate[counted[comparable]] = pulses * self._scale / intervals_s[comparable]
        self._count, self._time_s = int(counts[-1]), float(moments_s[-1])
        return pulse_rate

    def _between(self, counts: Column) -> Column:
        """(N,) pulses since the count before; numbers of 64 bits wrap round by themselves, narrower ones are shifted
        up for it."""
        unused = np.uint64(WORD_BITS - self._bits)
        running = np.concatenate(([np.uint64(self._count % (1 << WORD_BITS))], counts.astype(np.uint64)))
        steps: NDArray[np.uint64] = running[1:] - running[:-1] << unused
        pulses: Column = steps.view(np.int64) >> np.int64(unused) if self._signed else steps >> unused
        return pulses


def _apart(time_s: FloatArray, last_s: float) -> NDArray[np.bool_]:
    """(N,) False for frames too soon after the last one that was not."""
    intervals_s = np.diff(time_s, prepend=last_s)
    apart = ~((intervals_s >= 0.0) & (intervals_s < INTERVAL_MIN_S))
    if apart.all():
        return apart
    for row, moment_s in enumerate(time_s.tolist()):
        apart[row] = not 0.0 <= moment_s - last_s < INTERVAL_MIN_S
        if apart[row]:
            last_s = moment_s
    return apart
