"""When the filter has found itself, so that sensors can be judged by it."""

from __future__ import annotations

from math import sqrt

import numpy as np

from detectors.navigation.innovation import Innovation
from detectors.navigation.sample import DvlSample

# It has had so long and so many samples of the DVL, and expects the next so well.
SETTLING_S, SETTLING_SAMPLES, SETTLED_MPS = 20.0, 10, 0.25


class Settling:
    """Waits until the filter expects the DVL well.

    Args:
        time_s: when the filter began.

    Attributes:
        settled: sensors are judged.
        samples: of the DVL since the beginning.
    """

    def __init__(self, time_s: float) -> None:
        self.begin(time_s)

    def begin(self, time_s: float) -> None:
        """The filter begins anew."""
        self.settled, self.samples, self._began_s = False, 0, time_s

    def expects(self, innovation: Innovation) -> bool:
        """Takes an innovation of DVL or depth sensor.

        Returns:
            Whether the filter expects the DVL well enough by now, whether rightly or wrongly.
        """
        if not isinstance(innovation.measurement, DvlSample):
            return False
        self.samples += 1
        if innovation.time_s - self._began_s < SETTLING_S or self.samples < SETTLING_SAMPLES:
            return False
        return sqrt(float(np.trace(innovation.covariance)) / 3.0) <= SETTLED_MPS
