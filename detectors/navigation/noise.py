"""How much a sensor scatters, learnt from the differences of successive innovations."""

from __future__ import annotations

from math import sqrt

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

LEAST, MOST = 0.25, 3.0  # times the configured noise
_FIRST = 20  # differences that the configuration counts for
_MEMORY = 200.0
_CLIP = 3.0  # standard deviations: what is more is no noise


class NoiseLevel:
    """Standard deviation of each component of a sensor's noise, slow and deaf to outliers.

    Args:
        expected: (M,) first guess.
    """

    def __init__(self, expected: FloatArray) -> None:
        self._expected = expected
        self._variance = expected**2
        self._count = float(_FIRST)
        self._last: FloatArray | None = None

    @property
    def deviation(self) -> FloatArray:
        """(M,)"""
        return np.sqrt(self._variance)

    def learn(self, innovation: FloatArray) -> None:
        """Takes an innovation (M,) of a time when nothing but noise should change it."""
        if self._last is not None:
            limit = _CLIP * sqrt(2.0) * self.deviation
            half = 0.5 * np.clip(innovation - self._last, -limit, limit) ** 2
            self._count = min(self._count + 1.0, _MEMORY)
            # 1.03: what the clipping takes away of the variance
            self._variance = self._variance + (1.03 * half - self._variance) / self._count
            bounds = (LEAST * self._expected) ** 2, (MOST * self._expected) ** 2
            self._variance = np.clip(self._variance, *bounds)
        self._last = innovation

    def forget_last(self) -> None:
        """What came last does not go with what comes next."""
        self._last = None
