"""What every estimator of speed and flow takes and gives."""

from __future__ import annotations

from dataclasses import dataclass
from math import nan
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Step:
    """The way from one position to the next; D is 2 or 3.

    The vehicle moves by `flow * interval_s + speed * ahead_s` (paper 002, equation 1, integrated), and a little
    aside.

    Attributes:
        time_s: of the position.
        interval_s: since the position before.
        position_m: (D,) north, east (and down).
        ahead_s: (D,) integral of the unit vector along the heading, times the share of the reference speed that the
            thrusters are to give (1 where that is not known): the way through the water for each m/s of speed.
        aside_s: (D,) the same to the right, by the sideways command; zero where there is none.
        turned: (D,) integral of the yaw rate times the unit vector to the right: which way a hull slips in a turn.
        position_noise_m: standard deviation of each coordinate of the position; NaN where it is not known.
    """

    time_s: float
    interval_s: float
    position_m: FloatArray
    ahead_s: FloatArray
    aside_s: FloatArray
    turned: FloatArray
    position_noise_m: float = nan


@dataclass(frozen=True, slots=True, eq=False)
class Estimate:
    """What is known after a step.

    Attributes:
        speed_mps: through the water, at the reference command.
        speed_error_mps: its standard deviation; NaN where the estimator has none.
        flow_mps: (D,) velocity of the water at the vehicle.
        flow_error_mps: standard deviation of its largest component; NaN where the estimator has none.
    """

    speed_mps: float
    speed_error_mps: float
    flow_mps: FloatArray
    flow_error_mps: float


class Estimator(Protocol):
    """Learns speed and flow from positions and headings. Picklable between steps, and then goes on bit for bit."""

    def begin(self, position_m: FloatArray, time_s: float) -> None:
        """Takes the first position, or the first after a jump or a gap: what is known of speed and flow is kept."""

    def update(self, step: Step) -> Estimate:
        """Takes a step."""

    def idle(self, interval_s: float) -> None:
        """No step is known for so long: what changes by itself has gone on meanwhile."""

    def rescale(self, factor: float) -> None:
        """From now on `ahead_s` counts in another unit: the same speed is this many times the number it was."""
