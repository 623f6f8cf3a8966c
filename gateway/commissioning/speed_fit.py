"""Speed through the water at each level of thrust, with what the current does taken out: one fit for all dives.

A Kalman filter whose states are the position, the speed at each level (and sideways, and in turns), which are the
same in all dives, and the current, which wanders and is another one in each dive. After the last position the
covariance of the speeds says how sure they are; where the vehicle never turned, that is: not at all (paper 002,
assumption 4). How much the positions scatter, how fast the current wanders and how slowly the hull follows its
thrusters is not known: filters for all combinations run side by side, and the most likely one wins.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from gateway.commissioning.speed_course import SLIP_LAGS_S, SURGE_S, Course, Levels

FloatArray = NDArray[np.float64]

# What is tried: scatter of a mean position (m); and in shares of the vehicle's speed, per square root of a second,
# how the current wanders and what the way itself is off by (waves, an unsteady hull).
NOISES_M = (0.01, 0.03, 0.1, 0.3, 1.0, 3.0)
WANDERINGS = (0.0003, 0.001, 0.003, 0.01, 0.03)
UNSTEADINESSES = (0.003, 0.01, 0.03, 0.1)
FIRST_SURGE_S = 1.2
# Standard deviations at the start, in shares of the vehicle's speed
SPEED_AT_START, FLOW_AT_START, SLIP_AT_START_S = 3.0, 1.5, 10.0
ANYWHERE_M = 1e4
# A position farther off than this, in standard deviations, is none; so many in a row are a jump of the track
OUTLIER, JUMP = 5.0, 3
# Eddies that a vehicle circles in, and the drift of a large hull in turns, pass for speed: a share of it, measured by
# `gateway bench commissioning`
MODEL_ERROR = 0.04


@dataclass(frozen=True, slots=True)
class Hypothesis:
    """What is not known beside the speeds.

    Attributes:
        surge: index into `SURGE_S`.
        noise_m, wandering, unsteadiness: see above.
    """

    surge: int
    noise_m: float
    wandering: float
    unsteadiness: float


@dataclass(frozen=True, slots=True, eq=False)
class SpeedFit:
    """What was found.

    Attributes:
        levels: of thrust.
        speed_mps, error_mps: (K,) speed at each, and its standard deviation.
        hypothesis: the likeliest.
        surge_time_s: with which the hull follows its thrusters.
        refused: positions that were off.
    """

    levels: Levels
    speed_mps: FloatArray
    error_mps: FloatArray
    hypothesis: Hypothesis
    refused: int

    @property
    def surge_time_s(self) -> float:
        """Time constant with which the hull follows its thrusters."""
        return SURGE_S[self.hypothesis.surge]

    @property
    def error(self) -> FloatArray:
        """(K,) standard deviations as shares of the speeds."""
        return self.error_mps / np.maximum(np.abs(self.speed_mps), 1e-3)


def fit_speed(courses: Sequence[Course], levels: Levels, scale_mps: float) -> SpeedFit:
    """The speeds that explain the ways of all dives best.

    Args:
        courses: of healthy dives.
        levels: that their ways are for.
        scale_mps: about the speed of the vehicle.

    Raises:
        ValueError: no levels, or a scale that is not above 0.
    """
    if not len(levels.commands) or not scale_mps > 0.0:
        raise ValueError(f"{len(levels.commands)} levels at about {scale_mps} m/s: want one or more, and above 0 m/s")
    surge = SURGE_S.index(FIRST_SURGE_S)
    grid = [Hypothesis(surge, *one) for one in product(NOISES_M, WANDERINGS, UNSTEADINESSES)]
    best = _likeliest(courses, levels, scale_mps, grid).hypothesis
    rest = (best.noise_m, best.wandering, best.unsteadiness)
    best = _likeliest(courses, levels, scale_mps, [Hypothesis(one, *rest) for one in range(len(SURGE_S))]).hypothesis
    return _likeliest(courses, levels, scale_mps, list(_neighbours(best)))


def _neighbours(best: Hypothesis) -> Iterable[Hypothesis]:
    """With half and twice of what was tried in steps of three."""
    for noise, wandering, unsteadiness in product((0.6, 1.0, 1.7), repeat=3):
        yield Hypothesis(
            best.surge, noise * best.noise_m, wandering * best.wandering, unsteadiness * best.unsteadiness
        )


def _likeliest(
    courses: Sequence[Course], levels: Levels, scale_mps: float, hypotheses: Sequence[Hypothesis]
) -> SpeedFit:
    filters = _Filters(hypotheses, levels, scale_mps)
    for course in courses:
        filters.follow(course)
    return filters.likeliest(levels)


class _Filters:
    """One filter for each hypothesis. States: position (2), speeds (K), sideways, slip in turns, current (2)."""

    def __init__(self, hypotheses: Sequence[Hypothesis], levels: Levels, scale_mps: float) -> None:
        self._hypotheses, self._scale_mps = hypotheses, scale_mps
        self._surges = np.array([one.surge for one in hypotheses])
        self._noise2 = np.array([one.noise_m for one in hypotheses]) ** 2
        self._wandering2 = (np.array([one.wandering for one in hypotheses]) * scale_mps) ** 2
        self._unsteadiness2 = (np.array([one.unsteadiness for one in hypotheses]) * scale_mps) ** 2
        speeds = np.full(len(levels.commands) + 1, SPEED_AT_START)
        slips = np.full(1 + len(SLIP_LAGS_S), SLIP_AT_START_S)
        start = np.concatenate((np.zeros(2), speeds, slips, np.zeros(2))) * scale_mps
        self._state = np.zeros((len(hypotheses), len(start)))
        self._covariance = np.tile(np.diag(start**2), (len(hypotheses), 1, 1))
        self._log_likelihood = np.zeros(len(hypotheses))
        self._off = np.zeros(len(hypotheses), dtype=np.int64)
        self._refused = np.zeros(len(hypotheses), dtype=np.int64)

    def follow(self, course: Course) -> None:
        """Takes one dive."""
        self._forget(slice(-2, None), (FLOW_AT_START * self._scale_mps) ** 2)
        interval_s = np.diff(course.time_s, prepend=course.time_s[:1])
        for index, position_m in enumerate(course.position_m):
            passed_s = float(interval_s[index])
            if course.begins[index]:
                self._wander(passed_s)
                self._forget(slice(2), ANYWHERE_M**2)
                self._state[:, :2] = position_m
                self._update(position_m, counts=False)
            else:
                self._predict(course.ways[index], passed_s)
                self._update(position_m, counts=True)

    def likeliest(self, levels: Levels) -> SpeedFit:
        """What the best of them has found."""
        best = int(np.argmax(self._log_likelihood))
        speeds = slice(2, 2 + len(levels.commands))
        speed_mps = self._state[best, speeds]
        variance = np.diag(self._covariance[best])[speeds] + (MODEL_ERROR * speed_mps) ** 2
        return SpeedFit(levels, speed_mps, np.sqrt(variance), self._hypotheses[best], int(self._refused[best]))

    def _forget(self, states: slice, variance: float) -> None:
        """These are unknown again, and have nothing to do with the rest."""
        self._state[:, states] = 0.0
        self._covariance[:, states, :] = 0.0
        self._covariance[:, :, states] = 0.0
        count = len(range(self._state.shape[1])[states])
        self._covariance[:, states, states] = variance * np.eye(count)

    def _wander(self, passed_s: float) -> None:
        self._covariance[:, -2:, -2:] += (self._wandering2 * passed_s)[:, None, None] * np.eye(2)

    def _predict(self, ways: FloatArray, passed_s: float) -> None:
        """position += ways * speeds + interval * current; (S, 2, K + 2) ways of all surge times."""
        own = ways[self._surges]
        transition = np.tile(np.eye(self._state.shape[1]), (len(own), 1, 1))
        transition[:, :2, 2:-2] = own
        transition[:, :2, -2:] = passed_s * np.eye(2)
        self._state = (transition @ self._state[..., None])[..., 0]
        self._covariance = transition @ self._covariance @ transition.transpose(0, 2, 1)
        # the current wanders during the interval as well: the integrals of a Wiener process
        wandered = (self._wandering2 * passed_s)[:, None, None] * np.eye(2)
        self._covariance[:, :2, :2] += wandered * passed_s**2 / 3.0
        self._covariance[:, :2, -2:] += 0.5 * passed_s * wandered
        self._covariance[:, -2:, :2] += 0.5 * passed_s * wandered
        self._covariance[:, :2, :2] += (self._unsteadiness2 * passed_s)[:, None, None] * np.eye(2)
        self._wander(passed_s)

    def _update(self, position_m: FloatArray, *, counts: bool) -> None:
        """Takes a position, coordinate by coordinate; one that is off only where it is off again and again."""
        off = position_m - self._state[:, :2]
        spread = self._covariance[:, (0, 1), (0, 1)] + self._noise2[:, None]
        wrong = (off**2 > OUTLIER**2 * spread).any(axis=1)
        jumped = wrong & (self._off >= JUMP - 1)
        self._off = np.where(wrong & ~jumped, self._off + 1, 0)
        self._refused += wrong
        self._covariance[jumped, :2, :2] += ANYWHERE_M**2 * np.eye(2)
        used = ~wrong | jumped
        for axis in range(2):
            column = self._covariance[:, axis, :]
            spread_ = column[:, axis] + self._noise2
            innovation = position_m[axis] - self._state[:, axis]
            if counts:
                squared = np.minimum(innovation**2 / spread_, OUTLIER**2)
                self._log_likelihood -= 0.5 * (squared + np.log(spread_)) * ~jumped
            gain = np.where(used[:, None], column / spread_[:, None], 0.0)
            self._state = self._state + gain * innovation[:, None]
            self._covariance = self._covariance - gain[:, :, None] * column[:, None, :]
