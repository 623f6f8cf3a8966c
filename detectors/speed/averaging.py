"""Means over about a second: of positions, and of the ways to them."""

from __future__ import annotations

from math import hypot, inf, sqrt

import numpy as np
from numpy.typing import NDArray

from detectors.speed.estimate import Step
from detectors.speed.way import Way

FloatArray = NDArray[np.float64]

# Positions come up to 50 times a second, headings with a noise that a filter would take for turns, and for turns that
# the positions do not show. Means over this time have a tenth of it, and lose nothing that a vehicle does.
BLOCK_S = 1.0
NEARLY = 0.95  # of it is enough: intervals are never quite even


class Averaging:
    """Gathers positions until they make a block; the step leads from the mean of one block to that of the next.

    Speed and flow enter positions and ways linearly, so that what holds for single ones holds for their means.
    Picklable.

    Args:
        dimensions: D.
    """

    def __init__(self, dimensions: int) -> None:
        self._dimensions = dimensions
        self.begin(np.zeros(dimensions), -inf)

    def begin(self, position_m: FloatArray, time_s: float) -> None:
        """Forgets what was gathered: this is the first position of a block."""
        d = self._dimensions
        self._before: FloatArray | None = None  # mean of the last block: time, position, ahead, aside, turned
        self._reached = np.concatenate(([0.0], position_m, np.zeros(3 * d)))  # of the newest position
        self._origin_s = self._first_s = self._newest_s = time_s
        self._sum, self._count = self._reached, 1

    def take(
        self, time_s: float, position_m: FloatArray, way: Way, noise_m: tuple[float, float]
    ) -> Step | FloatArray | None:
        """Takes the next position; where it completes a block, the step to it, or the (D,) mean of the first block.

        Args:
            time_s: of the position.
            position_m: (D,) position.
            way: since the position before.
            noise_m: standard deviation of a position, and the least that is believed of a mean.
        """
        d = self._dimensions
        ways = self._reached[d + 1 :] + np.concatenate((way.ahead_s, way.aside_s, way.turned))
        self._reached = np.concatenate(([time_s - self._origin_s], position_m, ways))
        if self._count == 0:
            self._first_s = time_s
        self._sum, self._count = self._sum + self._reached, self._count + 1
        interval_s, self._newest_s = time_s - self._newest_s, time_s
        if time_s - self._first_s + interval_s < NEARLY * BLOCK_S:
            return None
        return self._step(time_s, noise_m)

    def _step(self, time_s: float, noise_m: tuple[float, float]) -> Step | FloatArray:
        d, count = self._dimensions, self._count
        mean, before = self._sum / count, self._before
        self._before = mean
        self._sum, self._count = np.zeros_like(self._sum), 0
        if before is None:
            return mean[1 : d + 1]
        moved = mean - before
        single_m, least_m = noise_m
        return Step(
            time_s=time_s,
            interval_s=float(moved[0]),
            position_m=mean[1 : d + 1],
            ahead_s=moved[d + 1 : 2 * d + 1],
            aside_s=moved[2 * d + 1 : 3 * d + 1],
            turned=moved[3 * d + 1 :],
            position_noise_m=hypot(single_m / sqrt(count), least_m),
        )
