"""What the default method has learnt of a thruster: curve, delay, lag, and how far each of them is known."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from detectors.thruster.curve import CommandBasis, combine

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class Response:
    """One way in which the speed may follow the command: Hammerstein model, a static curve and then a lag.

    Attributes:
        delay: transport delay, samples.
        lag: time constant, samples.
        coefficients: (K,) of the static curve, in top speeds.
    """

    delay: int
    lag: float
    coefficients: FloatArray


NEAR_NEUTRAL = 0.1  # full scales: a thruster that was driven so slowly is known down to standstill
NEXT_TO = 0.07  # of a learnt command: what is no farther outside counts as learnt


@dataclass(frozen=True, slots=True)
class TransientError:
    """Error of the model while the speed changes.

    Attributes:
        share: part of the change that it errs by, ...
        seen: ... as seen in changes up to this one.
        unseen_share: part of what is beyond that it may err by.
    """

    share: float
    seen: float
    unseen_share: float

    def at(self, change: FloatArray) -> FloatArray:
        """Error in changes of (N,) sizes."""
        beyond = np.maximum(change - self.seen, 0.0)
        return self.share * (change - beyond) + self.unseen_share * beyond


@dataclass(frozen=True, slots=True, eq=False)
class ThrusterModel:
    """A learnt thruster. Speeds are in parts of `top_rpm` unless said otherwise.

    Attributes:
        basis: the columns of the static curve.
        response: the best one found.
        alternatives: other delays and lags that explain the window nearly as well: where they disagree, the model
            does not know.
        order, window: the choice of the search.
        top_rpm: speed that everything is scaled by.
        supply_exponent: relative change of speed over relative change of supply voltage, 0.0 where not measured.
        supply_v: supply voltage that the curve holds for, NaN where not measured.
        whitener: (K + 1, K + 1) W with W'W the covariance of coefficients and supply exponent.
        noise: standard deviation of the measured speed.
        correlation: of neighbouring residuals, 0 to below 1.
        spin_up, spin_down: error of the lag model on the way to a faster and to a slower target.
        timing: error by a command that is stamped later than the motor had it, of the first step towards its target.
        learnt_ahead, learnt_astern: (2,) least and greatest magnitude of command, from neutral, that the window held
            often enough.
        unsigned: whether the sensor gives the magnitude of the speed only.
        resolution_rpm: the smallest step of the speed sensor.
        current_law: (2,) idle current and current over (speed / top speed)^3, A; NaN where not measured.
    """

    basis: CommandBasis
    response: Response
    alternatives: tuple[Response, ...]
    order: int
    window: int
    top_rpm: float
    supply_exponent: float
    supply_v: float
    whitener: FloatArray
    noise: float
    correlation: float
    spin_up: TransientError
    spin_down: TransientError
    timing: TransientError
    learnt_ahead: tuple[float, float]
    learnt_astern: tuple[float, float]
    unsigned: bool
    resolution_rpm: float
    current_law: tuple[float, float]

    def speed_rpm(self, command: FloatArray) -> FloatArray:
        """(N,) steady speed at (N,) commands, at the supply voltage `supply_v`."""
        speed = combine(self.response.coefficients[None, :], self.basis.columns(command))[0]
        return np.asarray(speed * self.top_rpm)

    def deviation_rpm(self, command: FloatArray) -> FloatArray:
        """(N,) standard deviation of the curve at (N,) commands."""
        return np.asarray(self._deviation(self.basis.columns(command)) * self.top_rpm)

    def _deviation(self, columns: FloatArray) -> FloatArray:
        deviation: FloatArray = np.sqrt((combine(self.whitener[:, :-1], columns) ** 2).sum(axis=0))
        return deviation

    def doubt(self, command: FloatArray) -> FloatArray:
        """(N,) standard deviation of the curve over its speed at (N,) commands; infinite where the speed is 0."""
        columns = self.basis.columns(command)
        deviation = self._deviation(columns)
        speed = np.abs(combine(self.response.coefficients[None, :], columns)[0])
        relative: FloatArray = np.divide(deviation, speed, out=np.full_like(speed, np.inf), where=speed > 0.0)
        return relative

    def learnt_commands(self, points: int) -> FloatArray:
        """(N,) commands across what was learnt astern and ahead, increasing: so many of each direction."""
        astern, ahead = _spread(self.learnt_astern, points), _spread(self.learnt_ahead, points)
        return np.concatenate([-astern[::-1], ahead]) + self.basis.neutral

    def knows(self, command: FloatArray) -> NDArray[np.bool_]:
        """(N,) whether each command lies among those that were learnt; neutral always does."""
        relative = command - self.basis.neutral
        magnitude = np.abs(relative)
        low = np.where(relative < 0.0, self.learnt_astern[0], self.learnt_ahead[0])
        low = np.where(low <= NEAR_NEUTRAL * self.basis.scale, 0.0, low * (1.0 - NEXT_TO))
        high = np.where(relative < 0.0, self.learnt_astern[1], self.learnt_ahead[1]) * (1.0 + NEXT_TO)
        return np.asarray((relative == 0.0) | ((magnitude >= low) & (magnitude <= high)))


def _spread(learnt: tuple[float, float], points: int) -> FloatArray:
    """Magnitudes of command from the least to the greatest; none where none was learnt."""
    low, high = learnt
    if high < low:
        return np.empty(0)
    return np.linspace(low, high, points) if high > low else np.array([low])
