"""The paper's law, integrated exactly (paper 002, equations 7-13, and 25-28 under input limits).

Over a step in which the vehicle moves evenly, and heading and basis stand for their mean, the law is linear, and
more: the parameters only move along the regressors, so that the error's parts along and across the heading are damped
oscillators, for which there is a closed form. It is stable at any sampling interval, where the paper's explicit step
rings at 1 s and diverges from 2 / gain on.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, cos, cosh, exp, isfinite, nan, sin, sinh, sqrt

import numpy as np
from numpy.typing import NDArray

from detectors.speed.estimate import Estimate, Step
from detectors.speed.learnt_flow import LearntFlow

FloatArray = NDArray[np.float64]

WAY_WIDTHS = 0.25  # longest piece of a step, in widths of the basis
TURN_RAD = 0.1  # and in phase of its fastest tide
SHARE_OF_RISE = 0.25  # and, where the speed is limited, in time constants of the law: it is linear on each side only
PIECES_MAX = 64
_STIFFNESS_MIN = 1e-6  # of gain squared; less cannot be told from none, and is divided by


class AdaptiveEstimator:
    """The adaptive law of paper 002 as an `Estimator`.

    With a limit u_0 (equations 2 and 3) the learnt V_L is the speed that is asked for; what goes through the water is
    min(V_L, u_0), and the law corrects by the error less what the limit explains of it (25-28). The paper's delta u
    needs the true V_R; taken here is V_L, its estimate.

    Args:
        flow: where xi is learnt.
        learning_rate: gamma of equations 12 and 13, 1/s^2.
        gain: K of equation 9, times the identity, 1/s.
        speed_mps: V_L at the start.
        speed_limit_mps: u_0; None: no limit.

    Raises:
        ValueError: learning rate, gain or limit not above 0, or the speed not finite.
    """

    def __init__(
        self,
        flow: LearntFlow,
        *,
        learning_rate: float = 0.8,
        gain: float = 1.0,
        speed_mps: float = 0.0,
        speed_limit_mps: float | None = None,
    ) -> None:
        limits = {} if speed_limit_mps is None else {"speed_limit_mps": speed_limit_mps}
        for name, value in {"learning_rate": learning_rate, "gain": gain, **limits}.items():
            if not (isfinite(value) and value > 0.0):
                raise ValueError(f"{name} = {value}: want above 0")
        if not isfinite(speed_mps):
            raise ValueError(f"speed_mps = {speed_mps}: want a finite number")
        self._flow = flow
        self._learning_rate, self._gain, self._limit_mps = learning_rate, gain, speed_limit_mps
        self._speed_mps = speed_mps
        self._error = np.zeros(flow.dimensions)  # epsilon (26); e itself where there is no limit
        self._error_by_limit = np.zeros(flow.dimensions)  # e_delta (25)
        self._position_m = np.zeros(flow.dimensions)

    @property
    def flow(self) -> LearntFlow:
        """What is learnt of the flow; `frozen` keeps it."""
        return self._flow

    @property
    def localisation_error_m(self) -> FloatArray:
        """(D,) e = x - z, the controlled Lagrangian localisation error."""
        return self._error + self._error_by_limit

    @property
    def asked_speed_mps(self) -> float:
        """V_L before the limit."""
        return self._speed_mps

    def begin(self, position_m: FloatArray, time_s: float) -> None:
        """As `Estimator.begin`: z = x."""
        self._position_m = position_m
        self._error = np.zeros_like(self._error)
        self._error_by_limit = np.zeros_like(self._error)
        self._flow.move(position_m, time_s)

    def idle(self, interval_s: float) -> None:
        """As `Estimator.idle`: the law knows no uncertainty that could grow."""

    def rescale(self, factor: float) -> None:
        """As `Estimator.rescale`."""
        self._speed_mps *= factor

    def update(self, step: Step) -> Estimate:
        """As `Estimator.update`. The speed's error is NaN: the law has none."""
        velocity = (step.position_m - self._position_m) / step.interval_s
        ahead = step.ahead_s / step.interval_s
        pieces = self._pieces(step)
        piece_s = step.interval_s / pieces
        for before_s in (np.arange(pieces) * piece_s).tolist():
            middle_s = before_s + 0.5 * piece_s
            place = self._position_m + velocity * middle_s
            self._advance(piece_s, place, step.time_s - step.interval_s + middle_s, velocity, ahead)
        self._position_m = step.position_m
        self._flow.move(step.position_m, step.time_s)
        flow_mps = self._flow.velocity_mps(step.time_s, step.position_m)
        return Estimate(self._through_water_mps(), nan, flow_mps, nan)

    def _through_water_mps(self) -> float:
        """(3)"""
        return self._speed_mps if self._limit_mps is None else min(self._speed_mps, self._limit_mps)

    def _pieces(self, step: Step) -> int:
        """How many pieces keep basis and limit from changing much within one."""
        way_m = float(np.hypot(*(step.position_m - self._position_m)[:2]))
        pieces = max(
            way_m / (WAY_WIDTHS * self._flow.finest_m), step.interval_s * self._flow.fastest_radps / TURN_RAD
        )
        if self._limit_mps is not None:
            pieces = max(pieces, step.interval_s * (self._gain + sqrt(self._learning_rate)) / SHARE_OF_RISE)
        return max(1, ceil(min(pieces, PIECES_MAX)))

    def _advance(
        self, interval_s: float, place: FloatArray, time_s: float, velocity: FloatArray, ahead: FloatArray
    ) -> None:
        """One piece of (26-28), with basis and heading as at its middle."""
        self._flow.move(place, time_s)
        values = self._flow.values(place, time_s)
        foreseen = self._flow.velocity_mps(time_s, place) + self._through_water_mps() * ahead
        beyond_before_mps = self._beyond_limit_mps()
        reach = float(ahead @ ahead)
        of_flow = float(values @ values)
        of_speed = reach if beyond_before_mps == 0.0 else 0.0  # beyond the limit V_L moves nothing
        across = self._oscillator(interval_s, of_flow)
        along = self._oscillator(interval_s, of_flow + of_speed)
        drive = velocity - foreseen
        onto = np.outer(ahead, ahead) / reach if reach > 0.0 else np.zeros((len(ahead), len(ahead)))
        error_across, amount_across = across.after(self._error - onto @ self._error, drive - onto @ drive)
        error_along, amount_along = along.after(onto @ self._error, onto @ drive)
        amount = self._learning_rate * (amount_across + amount_along)
        self._error = error_across + error_along
        self._flow.learn(values, amount)  # (27), and (12)
        self._speed_mps += float(amount @ ahead)  # (28), and (13)
        self._drift_by_limit(interval_s, 0.5 * (beyond_before_mps + self._beyond_limit_mps()) * ahead)

    def _beyond_limit_mps(self) -> float:
        """-delta u, by the learnt speed."""
        return self._speed_mps - self._through_water_mps()

    def _drift_by_limit(self, interval_s: float, beyond: FloatArray) -> None:
        """(25)"""
        left = exp(-self._gain * interval_s)
        self._error_by_limit = left * self._error_by_limit - (1.0 - left) / self._gain * beyond

    def _oscillator(self, interval_s: float, reach: float) -> _Oscillator:
        stiffness = max(self._learning_rate * reach, _STIFFNESS_MIN * self._gain**2)
        return _Oscillator.over(interval_s, self._gain, stiffness)


