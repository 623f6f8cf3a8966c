"""A first guess of the DVL's delay and lever arm, from how its velocity changes in turns.

A delay of a second makes a turn that begins another turn: no derivative by the delay tells what to expect of it, and
a filter that trusts one learns nonsense, and is sure of it. So until one delay fits better than all others, several
are tried at once: for each the changes of velocity that the IMU felt, so much earlier, are compared with those of the
DVL, and what is left is explained, by least squares, with a lever arm and a constant error of the acceleration.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from math import exp

import numpy as np
from numpy.typing import NDArray

from detectors.navigation.sample import DvlSample, Vector

FloatArray = NDArray[np.float64]

EARLIEST_S, LATEST_S, STEP_S = -1.25, 2.0, 0.25
# Samples of the DVL that are compared are at least so far apart, so that noise is not all of their difference, and at
# most so far, so that the inertial one is none.
APART_S, TOGETHER_S = 0.9, 2.5
MOTION_S = 0.05
# Standard deviations: of a difference in velocity that a model explains, at least; of a lever arm; of an acceleration
# (tilt and bias).
LEAST_MPS, ARM_M, ACCELERATION_MPS2 = 0.015, 1.5, 0.15
# Before, the filter's attitude is still too wrong to tell gravity from acceleration.
ATTITUDE_S = 8.0
# A difference farther off than this is an outlier at any delay.
OUTLIER_MPS = 0.5
# The best delay is known when all that are not its neighbours fit worse by this, in squares of what it leaves over.
SURE = 60.0
NEIGHBOUR_S = 0.3
# Clocks drift apart: what was measured so long ago counts for a third.
MEMORY_S = 120.0


@dataclass(frozen=True, slots=True, eq=False)
class Guess:
    """What was found. `arm_m`: (3,), `covariance`: (3, 3) of it."""

    delay_s: float
    arm_m: FloatArray
    covariance: FloatArray


class DelaySearch:
    """Tries delays.

    Args:
        delay_s: about which they are tried.
        arm_m: (3,) about which lever arms are tried.
        noise_mps: of a component of the DVL's velocity.
    """

    def __init__(self, delay_s: float, arm_m: Vector, noise_mps: float) -> None:
        self._delays_s = delay_s + np.arange(EARLIEST_S, LATEST_S + 0.5 * STEP_S, STEP_S)
        self._variance = 2.0 * noise_mps**2 + LEAST_MPS**2
        self._count = 0.0
        count = len(self._delays_s)
        prior = np.array([ACCELERATION_MPS2] * 3 + [ARM_M] * 3) ** 2
        self._prior = np.tile(np.diag(self._variance / prior), (count, 1, 1))
        self._information = self._prior
        self._expected = np.array(arm_m)
        self._correlation = np.zeros((count, 6))
        self._squares = np.zeros(count)
        self._velocity = np.zeros(3)
        self._motion: deque[tuple[float, ...]] = deque(maxlen=round((LATEST_S - EARLIEST_S + 4.0) / MOTION_S))
        self._motion_s, self._began_s = -np.inf, np.inf
        self._samples: deque[DvlSample] = deque()
        self._before: DvlSample | None = None

    def move(self, time_s: float, acceleration_mps2: Vector, rate_radps: Vector, interval_s: float) -> None:
        """Takes how the body moves: (3,) change of velocity per second as the body sees it, and (3,) turn rate."""
        self._began_s = min(self._began_s, time_s)
        self._velocity = self._velocity + np.array(acceleration_mps2) * interval_s
        if time_s - self._motion_s >= MOTION_S:
            self._motion.append((time_s, *self._velocity.tolist(), *rate_radps))
            self._motion_s = time_s

    def measure(self, sample: DvlSample) -> None:
        """Takes a sample of the DVL."""
        if not self._samples or sample.time_s - self._samples[-1].time_s >= APART_S:
            self._samples.append(sample)
        while self._samples and self._samples[0].time_s - self._delays_s[0] < self._motion_s:
            now, before = self._samples.popleft(), self._before
            self._before = now
            if now.time_s < self._began_s + ATTITUDE_S:
                continue
            if before is not None and now.time_s - before.time_s < TOGETHER_S:
                self._compare(before, now)

    def guess(self) -> Guess | None:
        """The delay and what belongs to it, once it is known."""
        solved = np.linalg.solve(self._information, self._correlation[..., np.newaxis])[..., 0]
        left = self._squares - (self._correlation * solved).sum(axis=-1)
        best = int(np.argmin(left))
        variance = max(self._variance, float(left[best]) / max(3.0 * self._count, 1.0))
        costs = left / variance
        others = np.abs(self._delays_s - self._delays_s[best]) > NEIGHBOUR_S
        if not 0 < best < len(costs) - 1 or costs[others].min() < costs[best] + SURE:
            return None
        earlier, middle, later = costs[best - 1 : best + 2]
        shift = 0.5 * (earlier - later) / (earlier - 2.0 * middle + later)
        covariance = variance * np.linalg.inv(self._information[best])
        delay_s = float(self._delays_s[best] + STEP_S * shift)
        return Guess(delay_s, self._expected + solved[best, 3:], covariance[3:, 3:])

    def _compare(self, before: DvlSample, now: DvlSample) -> None:
        motion = np.array(self._motion)
        instants_s = np.array([[before.time_s], [now.time_s]]) - self._delays_s
        if instants_s.min() < motion[0, 0]:
            return
        columns = [np.interp(instants_s, motion[:, 0], column) for column in motion[:, 1:].T]
        velocity, rate = np.stack(columns[:3], axis=-1), np.stack(columns[3:], axis=-1)
        measured = np.array(now.velocity_mps) - before.velocity_mps
        turned = rate[1] - rate[0]
        left = measured - (velocity[1] - velocity[0]) - np.cross(turned, self._expected)
        if np.linalg.norm(left, axis=-1).min() > OUTLIER_MPS:
            return
        # left = interval * acceleration + turned x arm
        regressors = np.zeros((len(left), 3, 6))
        regressors[:, :, :3] = (now.time_s - before.time_s) * np.eye(3)
        regressors[:, :, 3:] = np.stack([np.cross(turned, axis) for axis in np.eye(3)], axis=-1)
        transposed = np.swapaxes(regressors, -1, -2)
        keep = exp((before.time_s - now.time_s) / MEMORY_S)
        self._information = self._prior + keep * (self._information - self._prior) + transposed @ regressors
        self._correlation = keep * self._correlation + (transposed @ left[..., np.newaxis])[..., 0]
        self._count = keep * self._count + 1.0
        self._squares = keep * self._squares + (left**2).sum(axis=-1)
