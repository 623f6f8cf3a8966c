"""What shows in a sensor's own samples, one beside the other: stuck, scattering, coming and going.

The likelihood ratio asks for errors that stay or grow; these faults have none, or say more of their kind.
"""

from __future__ import annotations

from collections import deque
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from detectors.navigation.innovation import Innovation
from detectors.navigation.sample import FaultKind

FloatArray = NDArray[np.float64]

# A sensor's noise never gives the same number so often in a row, in all components.
STUCK_SAMPLES = 4
# The vehicle cannot be where a stuck sensor says: so many standard deviations, squared.
STUCK_OFF = 25.0
# Squared differences of successive innovations, as shares of twice their noise: how far each counts, over how many
# samples, and what the mean of healthy ones does not reach.
SCATTER_CLIP, SCATTER_MEMORY, SCATTER_LIMIT = 9.0, 12.0, 4.5
# Mean of those changes between samples that are not off: above it, it is noise.
BETWEEN = 2.0
# Single samples that are off happen to healthy sensors, one in a hundred; so many of so few do not.
OFF_LIMIT, OFF_MEMORY = 6, 30
OFF = 9.0  # standard deviations squared, for each component


class Condition:
    """Watches one sensor's innovations and samples."""

    def __init__(self) -> None:
        self.clear()
        self._last_sample: tuple[float, ...] | None = None
        self._repeats = 0

    def clear(self) -> None:
        """Begins anew; what repeats goes on to be counted."""
        self._scatter = self._between = 1.0
        self._last: FloatArray | None = None
        self._off: deque[bool] = deque(maxlen=OFF_MEMORY)
        self._stuck_off = False

    @property
    def repeated(self) -> bool:
        """The sensor has said the same too often to be alive."""
        return self._repeats >= STUCK_SAMPLES

    def update(self, sample: tuple[float, ...], innovation: Innovation) -> None:
        """Takes a sample's components (M,) and its innovation."""
        self._repeats = self._repeats + 1 if sample == self._last_sample else 1
        self._last_sample = sample
        off = innovation.squared
        self._stuck_off = self.repeated and off > STUCK_OFF
        self._off.append(off > OFF * len(innovation.values))
        if self._last is not None:
            changes = 0.5 * (innovation.values - self._last) ** 2 / np.diag(innovation.noise)
            changed = float(np.minimum(changes, SCATTER_CLIP).mean())
            self._scatter += (changed - self._scatter) / SCATTER_MEMORY
            if not any([*self._off][-2:]):
                self._between += (changed - self._between) / SCATTER_MEMORY
        self._last = innovation.values

    def evidence(self) -> tuple[float, FaultKind]:
        """The strongest, 1.0 being a fault, and which."""
        times_off = sum(now and not before for before, now in pairwise(self._off))
        noisy, comes_and_goes = self._scatter / SCATTER_LIMIT, times_off / OFF_LIMIT
        # a sensor that scatters is off at times, and one that is off at times seems to scatter
        if self._between > BETWEEN:
            comes_and_goes = 0.0
        elif comes_and_goes >= 1.0:
            noisy = 0.0
        return max(
            (2.0 if self._stuck_off else 0.0, FaultKind.STUCK),
            (noisy, FaultKind.NOISE),
            (comes_and_goes, FaultKind.INTERMITTENT),
        )
