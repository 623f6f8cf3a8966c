"""What the speed detector wants, and what it says."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, nan, sin

import numpy as np
from numpy.typing import NDArray

from detectors.verdict import Verdict

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class PoseSample:
    """Where a vehicle is and where it heads, at one instant; at any and irregular intervals.

    Attributes:
        time_s: instant of the sample.
        north_m, east_m: position in a frame that does not move.
        heading_rad: true heading, clockwise from north; any number of turns.
        down_m: depth.
        pitch_rad: nose up is positive.
        command: thrust ahead that the thrusters were told since the sample before, as a share of their most, -1 to 1;
            None where not known.
        sideways: the same to the right.
    """

    time_s: float
    north_m: float
    east_m: float
    heading_rad: float
    down_m: float = 0.0
    pitch_rad: float = 0.0
    command: float | None = None
    sideways: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class SpeedVerdict(Verdict):
    """What the speed detector says of one sample.

    Attributes:
        speed_mps: speed through the water along the heading (paper 002, V_L); NaN while there is none.
        speed_error_mps: its standard deviation; infinite while the headings cannot tell it from the flow, NaN where
            the estimator gives none.
        flow_mps: (2,) or (3,) velocity of the water, north, east (and down) (paper 002, F_L).
        flag: paper 002, Algorithm 2: 0 no anomaly, 1 anomaly, 2 the estimate is not to be trusted.
        flow_error: paper 002, equation 14: p_E, between the learnt flow and the one that was foreseen, 0 to 1.
        speed_min_mps, speed_max_mps: the normal speed now; NaN while it is not known.
        reason: why the level is UNKNOWN, SUSPECT or FAULT, in a few words; empty when NORMAL.
    """

    speed_mps: float
    flow_mps: tuple[float, ...]
    flag: int
    speed_error_mps: float = nan
    flow_error: float = nan
    speed_min_mps: float = nan
    speed_max_mps: float = nan
    reason: str = ""


def position_of(sample: PoseSample, dimensions: int) -> FloatArray:
    """(D,) x: north, east (and down)."""
    return np.array((sample.north_m, sample.east_m, sample.down_m)[:dimensions])


def direction_of(sample: PoseSample, dimensions: int) -> FloatArray:
    """(D,) Psi_c of paper 002, equation 1: unit vector along the bow; in two dimensions along the heading."""
    heading, pitch = sample.heading_rad, sample.pitch_rad
    if dimensions == 2:
        return np.array((cos(heading), sin(heading)))
    return np.array((cos(heading) * cos(pitch), sin(heading) * cos(pitch), -sin(pitch)))
