"""Whether the headings of late can tell speed from flow at all (paper 002, assumption 4, measured)."""

from __future__ import annotations

from math import exp, inf, sqrt

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

MEMORY_S = 30.0
# Of an estimator without a covariance, the error that its speed has when it drives in circles, as a share of it
ERROR_EXCITED = 0.02


class Excitation:
    """Spread of the ways through the water: 1 - |mean|^2 / mean square, forgotten exponentially. Picklable.

    A constant flow and a speed are told apart by the ways that differ from their mean; the information about the
    speed is proportional to this spread: the Schur complement of the flow in the matrix of paper 002, equation 15,
    for a uniform flow.

    Args:
        dimensions: D.
    """

    def __init__(self, dimensions: int) -> None:
        self._seconds = 0.0
        self._sum = np.zeros(dimensions)
        self._squares = 0.0

    def take(self, ahead_s: FloatArray, interval_s: float) -> None:
        """Takes the (D,) way at 1 m/s through an interval."""
        keep = exp(-interval_s / MEMORY_S)
        self._seconds = keep * self._seconds + interval_s
        self._sum = keep * self._sum + ahead_s
        self._squares = keep * self._squares + float(ahead_s @ ahead_s) / interval_s

    @property
    def spread(self) -> float:
        """0 on a straight course at one speed, 1 in circles."""
        if self._squares <= 0.0:
            return 0.0
        return max(1.0 - float(self._sum @ self._sum) / (self._seconds * self._squares), 0.0)

    @property
    def error(self) -> float:
        """Standard deviation of the speed that may be expected, as a share of it; infinite without any spread."""
        return ERROR_EXCITED / sqrt(self.spread) if self.spread > 1e-6 else inf
