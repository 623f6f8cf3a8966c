"""The damped oscillators that the adaptive law of paper 002 comes apart into."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, cosh, exp, isfinite, sin, sinh, sqrt

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

_STIFFNESS_MIN = 1e-6  # of the gain squared; less cannot be told from none, and is divided by


@dataclass(frozen=True, slots=True)
class Oscillator:
    """e'' + K e' + k e = 0 over an interval: s(t) is its answer to e = 0, e' = 1.

    Attributes:
        answer: s.
        slope: s'.
        area: integral of s.
    """

    answer: float
    slope: float
    area: float

    @classmethod
    def over(cls, interval_s: float, damping: float, stiffness: float) -> Oscillator:
        half = 0.5 * damping
        discriminant = half**2 - stiffness
        rate = sqrt(abs(discriminant))
        phase = rate * interval_s
        decay = exp(-half * interval_s)
        if phase < 1e-6:
            answer, even = interval_s * decay, decay
        elif discriminant < 0.0:
            answer, even = decay * sin(phase) / rate, decay * cos(phase)
        elif phase < 20.0:
            answer, even = decay * sinh(phase) / rate, decay * cosh(phase)
        else:  # sinh and cosh would overflow while their product with the decay does not
            even = 0.5 * exp(phase - half * interval_s)
            answer = even / rate
        slope = even - half * answer
        return cls(answer, slope, (1.0 - slope - damping * answer) / stiffness)

    def after(self, error: FloatArray, drive: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The error at the end, and its integral over the interval, where e' is `drive` less K e at the start."""
        return self.slope * error + self.answer * drive, self.answer * error + self.area * drive


@dataclass(frozen=True, slots=True)
class Gains:
    """Learning rate and gain of the law.

    Attributes:
        learning_rate: gamma of equations 12 and 13, 1/s^2.
        gain: K of equation 9, times the identity, 1/s.

    Raises:
        ValueError: one of them not above 0.
    """

    learning_rate: float
    gain: float

    def __post_init__(self) -> None:
        for name in ("learning_rate", "gain"):
            value = getattr(self, name)
            if not (isfinite(value) and value > 0.0):
                raise ValueError(f"{name} = {value}: want above 0")

    def slowed(self, factor: float) -> Gains:
        """The same law in a time that runs at `factor` (0 to 1) of the speed."""
        return Gains(self.learning_rate * factor**2, self.gain * factor)

    def speed_noise_mps(self, position_noise_m: float, interval_s: float) -> float:
        """Standard deviation of V_L by that of each coordinate of independent positions.

        Positions of the spectral density n^2 T_s pass the transfer function gamma s / (s^2 + K s + gamma) to V_L.
        """
        return self.learning_rate * position_noise_m * sqrt(interval_s / (2.0 * self.gain))

    def oscillator(self, interval_s: float, reach: float) -> Oscillator:
        """Of the error along a direction into which parameters reach: the sum of their regressors' squares."""
        stiffness = max(self.learning_rate * reach, _STIFFNESS_MIN * self.gain**2)
        return Oscillator.over(interval_s, self.gain, stiffness)