@dataclass(frozen=True, slots=True)
class _Oscillator:
    """e'' + K e' + k e = 0 over an interval: s(t) is its answer to e = 0, e' = 1.

    Attributes:
        answer: s.
        slope: s'.
        area: integral of s.
    """

    answer: float
    slope: float
    area: float

    @classmethod
    def over(cls, interval_s: float, damping: float, stiffness: float) -> _Oscillator:
        half = 0.5 * damping
        discriminant = half**2 - stiffness
        rate = sqrt(abs(discriminant))
        phase = rate * interval_s
        decay = exp(-half * interval_s)
        if phase < 1e-6:
            answer, even = interval_s * decay, decay
        elif discriminant < 0.0:
            answer, even = decay * sin(phase) / rate, decay * cos(phase)
        elif phase < 20.0:
            answer, even = decay * sinh(phase) / rate, decay * cosh(phase)
        else:  # sinh and cosh would overflow while their product with the decay does not
            even = 0.5 * exp(phase - half * interval_s)
            answer = even / rate
        slope = even - half * answer
        return cls(answer, slope, (1.0 - slope - damping * answer) / stiffness)

    def after(self, error: FloatArray, drive: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The error at the end, and its integral over the interval, where e' is `drive` less K e at the start."""
        return self.slope * error + self.answer * drive, self.answer * error + self.area * drive
