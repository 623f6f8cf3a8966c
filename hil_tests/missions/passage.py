"""A way through moving water, simulated or recorded: what sensors say of it, and what is true of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Passage:
    """One way, healthy or with a lasting loss of speed.

    Attributes:
        kind: the pattern of its course, or the recording it comes from.
        time_s: (N,) instants of the positions.
        north_m, east_m, down_m, heading_rad, pitch_rad: (N,) what the sensors say.
        true_position_m: (N, 2) north, east. true_heading_rad: (N,), not wrapped.
        true_speed_mps: (N,) through the water, along the heading.
        true_flow_mps: (N, 2) velocity of the water at the vehicle.
        speed_min_mps, speed_max_mps: normal speed, known beforehand (paper 002, assumption 3).
        loss: lasting relative loss of speed, 0.0 for a healthy way.
        onset_s: when the loss begins; NaN in a healthy one.
        noise_m, rate_hz: of the positions.
    """

    kind: str
    time_s: FloatArray
    north_m: FloatArray
    east_m: FloatArray
    down_m: FloatArray
    heading_rad: FloatArray
    pitch_rad: FloatArray
    true_position_m: FloatArray
    true_heading_rad: FloatArray
    true_speed_mps: FloatArray
    true_flow_mps: FloatArray
    speed_min_mps: float
    speed_max_mps: float
    loss: float
    onset_s: float
    noise_m: float
    rate_hz: float


def remaining(time_s: FloatArray, loss: float, onset_s: float, ramp_s: float) -> FloatArray:
    """(M,) share of the speed that is left, under a loss that grows for `ramp_s` from its onset on."""
    return np.asarray(1.0 - loss * np.clip((time_s - onset_s) / ramp_s, 0.0, 1.0))
