"""The default estimator: Kalman filters for calm water, changing water and a changing vehicle, that interact.

A head current that sets in and a hull that is caught in weeds look the same on a straight course. One filter must
call it one or the other, by its own settings; several of them, each with its own idea of what changes now, weigh the
two against each other, and where the headings cannot tell, the doubt stays in the covariance of their mixture, until
the vehicle turns. After H. A. P. Blom and Y. Bar-Shalom, The interacting multiple model algorithm for systems with
Markovian switching coefficients, IEEE Transactions on Automatic Control 33 (1988).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import expm1, sqrt

import numpy as np
from numpy.typing import NDArray

from detectors.speed.estimate import Estimate, Step

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Regime:
    """What changes, and how fast, as random walks; in shares of the speed scale, per square root of a second.

    Attributes:
        flow: of each component of the flow.
        flow_ahead: of its component along the heading, beyond that.
        speed: of the speed through the water.
        lasts_s: mean time until another regime begins.
    """

    flow: float
    flow_ahead: float
    speed: float
    lasts_s: float


# Healthy speeds waver by some per cent and currents turn over with the tide: calm. The water may vary from place to
# place, or a current set in within seconds; weeds may grow along, or a net be caught within seconds. Vehicles stem
# currents and follow channels, so that one that changes right ahead is nothing rare: on a straight course it is the
# twin of a speed that changes, and only a turn speaks for one of them.
_CALM, _WAVERS = 0.005, 0.002
REGIMES = {
    "calm": Regime(_CALM, 0.0, _WAVERS, lasts_s=400.0),
    "flow varies": Regime(0.04, 0.0, _WAVERS, lasts_s=40.0),
    "flow varies ahead": Regime(_CALM, 0.05, _WAVERS, lasts_s=20.0),
    "speed varies": Regime(_CALM, 0.0, 0.05, lasts_s=20.0),
    "flow jumps": Regime(0.1, 0.0, _WAVERS, lasts_s=6.0),
    "flow jumps ahead": Regime(_CALM, 0.1, _WAVERS, lasts_s=6.0),
    "speed jumps": Regime(_CALM, 0.0, 0.1, lasts_s=6.0),
}
LEADS_TO = np.array(  # (from, to) share of the beginnings
    [
        [0.0, 0.1, 0.1, 0.1, 0.2, 0.25, 0.25],
        [0.5, 0.0, 0.05, 0.05, 0.2, 0.1, 0.1],
        [0.5, 0.1, 0.0, 0.1, 0.1, 0.1, 0.1],
        [0.5, 0.1, 0.1, 0.0, 0.1, 0.1, 0.1],
        [0.65, 0.2, 0.025, 0.025, 0.0, 0.05, 0.05],
        [0.65, 0.05, 0.15, 0.05, 0.05, 0.0, 0.05],
        [0.65, 0.05, 0.05, 0.15, 0.05, 0.05, 0.0],
    ]
)
BEGIN_IN = np.array((0.3, 0.2, 0.1, 0.1, 0.1, 0.1, 0.1))
IDLE = list(REGIMES).index("flow varies")  # a vehicle that was not followed for a while is in other water
LASTS_S = np.array([one.lasts_s for one in REGIMES.values()])
LEAST_PROBABILITY = 1e-6  # a regime that was ruled out long ago must be able to come back

# Where the water changes on and on, an eddy that the vehicle circles in may pass for speed: after such water no speed
# is known better than to this share, times the part of the last seconds in which it changed
RESTLESS = np.array([name.startswith("flow") for name in REGIMES], dtype=np.float64)
RESTLESS_ERROR = 0.4
RESTLESS_S = 30.0

# A heading is off by so much, the same way for so long; what is off for ever is taken for slip or flow
HEADING_ERROR_RAD, HEADING_ERROR_LASTS_S = 0.02, 2.0
# Waves, an unsteady hull, a position that was filtered before it came here: a walk, in shares of the speed scale and
# per square root of a second; and in turns, when all of it is worst, so many seconds of the way for each radian
MOTION_ERROR, TURN_ERROR_S = 0.015, 0.12

# Standard deviations at the start, in shares of the speed scale
SPEED_AT_START = 0.6
FLOW_AT_START = 1.5
ASIDE_AT_START = 0.3  # speed to the right at full sideways thrust
SLIP_AT_START = 10.0  # speed to the right at 1 rad/s of yaw rate: half a hull's length, in seconds of its way
SLIP_WALK = 0.002  # per square root of a second

# How far the first position may be off, as the way of so many seconds: it says nothing yet, the second one does
ANYWHERE_S = 1e3
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
        d = self._d = dimensions
        self._scale = speed_scale_mps
        self._unit_mps = speed_scale_mps  # the vehicle's usual speed, in the unit that `ahead_s` counts in
        size, filters = 2 * d + 3, len(REGIMES)
        flow_mps = FLOW_AT_START * speed_scale_mps if flow_error_mps is None else flow_error_mps
        others = (SPEED_AT_START, ASIDE_AT_START, SLIP_AT_START, *[flow_mps / speed_scale_mps] * d)
        start = np.array((*[0.0] * d, *others)) * speed_scale_mps
        self._state = np.zeros((filters, size))
        self._state[:, d] = speed_scale_mps
        self._covariance = np.tile(np.diag(start**2), (filters, 1, 1))
        self._probability = BEGIN_IN
        # a model that is good to some cm/s leaves no room for a current that sets in with more
        jump = REGIMES["flow jumps"]
        limit = min(1.0, flow_mps / (speed_scale_mps * jump.flow * sqrt(jump.lasts_s)))
        walks = np.array([(one.speed, 0.0, SLIP_WALK, *[limit * one.flow] * d) for one in REGIMES.values()])
        self._walk2 = (walks * speed_scale_mps) ** 2  # (filters, d + 3) variance that each second adds
        ahead = np.array([limit * one.flow_ahead for one in REGIMES.values()])
        self._ahead_walk2 = (ahead * speed_scale_mps) ** 2  # (filters,) of the flow along the heading
        self._diagonal = np.arange(d, size)
        self._position_m = np.zeros(d)
        self._restless = 0.0

    def begin(self, position_m: FloatArray, time_s: float) -> None:
        """See `Estimator`."""
        self._position_m = position_m
        self._state[:, : self._d] = 0.0
        self._covariance[:, : self._d, :] = 0.0
        self._covariance[:, :, : self._d] = 0.0
        position = np.arange(self._d)
        self._covariance[:, position, position] = (ANYWHERE_S * self._scale) ** 2

    def idle(self, interval_s: float) -> None:
        """See `Estimator`."""
        idle2 = self._walk2[IDLE] * min(interval_s, LONGEST_S)
        self._covariance[:, self._diagonal, self._diagonal] += idle2

    def rescale(self, factor: float) -> None:
        """See `Estimator`."""
        change = np.ones(2 * self._d + 3)
        change[self._d] = factor
        self._state *= change
        self._covariance *= np.outer(change, change)
        self._unit_mps *= factor
        self._walk2[:, 0] *= factor**2
        self._ahead_walk2 *= factor**2

    def update(self, step: Step) -> Estimate:
        """See `Estimator`; the step must say how much its position scatters."""
        predicted = self._mix(step.interval_s)
        self._predict(step)
        moved = step.position_m - self._position_m
        log_likelihood = self._correct(moved, step.position_noise_m**2)
        weight = predicted * np.exp(log_likelihood - log_likelihood.max())
        weight = np.maximum(weight / weight.sum(), LEAST_PROBABILITY)
        self._probability = weight / weight.sum()
        self._state[:, : self._d] -= moved
        self._position_m = step.position_m
        self._restless += (float(self._probability @ RESTLESS) - self._restless) * -expm1(
            -step.interval_s / RESTLESS_S
        )
        return self._estimate()

    def _mix(self, interval_s: float) -> FloatArray:
        """Each filter begins with the mixture of all that may have led to its regime; returns their probabilities."""
        stay = np.exp(-interval_s / LASTS_S)
        moves = LEADS_TO * (1.0 - stay)[:, None] + np.diag(stay)
        predicted: FloatArray = self._probability @ moves
        share = (self._probability[:, None] * moves / predicted).T  # (to, from)
        mean = share @ self._state
        off = self._state - mean[:, None, :]  # (to, from, state)
        between = (share[:, :, None] * off).transpose(0, 2, 1) @ off
        count, size = self._state.shape
        within = share @ self._covariance.reshape(count, size * size)
        self._covariance = within.reshape(count, size, size) + between
        self._state = mean
        return predicted

    def _predict(self, step: Step) -> None:
        """Moves on: position += ahead * speed + aside * sideways speed + turned * slip + interval * flow."""
        d, time_s = self._d, step.interval_s
        ways = np.column_stack((step.ahead_s, step.aside_s, step.turned, time_s * np.eye(d)))  # (d, d + 3)
        transition = np.eye(2 * d + 3)
        transition[:d, d:] = ways
        self._state = self._state @ transition.T
        covariance = transition @ self._covariance @ transition.T
        # the random walks, and their share in the position: integrals of a Wiener process
        walked = ways * (0.5 * time_s * self._walk2)[:, None, :]
        covariance[:, :d, :d] += walked @ (ways.T * (2.0 / 3.0))
        covariance[:, :d, d:] += walked
        covariance[:, d:, :d] += walked.transpose(0, 2, 1)
        covariance[:, self._diagonal, self._diagonal] += time_s * self._walk2
        self._covariance = covariance
        self._spread(step)

    def _spread(self, step: Step) -> None:
        """What depends on the way: a flow that changes along it, and what the way itself is off by."""
        d, time_s = self._d, step.interval_s
        along = np.outer(step.ahead_s, step.ahead_s)
        walked = (self._ahead_walk2 / time_s)[:, None, None] * along
        self._covariance[:, d + 3 :, d + 3 :] += walked
        self._covariance[:, :d, d + 3 :] += 0.5 * time_s * walked
        self._covariance[:, d + 3 :, :d] += 0.5 * time_s * walked
        lasting = max(HEADING_ERROR_LASTS_S / time_s, 1.0)
        across = lasting * HEADING_ERROR_RAD**2 * (float(np.trace(along)) * np.eye(d) - along)
        other = MOTION_ERROR**2 * time_s + TURN_ERROR_S**2 * float(step.turned @ step.turned)
        unknown = self._unit_mps**2 * across + self._scale**2 * other * np.eye(d)
        self._covariance[:, :d, :d] += time_s**2 / 3.0 * walked + unknown

    def _correct(self, moved_m: FloatArray, noise2: float) -> FloatArray:
        """Takes the position; coordinates err independently, hence one after the other. Returns log likelihoods."""
        log_likelihood = np.zeros(len(self._state))
        for axis in range(self._d):
            column = self._covariance[:, axis, :]
            spread = column[:, axis] + noise2
            innovation = moved_m[axis] - self._state[:, axis]
            gain = column / spread[:, None]
            self._state = self._state + gain * innovation[:, None]
            self._covariance = self._covariance - gain[:, :, None] * column[:, None, :]
            log_likelihood -= 0.5 * (innovation**2 / spread + np.log(spread))
        return log_likelihood

    def _estimate(self) -> Estimate:
        """Mean and covariance of the mixture."""
        d, weight = self._d, self._probability
        mean = weight @ self._state
        variance = weight @ (self._covariance.diagonal(axis1=1, axis2=2) + (self._state - mean) ** 2)
        restless_mps = RESTLESS_ERROR * self._restless * self._unit_mps
        return Estimate(
            speed_mps=float(mean[d]),
            speed_error_mps=sqrt(max(float(variance[d]), 0.0) + restless_mps**2),
            flow_mps=mean[d + 3 :],
            flow_error_mps=sqrt(max(float(variance[d + 3 :].max()), 0.0)),
        )
