"""How an autopilot's navigation filter sees the vehicle: aided by a DVL or acoustic fixes, never quite right."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import exp, isfinite, radians, sqrt

import numpy as np

from hil_tests.rig.vehicle import Motion


@dataclass(frozen=True, slots=True)
class PositionReset:
    """A jump of the position that the filter reports, for good: it was given a new fix, or has changed its core.

    Raises:
        ValueError: a number is not finite.
    """

    onset_s: float
    north_m: float
    east_m: float

    def __post_init__(self) -> None:
        for name, value in (("onset_s", self.onset_s), ("north_m", self.north_m), ("east_m", self.east_m)):
            if not isfinite(value):
                raise ValueError(f"{name} = {value}: want a finite number")


@dataclass(frozen=True, slots=True, kw_only=True)
class NavigationErrors:
    """Errors of position and heading, as standard deviations; the defaults are of a filter aided by a DVL.

    Attributes:
        white_m: of north and east each, anew at every estimate.
        wandering_m: of a part that wanders slowly.
        wandering_s: time within which it forgets where it was.
        heading_rad: anew at every estimate.
        tilt_rad: of roll and pitch each, anew at every estimate.
        resets: jumps of the position.

    Raises:
        ValueError: a standard deviation is negative, or the time not above zero.
    """

    white_m: float = 0.03
    wandering_m: float = 0.1
    wandering_s: float = 60.0
    heading_rad: float = radians(0.5)
    tilt_rad: float = radians(0.2)
    resets: Sequence[PositionReset] = ()

    def __post_init__(self) -> None:
        for name in ("white_m", "wandering_m", "heading_rad", "tilt_rad"):
            value = getattr(self, name)
            if not (isfinite(value) and value >= 0.0):
                raise ValueError(f"{name} = {value}: want a standard deviation, 0 or more")
        if not self.wandering_s > 0.0:
            raise ValueError(f"wandering_s = {self.wandering_s}: want seconds above 0")


EXACT = NavigationErrors(white_m=0.0, wandering_m=0.0, heading_rad=0.0, tilt_rad=0.0)


class NavigationFilter:
    """What the autopilot takes for the truth.

    Args:
        errors: how wrong it is.
        seed: of the noise.
    """

    def __init__(self, errors: NavigationErrors, seed: int) -> None:
        self._errors = errors
        self._random = np.random.default_rng(seed)
        self._wandered_m = errors.wandering_m * self._random.standard_normal(2)
        self._off_m = self._wandered_m
        self._off_rad = 0.0
        self._tilting = np.random.default_rng([seed, 4])
        self._tilted_rad = errors.tilt_rad * self._tilting.standard_normal(2)
        self._last_s = 0.0

    def advance(self, time_s: float) -> None:
        """Make the next estimate; `time_s`, since the start, must not go back."""
        errors = self._errors
        self._wander(time_s - self._last_s)
        self._last_s = time_s
        jumps = [(reset.north_m, reset.east_m) for reset in errors.resets if time_s >= reset.onset_s]
        noise_m = errors.white_m * self._random.standard_normal(2)
        self._off_m = self._wandered_m + noise_m + np.sum(jumps, axis=0, initial=0.0)
        self._off_rad = errors.heading_rad * float(self._random.standard_normal())
        self._tilted_rad = errors.tilt_rad * self._tilting.standard_normal(2)

    def seen(self, motion: Motion) -> Motion:
        """How a motion looks with the errors of the newest estimate."""
        north_m, east_m = (float(part) for part in self._off_m)
        roll_rad, pitch_rad = (float(part) for part in self._tilted_rad)
        return replace(
            motion,
            north_m=motion.north_m + north_m,
            east_m=motion.east_m + east_m,
            yaw_rad=motion.yaw_rad + self._off_rad,
            roll_rad=motion.roll_rad + roll_rad,
            pitch_rad=motion.pitch_rad + pitch_rad,
        )

    def _wander(self, interval_s: float) -> None:
        """Gauss-Markov process of first order, exact over any interval."""
        kept = exp(-interval_s / self._errors.wandering_s)
        fresh_m = self._errors.wandering_m * sqrt(1.0 - kept**2)
        self._wandered_m = kept * self._wandered_m + fresh_m * self._random.standard_normal(2)
