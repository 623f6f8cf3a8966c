"""Where a vehicle heads: zig-zag, lawnmower, circle, turned at the rates of real vehicles."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

FloatArray = NDArray[np.float64]
Kind = Literal["zig-zag", "lawnmower", "circle"]
KINDS: tuple[Kind, ...] = get_args(Kind)

ZIG_ZAG_LEG_S = (10.0, 40.0)
ZIG_ZAG_ANGLE_DEG = (20.0, 60.0)  # to either side of the base course
LAWNMOWER_LEG_S = (20.0, 80.0)
LAWNMOWER_STEP_S = (5.0, 15.0)  # across, from one long leg to the next
CIRCLE_S = (20.0, 120.0)
TURN_RATE_DPS = (5.0, 20.0)
TURN_LAG_S = (0.3, 1.0)  # of the yaw rate
LEG_SPREAD = 0.25  # legs of one mission differ by so much, relative
STRAIGHT_DPS = 0.3  # a slower turn counts as none


@dataclass(frozen=True, slots=True, eq=False)
class Course:
    """Heading over time.

    Attributes:
        kind: of its pattern.
        heading_rad: (M,) true heading, not wrapped.
        yaw_rate_radps: (M,)
    """

    kind: Kind
    heading_rad: FloatArray
    yaw_rate_radps: FloatArray

    @property
    def straight(self) -> NDArray[np.bool_]:
        """(M,) where the vehicle does not turn."""
        return np.asarray(np.abs(self.yaw_rate_radps) < np.radians(STRAIGHT_DPS))


def random_course(rng: np.random.Generator, kind: Kind, time_s: FloatArray) -> Course:
    """A course of this kind at (M,) evenly spaced instants."""
    base_rad = rng.uniform(-np.pi, np.pi)
    lag_s = rng.uniform(*TURN_LAG_S)
    told_rad = base_rad + _PATTERNS[kind](rng, time_s)
    share = -np.expm1(-(time_s[1] - time_s[0]) / lag_s)
    start = [(1.0 - share) * told_rad[0]]
    heading_rad = np.asarray(lfilter([share], [1.0, share - 1.0], told_rad, zi=start)[0])
    return Course(kind, heading_rad, np.gradient(heading_rad, time_s))


def _zig_zag(rng: np.random.Generator, time_s: FloatArray) -> FloatArray:
    angle_rad = np.radians(rng.uniform(*ZIG_ZAG_ANGLE_DEG))
    legs_s = _legs(rng, ZIG_ZAG_LEG_S, time_s)
    sides = np.where(np.arange(len(legs_s)) % 2, 1.0, -1.0)
    return _held_and_turned(rng, time_s, angle_rad * sides, legs_s)


def _lawnmower(rng: np.random.Generator, time_s: FloatArray) -> FloatArray:
    legs_s = _legs(rng, LAWNMOWER_LEG_S, time_s)
    legs_s[1::2] = rng.uniform(*LAWNMOWER_STEP_S)
    side = rng.choice([-1.0, 1.0])
    quarters = np.array([0.0, 1.0, 2.0, 1.0])[np.arange(len(legs_s)) % 4]  # out, across, back, across
    return _held_and_turned(rng, time_s, side * quarters * np.pi / 2.0, legs_s)


def _circle(rng: np.random.Generator, time_s: FloatArray) -> FloatArray:
    turn_s = rng.uniform(*CIRCLE_S) * rng.choice([-1.0, 1.0])
    return np.asarray(2.0 * np.pi * time_s / turn_s)


_PATTERNS: dict[Kind, Callable[[np.random.Generator, FloatArray], FloatArray]] = {
    "zig-zag": _zig_zag,
    "lawnmower": _lawnmower,
    "circle": _circle,
}


def _legs(rng: np.random.Generator, bounds_s: tuple[float, float], time_s: FloatArray) -> FloatArray:
    """Durations, about alike within a mission; of as many legs as the time can hold of the shortest kind of leg."""
    count = int(np.ceil(time_s[-1] / LAWNMOWER_STEP_S[0])) + 1
    return np.asarray(
        np.clip(rng.uniform(*bounds_s) * rng.uniform(1.0 - LEG_SPREAD, 1.0 + LEG_SPREAD, count), *bounds_s)
    )


def _held_and_turned(
    rng: np.random.Generator, time_s: FloatArray, headings_rad: FloatArray, legs_s: FloatArray
) -> FloatArray:
    """Each heading for as long as its leg lasts, and turns at a constant rate between them."""
    rate_radps = np.radians(rng.uniform(*TURN_RATE_DPS))
    turns_s = np.abs(np.diff(headings_rad, append=headings_rad[-1])) / rate_radps
    ends_s = np.cumsum(np.column_stack([legs_s, turns_s]).ravel())  # of leg, turn, leg, turn, ...
    begin_s = rng.uniform(0.0, legs_s[0])  # somewhere on the first leg
    knots_s = np.concatenate([[0.0], ends_s[:-1]]) - begin_s
    return np.asarray(np.interp(time_s, knots_s, np.repeat(headings_rad, 2)))
