"""Roll and pitch of a vehicle that buoyancy, and its autopilot, hold nearly level."""

from __future__ import annotations

from dataclasses import dataclass
from math import radians


@dataclass(frozen=True, slots=True)
class TiltParameters:
    """A damped pendulum. Assumed: an ROV under way at 1.4 m/s, with 40 N ahead, lies bow up by some two degrees.

    Attributes:
        per_newton_rad: of the bow up for a force ahead, of starboard down for one to the right.
        frequency_radps: natural frequency.
        damping: 1.0 = critical.
    """

    per_newton_rad: float = radians(0.05)
    frequency_radps: float = 3.0
    damping: float = 0.7


LIGHT = TiltParameters()


class Tilt:
    """One of the two angles.

    Attributes:
        angle_rad: now.
        rate_radps: of its change.
    """

    def __init__(self, parameters: TiltParameters, angle_rad: float = 0.0) -> None:
        self._parameters = parameters
        self.angle_rad = angle_rad
        self.rate_radps = 0.0

    def step(self, force_n: float, period_s: float) -> None:
        """Advance under a force; damping and righting moment are taken implicitly, so that no step is too long."""
        frequency = self._parameters.frequency_radps
        off_rad = self._parameters.per_newton_rad * force_n - self.angle_rad
        damping = 2.0 * self._parameters.damping * frequency * period_s + (frequency * period_s) ** 2
        self.rate_radps = (self.rate_radps + frequency**2 * off_rad * period_s) / (1.0 + damping)
        self.angle_rad += self.rate_radps * period_s
