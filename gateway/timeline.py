"""Time as the pipeline sees it: which time stamps are believed, and the even ticks between them."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from gateway.align import is_time

TICKS_PER_S = 10
# ticks stand on a grid of decimal fractions: less than half a tick early is on time
TICK_TOLERANCE_S = 0.01
# A time this far from the last one is a corrupt stamp, or a real break in a recording. A corrupt one stands alone.
JUMP_S = 600.0
JUMP_CONFIRMATIONS = 5
# A program that runs is told the time ten times a second: after such a gap it was stopped, or the recording was.
STILL_S = 3.0


class Timeline:
    """Believes times that go on from the last, and gives out every tick of a fixed grid once.

    The grid (every 0.1 s, counted from the epoch) depends on the times alone, not on how often somebody asks.

    The first is believed. A later one more than 600 s away is refused; five such in a row that agree with each other,
    and lie ahead, are believed.

    Attributes:
        drops: refused times by cause.
    """

    def __init__(self) -> None:
        self.drops: Counter[str] = Counter()
        self._newest_s: float | None = None
        self._next_tick = 0
        self._far_s = math.nan
        self._far_count = 0

    def admits(self, time_s: float) -> bool:
        """False, and counted, for a time that is not to be believed."""
        if not is_time(time_s):
            self.drops["no time"] += 1
            return False
        if self._newest_s is None:
            self._start(time_s)
        elif abs(time_s - self._newest_s) > JUMP_S:
            return self._confirms(time_s, self._newest_s)
        self._far_count = 0
        return True

    def passes(self, times_s: NDArray[np.float64]) -> bool:
        """Whether these times (N,) go on from the last one without a break: all of them are believed.

        They need not be in order: over different links, and to different clocks, readings take different times.
        """
        if not len(times_s):
            return True
        if not is_time(float(np.abs(times_s).max())):  # of a NaN, too
            return False
        if self._newest_s is None:
            self.admits(float(times_s[0]))
        newest_s = times_s[0] if self._newest_s is None else self._newest_s
        steps_s = times_s - np.maximum.accumulate(np.append(newest_s, times_s[:-1]))
        if steps_s.min() < -JUMP_S or steps_s.max() > STILL_S:
            return False
        self._far_count = 0
        return True

    def reach(self, time_s: float) -> None:
        """Takes an admitted time up to which all ticks were given out."""
        self._newest_s = time_s if self._newest_s is None else max(self._newest_s, time_s)

    def stands_still(self, time_s: float) -> bool:
        """Whether nothing at all has happened before an admitted time for so long that nobody was there to see it."""
        return self._newest_s is not None and time_s - self._newest_s > STILL_S

    def ticks(self, time_s: float) -> Iterator[float]:
        """The ticks up to an admitted time that have not been given out yet, at most 6000."""
        self.reach(time_s)
        while self._next_tick <= time_s * TICKS_PER_S:
            self._next_tick += 1
            yield (self._next_tick - 1) / TICKS_PER_S

    def _start(self, time_s: float) -> None:
        self._newest_s = time_s
        self._next_tick = math.ceil(time_s * TICKS_PER_S)

    def _confirms(self, time_s: float, newest_s: float) -> bool:
        agrees = abs(time_s - self._far_s) <= JUMP_S
        self._far_count = self._far_count + 1 if agrees else 1
        self._far_s = time_s
        if self._far_count >= JUMP_CONFIRMATIONS and time_s > newest_s:
            self._start(time_s)
            self._far_count = 0
            return True
        self.drops["time far from the last"] += 1
        return False
