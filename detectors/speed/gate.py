"""Which positions are believed: outliers are refused, and a lasting jump is a new beginning."""

from __future__ import annotations

from enum import Enum, auto
from math import sqrt

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

# In standard deviations of a coordinate, for the length of the error in two or three coordinates: of ten million
# normally distributed ones, one is refused
OUTLIER = 6.0
# So many positions in a row that agree with each other and not with what went before: the vehicle is there
AGREEING = 3


class Fate(Enum):
    """What becomes of a position."""

    TAKEN = auto()
    OUTLIER = auto()
    JUMP = auto()  # the last of several that agree: whoever follows the vehicle begins anew from here


class PositionGate:
    """Judges each position by how far it is from where it should be. Picklable."""

    def __init__(self) -> None:
        self._refused_m: list[FloatArray] = []

    def judge(self, left_m: FloatArray, spread_m: float) -> Fate:
        """Judges the next position.

        Args:
            left_m: (D,) position minus the predicted one, which goes on from the last position that was believed.
            spread_m: standard deviation of that, of each coordinate.
        """
        limit_m = OUTLIER * spread_m
        if sqrt(float(left_m @ left_m)) <= limit_m:
            self._refused_m.clear()
            return Fate.TAKEN
        if self._refused_m and float(np.linalg.norm(left_m - self._refused_m[-1])) > limit_m:
            self._refused_m.clear()
        self._refused_m.append(left_m)
        if len(self._refused_m) < AGREEING:
            return Fate.OUTLIER
        self._refused_m.clear()
        return Fate.JUMP
