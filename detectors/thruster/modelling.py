"""Online modelling (paper 000, section 4.3): from the latest samples to a delay, an order, a window and a curve."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np
from numpy.typing import NDArray

from detectors.thruster.delay import align, estimate_delay
from detectors.thruster.fitness import Candidates
from detectors.thruster.polynomial import SpeedCurve
from detectors.thruster.search import SearchName, search_named

FloatArray = NDArray[np.float64]

THRESHOLD_SIGMAS = 5.0  # automatic threshold, in standard deviations of a prediction
SENSOR_PRECISION = 1e-3  # no RPM sensor is taken to be finer than this part of the speed


@dataclass(frozen=True, slots=True)
class OnlineModel:
    """One online modelling's result: the curve, and the delay in samples that it is used with.

    Attributes:
        resolution_rpm: finest that the speed sensor can tell apart.
    """

    curve: SpeedCurve
    delay: int
    resolution_rpm: float

    def no_noisier_than(self, other: OnlineModel) -> OnlineModel:
        """This model with at most the noise of the other: noise belongs to sensor and sea, and a fault adds none.

        For a model learnt from samples of before and after a fault, whose own residuals are the fault itself.
        """
        noise_rpm = min(self.curve.noise_rpm, other.curve.noise_rpm)
        return replace(self, curve=replace(self.curve, noise_rpm=noise_rpm))

    def covers(self, command: float) -> bool:
        """Whether the curve is known better at this (delayed) command than from a single measurement of it.

        Every command of the model's own window is covered. Elsewhere an automatic threshold would grow with the
        leverage until no fault were seen: there the model must be learnt anew.
        """
        return self.curve.leverage(command) <= 1.0

    def threshold_rpm(self, command: float) -> float:
        """Residual beyond which a sample at this (delayed) command no longer comes from this model.

        Five standard deviations of the measurement less the prediction, which is the noise widened by the leverage of
        a command that the window held little of; never below what the sensor can resolve.
        """
        sigma_rpm = self.curve.noise_rpm * sqrt(1.0 + self.curve.leverage(command))
        return max(THRESHOLD_SIGMAS * sigma_rpm, self.resolution_rpm)


class OnlineModelling:
    """Latest samples, and the model learnt from them: delay, alignment, order and window, curve (section 4.3).

    Args:
        order_max: highest order q_max of the polynomial.
        delay_max: longest transport delay, in samples.
        window_min, window_max: fewest and most samples to fit, w_min and w_max.
        search: how order and window are chosen.
        seed: of the swarm's random numbers.

    Raises:
        ValueError: an argument out of range.
    """

    def __init__(
        self, *, order_max: int, delay_max: int, window_min: int, window_max: int, search: SearchName, seed: int
    ) -> None:
        _check(order_max, delay_max, window_min, window_max)
        self._order_max, self._delay_max = order_max, delay_max
        self._window_min, self._window_max = window_min, window_max
        self._search = search_named(
            search, order_max=order_max, window_min=window_min, window_max=window_max, seed=seed
        )
        self._commands: deque[float] = deque(maxlen=window_max + delay_max)
        self._speeds: deque[float] = deque(maxlen=window_max + delay_max)
        self._delay = 0

    def append(self, command: float, speed_rpm: float) -> None:
        """Take the newest sample in; the oldest beyond the reach of any window is forgotten."""
        self._commands.append(command)
        self._speeds.append(speed_rpm)

    @property
    def ready(self) -> bool:
        """Whether there are samples enough for the shortest window at the longest delay."""
        return len(self._commands) >= self._window_min + self._delay_max

    def command_before(self, delay: int) -> float:
        """The command `delay` samples before the newest sample."""
        return self._commands[-1 - delay]

    def learn(self) -> OnlineModel:
        """Steps 2-5 of section 4.3 on the latest samples."""
        command, speed_rpm = np.array(self._commands), np.array(self._speeds)
        self._delay = estimate_delay(command, speed_rpm, self._delay_max, default=self._delay)
        candidates = Candidates(
            *align(command, speed_rpm, self._delay),
            order_max=self._order_max,
            window_min=self._window_min,
            window_max=self._window_max,
        )
        choice = self._search(candidates)
        return OnlineModel(candidates.model(choice.order, choice.window), self._delay, _resolution_rpm(speed_rpm))


def _resolution_rpm(speed_rpm: FloatArray) -> float:
    """What the sensor can tell apart: the smallest step between two of its speeds, at least 0.1 % of the greatest.

    A sensor may have given a single speed so far, zero even (then 1 rpm), and is none the finer for it.
    """
    steps = np.diff(np.unique(speed_rpm))
    smallest = float(steps.min()) if len(steps) else 0.0
    return max(smallest, SENSOR_PRECISION * float(np.abs(speed_rpm).max())) or 1.0


def _check(order_max: int, delay_max: int, window_min: int, window_max: int) -> None:
    if not 1 <= order_max < window_min:
        raise ValueError(f"order_max = {order_max}: want 1..{window_min - 1}, below window_min")
    if delay_max < 0:
        raise ValueError(f"delay_max = {delay_max}: want 0 or more samples")
    if not 2 <= window_min <= window_max:
        raise ValueError(f"window_min = {window_min}, window_max = {window_max}: want 2 <= window_min <= window_max")
