"""What a measurement says that the filter did not expect."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from detectors.navigation.sample import AttitudeSample, DepthSample, DvlSample, FixSample

FloatArray = NDArray[np.float64]
Measurement = DvlSample | DepthSample | FixSample | AttitudeSample
KINDS: tuple[type[Measurement], ...] = (DvlSample, DepthSample, FixSample, AttitudeSample)


@dataclass(frozen=True, slots=True, eq=False)
class Innovation:
    """A measurement beside what the filter expected of it (paper 003, equations 7 to 9).

    Attributes:
        measurement: what was compared.
        values: (M,) measured minus expected.
        covariance: (M, M) that a healthy sensor's has.
        observation: (M, N) derivatives of what was expected by the N states.
        transition: (N, N) of the states since the innovation before, of whatever sensor.
        process: (N, N) covariance of what came to the states since then.
        gain: (N, M) with which the states were corrected; None: the measurement was not used.
        noise: (M, M) the measurement's own part of the covariance.
        features: (12,) of the learnt predictor, with a sample of the DVL.
    """

    measurement: Measurement
    values: FloatArray
    covariance: FloatArray
    observation: FloatArray
    transition: FloatArray
    process: FloatArray
    gain: FloatArray | None
    noise: FloatArray
    features: FloatArray | None = None

    @property
    def time_s(self) -> float:
        """Stamp of the measurement."""
        return self.measurement.time_s

    @property
    def squared(self) -> float:
        """Its size in standard deviations, squared: chi-square with M degrees of freedom."""
        return float(self.values @ np.linalg.solve(self.covariance, self.values))
