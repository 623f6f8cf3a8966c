"""The paper's law, integrated exactly (paper 002, equations 7-13, and 25-28 under input limits).

Over a step in which the vehicle moves evenly, and heading and basis stand for their mean, the law is linear, and
more: the parameters only move along the regressors, so that the error's parts along and across the heading are damped
oscillators, for which there is a closed form. It is stable at any sampling interval, where the paper's explicit step
rings at 1 s, and diverges where gain / (learning rate x sum of the regressors' squares) is shorter than the interval.
"""

from __future__ import annotations

from math import ceil, exp, isfinite, nan, sqrt

import numpy as np
from numpy.typing import NDArray

from detectors.speed.estimate import Estimate, Step
from detectors.speed.learnt_flow import LearntFlow
from detectors.speed.oscillator import Gains

FloatArray = NDArray[np.float64]

WAY_WIDTHS = 0.25  # longest piece of a step, in widths of the basis
TURN_RAD = 0.1  # and in phase of its fastest tide
SHARE_OF_RISE = 0.25  # and, where the speed is limited, in time constants of the law: it is linear on each side only
PIECES_MAX = 64


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
        speed_noise_max_mps: the same law runs slower where noisy positions, as far as their noise is known, would
            make the learnt speed err by more than this (standard deviation); None: never.

    Raises:
        ValueError: learning rate, gain or one of the last two not above 0, or the speed not finite.
    """

    def __init__(
        self,
        flow: LearntFlow,
        *,
        learning_rate: float = 0.8,
        gain: float = 1.0,
        speed_mps: float = 0.0,
        speed_limit_mps: float | None = None,
        speed_noise_max_mps: float | None = None,
    ) -> None:
        for name, value in (("speed_limit_mps", speed_limit_mps), ("speed_noise_max_mps", speed_noise_max_mps)):
            if value is not None and not (isfinite(value) and value > 0.0):
                raise ValueError(f"{name} = {value}: want above 0, or None")
        if not isfinite(speed_mps):
            raise ValueError(f"speed_mps = {speed_mps}: want a finite number")
        self._flow = flow
        self._gains = self._configured = Gains(learning_rate, gain)
        self._limit_mps, self._noise_max_mps = speed_limit_mps, speed_noise_max_mps
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
        self._gains = self._bearable(step)
        pieces = self._pieces(step)
        piece_s = step.interval_s / pieces
        for number in range(pieces):
            middle_s = (number + 0.5) * piece_s
            place = self._position_m + velocity * middle_s
            self._advance(piece_s, place, step.time_s - step.interval_s + middle_s, velocity, ahead)
        self._position_m = step.position_m
        self._flow.move(step.position_m, step.time_s)
        flow_mps = self._flow.velocity_mps(step.time_s, step.position_m)
        return Estimate(self._through_water_mps(), nan, flow_mps, nan)

    def _through_water_mps(self) -> float:
        """(3)"""
        return self._speed_mps if self._limit_mps is None else min(self._speed_mps, self._limit_mps)

    def _bearable(self, step: Step) -> Gains:
        """The gains with which the noise of the positions does not show too much in the speed."""
        noise_mps = self._configured.speed_noise_mps(step.position_noise_m, step.interval_s)
        if self._noise_max_mps is None or not noise_mps > self._noise_max_mps:
            return self._configured
        # a law that runs slower by a factor passes the noise on by its power of 3/2
        return self._configured.slowed((self._noise_max_mps / noise_mps) ** (2.0 / 3.0))

    def _pieces(self, step: Step) -> int:
        """How many pieces keep basis and limit from changing much within one."""
        way_m = float(np.hypot(*(step.position_m - self._position_m)[:2]))
        pieces = max(
            way_m / (WAY_WIDTHS * self._flow.finest_m), step.interval_s * self._flow.fastest_radps / TURN_RAD
        )
        if self._limit_mps is not None:
            rise_per_s = self._gains.gain + sqrt(self._gains.learning_rate)
            pieces = max(pieces, step.interval_s * rise_per_s / SHARE_OF_RISE)
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
        across = self._gains.oscillator(interval_s, of_flow)
        along = self._gains.oscillator(interval_s, of_flow + of_speed)
        drive = velocity - foreseen
        onto = np.outer(ahead, ahead) / reach if reach > 0.0 else np.zeros((len(ahead), len(ahead)))
        error_across, amount_across = across.after(self._error - onto @ self._error, drive - onto @ drive)
        error_along, amount_along = along.after(onto @ self._error, onto @ drive)
        amount = self._gains.learning_rate * (amount_across + amount_along)
        self._error = error_across + error_along
        self._flow.learn(values, amount)  # (27), and (12)
        self._speed_mps += float(amount @ ahead)  # (28), and (13)
        self._drift_by_limit(interval_s, 0.5 * (beyond_before_mps + self._beyond_limit_mps()) * ahead)

    def _beyond_limit_mps(self) -> float:
        """-delta u, by the learnt speed."""
        return self._speed_mps - self._through_water_mps()

    def _drift_by_limit(self, interval_s: float, beyond: FloatArray) -> None:
        """(25)"""
        left = exp(-self._gains.gain * interval_s)
        self._error_by_limit = left * self._error_by_limit - (1.0 - left) / self._gains.gain * beyond
