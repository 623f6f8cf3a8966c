"""The way through the water between two positions, from headings and commands that may come more often."""

from __future__ import annotations

from math import cos, expm1, pi, remainder, sin

import numpy as np
from numpy.typing import NDArray

from detectors.speed.sample import PoseSample

FloatArray = NDArray[np.float64]


class Way:
    """Sums up how a vehicle of unit speed travels, from sample to sample.

    Between two samples the heading turns evenly the shorter way round, so that the way is an arc; the share of the
    reference speed follows the command as a first-order lag.

    Args:
        dimensions: D, 2 or 3.
        surge_time_s: time constant of that lag.

    Attributes:
        ahead_s, aside_s, turned: (D,) as in `Step`, since the last `restart`.
        share: of the reference speed now.
    """

    def __init__(self, dimensions: int, surge_time_s: float) -> None:
        self._dimensions = dimensions
        self._surge_time_s = surge_time_s
        self._last: PoseSample | None = None
        self.share = 1.0
        self._side_share = 0.0
        self.restart()

    def restart(self) -> None:
        """Counts from here."""
        self.ahead_s, self.aside_s, self.turned = np.zeros((3, self._dimensions))

    def begin(self, sample: PoseSample, share: float) -> None:
        """Takes the first sample, or the first after a gap: what was driven before it is not known."""
        self._last = sample
        self.share, self._side_share = share, sample.sideways
        self.restart()

    def rescale(self, factor: float) -> None:
        """The reference speed is another: the same share is so many times the number that it was."""
        self.share *= factor

    def extend(self, sample: PoseSample, share: float) -> None:
        """Goes on to a later sample.

        Args:
            sample: the later one.
            share: of the reference speed, that the thrusters were told to give since the sample before.
        """
        last = self._last
        if last is None:
            self.begin(sample, share)
            return
        interval_s = sample.time_s - last.time_s
        turn_rad = remainder(sample.heading_rad - last.heading_rad, 2.0 * pi)
        middle_rad = last.heading_rad + 0.5 * turn_rad
        chord = _sinc(0.5 * turn_rad)
        ahead_s, self.share = self._followed(self.share, share, interval_s)
        aside_s, self._side_share = self._followed(self._side_share, sample.sideways, interval_s)
        right = self._vector(-sin(middle_rad), cos(middle_rad), 0.0)
        pitch_rad = 0.5 * (last.pitch_rad + sample.pitch_rad)
        level = cos(pitch_rad)
        forward = self._vector(level * cos(middle_rad), level * sin(middle_rad), -sin(pitch_rad))
        self.ahead_s = self.ahead_s + chord * ahead_s * forward
        self.aside_s = self.aside_s + chord * aside_s * right
        self.turned = self.turned + chord * turn_rad * right
        self._last = sample

    def _followed(self, begins: float, wanted: float, interval_s: float) -> tuple[float, float]:
        """Integral of a first-order lag over the interval, and where it ends."""
        gone = -expm1(-interval_s / self._surge_time_s)
        integral_s = wanted * interval_s + (begins - wanted) * gone * self._surge_time_s
        return integral_s, begins + (wanted - begins) * gone

    def _vector(self, north: float, east: float, down: float) -> FloatArray:
        return np.array((north, east, down)[: self._dimensions])


def _sinc(angle_rad: float) -> float:
    """sin(x) / x: the chord of an arc of 2 x over its length."""
    return sin(angle_rad) / angle_rad if abs(angle_rad) > 1e-8 else 1.0
