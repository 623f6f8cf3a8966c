"""Thruster commands in the units of the wire (PWM us, percent, volts, counts), and as a fraction of full thrust."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]

# Autopilots and ESCs overshoot their nominal range a little (a trimmed servo output, a rounded voltage): that is full
# thrust. Farther out it is no command but a wrong scale, a wrong signal or a damaged frame.
MAX_OVERSHOOT = 0.05


@dataclass(frozen=True, slots=True)
class CommandScale:
    """How a command on the wire maps to -1.0 (full reverse) .. 1.0 (full ahead).

    Attributes:
        minimum, neutral, maximum: in the unit of the wire. `neutral` equal to one end: one direction only.
        dead_band: |value - neutral| up to which the thruster stands still, in the unit of the wire.
        reverse: True where a value above neutral drives astern.

    Raises:
        ValueError: not finite, not in order, or a dead band that leaves no range.
    """

    minimum: float
    neutral: float
    maximum: float
    dead_band: float = 0.0
    reverse: bool = False

    def __post_init__(self) -> None:
        if not all(map(math.isfinite, (self.minimum, self.neutral, self.maximum, self.dead_band))):
            raise ValueError(f"command scale must be finite numbers, got {self}")
        if not self.minimum < self.maximum:
            raise ValueError(f"minimum must be below maximum, got minimum={self.minimum}, maximum={self.maximum}")
        if not self.minimum <= self.neutral <= self.maximum:
            raise ValueError(f"neutral must lie in {self.minimum}..{self.maximum}, got {self.neutral}")
        narrowest = min(side for side in (self.neutral - self.minimum, self.maximum - self.neutral) if side > 0.0)
        if not 0.0 <= self.dead_band < narrowest:
            raise ValueError(f"dead_band must be at least 0 and below {narrowest}, got {self.dead_band}")

    def fraction(self, value: float) -> float | None:
        """Command as a fraction of full thrust, each side of neutral scaled by its own half-range.

        Args:
            value: in the unit of the wire.

        Returns:
            -1.0..1.0, exactly 0.0 within the dead band; None where the value is not finite, or out of the range by
            more than 5 % of its span, which no command is.
        """
        minimum, neutral, maximum = self.minimum, self.neutral, self.maximum
        if not minimum <= value <= maximum:  # NaN, too
            overshoot = MAX_OVERSHOOT * (maximum - minimum)
            if not minimum - overshoot <= value <= maximum + overshoot:
                return None
            value = minimum if value < minimum else maximum
        offset = value - neutral
        if abs(offset) <= self.dead_band:
            return 0.0
        fraction = offset / (maximum - neutral if offset > 0.0 else neutral - minimum)
        return -fraction if self.reverse else fraction

    def fractions(self, values: FloatArray) -> FloatArray:
        """`fraction` of many commands, bit for bit.

        Args:
            values: (N,) in the unit of the wire; NaN where there is none.

        Returns:
            (N,) -1.0..1.0, NaN where `fraction` gives None.
        """
        overshoot = MAX_OVERSHOOT * (self.maximum - self.minimum)
        inside = (self.minimum - overshoot <= values) & (values <= self.maximum + overshoot)
        offset = np.minimum(np.maximum(values, self.minimum), self.maximum) - self.neutral
        half_range = np.where(offset > 0.0, self.maximum - self.neutral, self.neutral - self.minimum)
        fractions = np.zeros(len(values))
        moving = np.abs(offset) > self.dead_band
        np.divide(offset, -half_range if self.reverse else half_range, out=fractions, where=moving)
        fractions[~inside] = np.nan
        return fractions

    def value(self, fraction: float) -> float:
        """Command in the unit of the wire, the inverse of `fraction` outside the dead band.

        Args:
            fraction: -1.0..1.0.

        Raises:
            ValueError: not in -1.0..1.0, or in a direction that the scale does not have.
        """
        if not -1.0 <= fraction <= 1.0:
            raise ValueError(f"fraction must lie in -1.0..1.0, got {fraction}")
        ahead = -fraction if self.reverse else fraction
        half_range = self.maximum - self.neutral if ahead > 0.0 else self.neutral - self.minimum
        if ahead != 0.0 and half_range == 0.0:
            raise ValueError(f"fraction {fraction} asks for a direction that {self} does not have")
        return self.neutral + ahead * half_range
