"""How much a position scatters, learnt from the positions themselves."""

from __future__ import annotations

from bisect import bisect_left, insort
from collections import deque
from math import sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtri

FloatArray = NDArray[np.float64]

POSITIONS = 101  # that the scatter is taken from
LEAST = 12  # before these it is not known
DOUBT = 3.0  # the fewer, the more may be missing: so many more of a hundred per cent, divided by their number
# A quantised or filtered position may not scatter at all. What the model of the way leaves out in one step, an arc
# that is none and a heading that is late, is about this long, as the way made in so many seconds.
FLOOR_S = 0.01


class PositionNoise:
    """Standard deviation of one coordinate of a position, where successive ones err independently.

    What is left of a step after the way through the water and the flow are taken off has the errors of two positions;
    the change of that from step to step, three: e_k - 2 e_(k-1) + e_(k-2), a variance of 6 for each coordinate. A
    flow that stays for two steps drops out. The median over many steps leaves outliers and jumps without influence.

    Args:
        known_m: as configured; None: learnt.
        speed_scale_mps: of the vehicle.
        dimensions: D.

    Attributes:
        least_m: what is left of it however many positions are averaged.
    """

    def __init__(self, known_m: float | None, speed_scale_mps: float, dimensions: int) -> None:
        self._known_m = known_m
        self.least_m = FLOOR_S * speed_scale_mps
        self._median = 6.0 * float(chdtri(dimensions, 0.5))  # median of chi-square
        self._squares: deque[float] = deque()
        self._sorted: list[float] = []
        self._before: FloatArray | None = None
        self._learnt_m = 0.0

    @property
    def known(self) -> bool:
        """Whether it can be relied on."""
        return self._known_m is not None or len(self._squares) >= LEAST

    @property
    def deviation_m(self) -> float:
        """The standard deviation."""
        return max(self._learnt_m if self._known_m is None else self._known_m, self.least_m)

    def take(self, left_m: FloatArray) -> None:
        """Takes (D,) what is left of the newest step."""
        before, self._before = self._before, left_m
        if before is None or self._known_m is not None:
            return
        change = left_m - before
        self._append(float(change @ change))
        doubt = 1.0 + DOUBT / len(self._sorted)
        self._learnt_m = doubt * sqrt(self._sorted[len(self._sorted) // 2] / self._median)

    def _append(self, square: float) -> None:
        if len(self._squares) == POSITIONS:
            del self._sorted[bisect_left(self._sorted, self._squares.popleft())]
        self._squares.append(square)
        insort(self._sorted, square)

    def interrupt(self) -> None:
        """The next step has no predecessor."""
        self._before = None
