"""The default estimator: Kalman filters for calm water, changing water and a changing vehicle, that interact.

A head current that sets in and a hull that is caught in weeds look the same on a straight course. One filter must call
it one or the other, by its own settings; three of them, each with its own idea of what changes now, weigh the two
against each other, and where the headings cannot tell, the doubt stays in the covariance of their mixture, until the
vehicle turns. After H. A. P. Blom and Y. Bar-Shalom, The interacting multiple model algorithm for systems with Markovian
switching coefficients, IEEE Transactions on Automatic Control 33 (1988).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, sqrt

import numpy as np
from numpy.typing import NDArray

from detectors.speed.estimate import Estimate, Step

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Regime:
    """What changes, and how fast, as random walks; in shares of the vehicle's speed scale.

    Attributes:
        flow: of each component of the flow, per square root of a second.
        speed: of the speed through the water, likewise.
        lasts_s: mean time until another regime begins.
        leads_to: share of these beginnings that each regime has.
    """

    flow: float
    speed: float
    lasts_s: float
    leads_to: tuple[float, float, float]


# Healthy speeds waver by some per cent, currents turn over with the tide and vary over some hundred metres: calm. A
# current sets in, or something catches the vehicle, within seconds; that is rare, and each is as likely as the other.
REGIMES = (
    Regime(flow=0.005, speed=0.002, lasts_s=400.0, leads_to=(0.0, 0.5, 0.5)),
    Regime(flow=0.2, speed=0.002, lasts_s=3.0, leads_to=(0.8, 0.0, 0.2)),
    Regime(flow=0.005, speed=0.2, lasts_s=3.0, leads_to=(0.8, 0.2, 0.0)),
)
BEGIN_IN = (0.6, 0.2, 0.2)
LEAST_PROBABILITY = 1e-6  # a regime that was ruled out long ago must be able to come back

# Standard deviations at the start, in shares of the speed scale
SPEED_AT_START = 0.6
FLOW_AT_START = 1.5
ASIDE_AT_START = 0.3  # speed to the right at full sideways thrust
SLIP_AT_START = 0.1  # speed to the right at 1 rad/s of yaw rate, times 1 s
SLIP_WALK = 0.002  # per square root of a second

LONGEST_S = 1e4  # a gap beyond which it makes no difference how long it was


class InteractingEstimator:
    """Speed and flow with their covariance, from a mixture of Kalman filters.

    Each filter's state is position (D), speed, sideways speed at full sideways thrust, slip in turns, flow (D); the
    position counts from the last measured one, so that large coordinates cost no accuracy.

    Args:
        dimensions: D, 2 or 3.
        speed_scale_mps: about the vehicle's usual speed; what it begins with.
        flow_error_mps: standard deviation of a component of the flow at the start, where an outside model was taken
            off the positions; None: unknown flow.
    """

    def __init__(self, dimensions: int, speed_scale_mps: float, flow_error_mps: float | None = None) -> None:
        self._d, self._scale = dimensions, speed_scale_mps
        self._flow = slice(dimensions + 3, 2 * dimensions + 3)
        size, filters = 2 * dimensions + 3, len(REGIMES)
        start = np.zeros(size)
        start[dimensions:] = SLIP_AT_START
        start[dimensions], start[dimensions + 1] = SPEED_AT_START, ASIDE_AT_START
        start *= speed_scale_mps
        flow_mps = FLOW_AT_START * speed_scale_mps if flow_error_mps is None else flow_error_mps
        start[self._flow] = flow_mps
        self._state = np.zeros((filters, size))
        self._state[:, dimensions] = speed_scale_mps
        self._covariance = np.tile(np.diag(start**2), (filters, 1, 1))
        self._probability = np.array(BEGIN_IN)
        # a model that is good to some cm/s leaves no room for a current that sets in with more
        walk_limit = min(1.0, flow_mps / (speed_scale_mps * REGIMES[1].flow * sqrt(REGIMES[1].lasts_s)))
        self._flow_walk2 = (np.array([one.flow for one in REGIMES]) * speed_scale_mps * walk_limit) ** 2
        self._speed_walk2 = (np.array([one.speed for one in REGIMES]) * speed_scale_mps) ** 2
        self._position_m = np.zeros(dimensions)

    def begin(self, position_m: FloatArray, time_s: float) -> None:
        """See `Estimator`."""
        self._position_m = position_m
        self._state[:, : self._d] = 0.0
        self._covariance[:, : self._d, :] = 0.0
        self._covariance[:, :, : self._d] = 0.0

    def idle(self, interval_s: float) -> None:
        """See `Estimator`."""
        d, gap_s = self._d, min(interval_s, LONGEST_S)
        self._covariance[:, d, d] += self._speed_walk2[0] * gap_s
        for axis in range(d + 3, 2 * d + 3):
            self._covariance[:, axis, axis] += self._flow_walk2[0] * gap_s

    def rescale(self, factor: float) -> None:
        """See `Estimator`."""
        change = np.ones(2 * self._d + 3)
        change[self._d] = factor
        self._state *= change
        self._covariance *= np.outer(change, change)

    def update(self, step: Step) -> Estimate:
        """See `Estimator`; the step must say how much its position scatters."""
        d = self._d
        predicted = self._mix(step.interval_s)
        state, covariance = self._predict(step)
        moved = step.position_m - self._position_m
        innovation = moved - state[:, :d]
        spread = covariance[:, :d, :d] + step.position_noise_m**2 * np.eye(d)
        inverse = np.linalg.inv(spread)
        gain = covariance[:, :, :d] @ inverse
        state = state + (gain @ innovation[:, :, None])[:, :, 0]
        covariance = covariance - gain @ covariance[:, :d, :]
        distance2 = np.einsum("ji,jik,jk->j", innovation, inverse, innovation)
        log_likelihood = -0.5 * (distance2 + np.log(np.linalg.det(spread)))
        weight = predicted * np.exp(log_likelihood - log_likelihood.max())
        weight = np.maximum(weight / weight.sum(), LEAST_PROBABILITY)
        self._probability = weight / weight.sum()
        state[:, :d] -= moved
        self._position_m = step.position_m
        self._state, self._covariance = state, 0.5 * (covariance + covariance.transpose(0, 2, 1))
        return self._estimate()

    def _mix(self, interval_s: float) -> FloatArray:
        """Each filter begins with the mixture of all that may have led to its regime; returns their probabilities."""
        moves = np.array([one.leads_to for one in REGIMES])
        stay = np.array([exp(-interval_s / one.lasts_s) for one in REGIMES])
        moves = moves * (1.0 - stay)[:, None] + np.diag(stay)
        predicted: FloatArray = self._probability @ moves
        share = self._probability[:, None] * moves / predicted  # (from, to)
        mean = share.T @ self._state
        off = self._state[:, None, :] - mean[None, :, :]  # (from, to, state)
        between = np.einsum("ij,ijn,ijp->jnp", share, off, off)
        self._covariance = np.tensordot(share.T, self._covariance, axes=1) + between
        self._state = mean
        return predicted

    def _predict(self, step: Step) -> tuple[FloatArray, FloatArray]:
        """Moves on by the step: position += ahead * speed + aside * sideways speed + turned * slip + flow * time."""
        d, time_s = self._d, step.interval_s
        transition = np.eye(2 * d + 3)
        transition[:d, d : d + 3] = np.stack([step.ahead_s, step.aside_s, step.turned], axis=1)
        transition[:d, self._flow] = time_s * np.eye(d)
        state = self._state @ transition.T
        covariance = transition @ self._covariance @ transition.T
        covariance[:, d, d] += self._speed_walk2 * time_s
        covariance[:, d + 2, d + 2] += (SLIP_WALK * self._scale) ** 2 * time_s
        # the random walks' share in the position: integrals of a Wiener process
        along = self._speed_walk2[:, None] * step.ahead_s / 2.0 * time_s
        covariance[:, :d, d] += along
        covariance[:, d, :d] += along
        covariance[:, :d, :d] += (
            self._speed_walk2[:, None, None] * np.outer(step.ahead_s, step.ahead_s) * time_s / 3.0
        )
        for axis in range(d):
            flow = d + 3 + axis
            covariance[:, flow, flow] += self._flow_walk2 * time_s
            covariance[:, axis, flow] += self._flow_walk2 * time_s**2 / 2.0
            covariance[:, flow, axis] += self._flow_walk2 * time_s**2 / 2.0
            covariance[:, axis, axis] += self._flow_walk2 * time_s**3 / 3.0
        return state, covariance

    def _estimate(self) -> Estimate:
        """Mean and covariance of the mixture."""
        d, weight = self._d, self._probability
        mean = weight @ self._state
        variance = weight @ (np.diagonal(self._covariance, axis1=1, axis2=2) + (self._state - mean) ** 2)
        return Estimate(
            speed_mps=float(mean[d]),
            speed_error_mps=sqrt(max(float(variance[d]), 0.0)),
            flow_mps=mean[self._flow],
            flow_error_mps=sqrt(max(float(variance[self._flow].max()), 0.0)),
        )
