"""Gate of the innovations: a single sample that is far off does not move the filter; many in a row do."""

from __future__ import annotations

from collections import Counter

import numpy as np

from detectors.navigation.error_filter import FloatArray
from detectors.navigation.innovation import Measurement
from detectors.navigation.sample import FixSample

# A sample farther off than this does not move the filter: squared standard deviations, for each component.
OUTLIER = 9.0
# After so many in a row it is not the sample that is off.
OUTLIERS_MAX = 5
# Fixes come seldom, and what they contradict moves on meanwhile.
FIX_OUTLIERS_MAX = 2


def outlying(innovation: FloatArray, covariance: FloatArray) -> bool:
    """Whether an innovation (M,) is far off, with the covariance (M, M) that it should have."""
    return float(innovation @ np.linalg.solve(covariance, innovation)) > OUTLIER * len(innovation)


class InnovationGate:
    """Counts the outliers of each kind of measurement."""

    def __init__(self) -> None:
        self._outliers: Counter[type[Measurement]] = Counter()

    def insists(self, kind: type[Measurement]) -> bool:
        """So many in a row were off that the next is believed."""
        return self._outliers[kind] >= (FIX_OUTLIERS_MAX if kind is FixSample else OUTLIERS_MAX)

    def admits(self, kind: type[Measurement], innovation: FloatArray, covariance: FloatArray) -> bool:
        """Whether an innovation (M,) of covariance (M, M) is to be used."""
        outlier = outlying(innovation, covariance) and not self.insists(kind)
        self._outliers[kind] = self._outliers[kind] + 1 if outlier else 0
        return not outlier
