"""What the learnt predictor sees of a vehicle's motion (paper 003, section 4: its equations 17 to 19)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from detectors.navigation.rotation import Quaternion, rotate_back
from detectors.navigation.sample import Vector

FloatArray = NDArray[np.float64]
DOWN: Vector = (0.0, 0.0, 1.0)
_NOTHING = (0.0,) * 6


class MotionFeatures:
    """Sums up the inertial samples from one sample of the DVL to the next. Picklable."""

    __slots__ = ("_count", "_sums")

    def __init__(self) -> None:
        self._sums = _NOTHING
        self._count = 0

    def add(self, specific_force_mps2: Vector, angular_rate_radps: Vector) -> None:
        """One inertial sample, without its known biases."""
        a, b, c, d, e, f = self._sums
        (x, y, z), (p, q, r) = specific_force_mps2, angular_rate_radps
        self._sums = (a + x, b + y, c + z, d + p, e + q, f + r)
        self._count += 1

    def take(self, velocity_mps: Vector, attitude: Quaternion) -> FloatArray | None:
        """(12,) of the time since the last call: velocity, mean angular rate, mean specific force, direction of down.

        Args:
            velocity_mps: (3,) of the body over ground along its own axes, now.
            attitude: of the body, now.

        Returns:
            None where no inertial sample came in between.
        """
        if not self._count:
            return None
        means = np.array(self._sums) / self._count
        self._sums, self._count = _NOTHING, 0
        return np.concatenate((velocity_mps, means[3:], means[:3], rotate_back(attitude, DOWN)))
