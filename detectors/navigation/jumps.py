"""Inertial sensors whose bias is another than it was. Nothing works without them: the filter goes on with it."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from detectors.navigation.blame import Suspicion
from detectors.navigation.sample import Sensor, Vector
from detectors.navigation.strapdown import Strapdown

FloatArray = NDArray[np.float64]

# So long after a jump, what seems wrong with others is what the jump has left behind.
SHAKEN_S = 60.0
# A jump is over when the bias is back within this share of it.
RECOVERED = 0.3


@dataclass(frozen=True, slots=True, eq=False)
class Jump:
    """A bias that is another: as it was found, and the bias before, (3,)."""

    found: Suspicion
    healthy: FloatArray

    def over(self, bias: Vector) -> bool:
        """The bias is what it was."""
        return bool(np.linalg.norm(bias - self.healthy) < RECOVERED * np.linalg.norm(self.found.size))


class Jumps:
    """Those of gyroscope and accelerometer."""

    def __init__(self) -> None:
        self._jumps: dict[Sensor, Jump] = {}
        self._newest_s = -inf

    @property
    def found(self) -> dict[Sensor, Suspicion]:
        """Those that are not over, as they were found."""
        return {sensor: jump.found for sensor, jump in self._jumps.items()}

    def shaken(self, time_s: float) -> bool:
        """The filter may still suffer from the newest."""
        return time_s - self._newest_s < SHAKEN_S

    def add(self, found: Suspicion, strapdown: Strapdown, time_s: float) -> None:
        """A jump, and the strapdown system before it was taken in."""
        sensor = found.sensor
        healthy = self._jumps[sensor].healthy if sensor in self._jumps else np.array(_bias(strapdown, sensor))
        self._jumps[sensor], self._newest_s = Jump(found, healthy), time_s

    def forgive(self, strapdown: Strapdown) -> None:
        """Forgets those that are over."""
        self._jumps = {
            sensor: jump for sensor, jump in self._jumps.items() if not jump.over(_bias(strapdown, sensor))
        }

    def clear(self) -> None:
        """What is there is normal from now on."""
        self._jumps.clear()


def _bias(strapdown: Strapdown, sensor: Sensor) -> Vector:
    """(3,) in rad/s or m/s2."""
    if sensor is Sensor.GYROSCOPE:
        return strapdown.gyroscope_bias_radps
    return strapdown.accelerometer_bias_mps2
