"""A sensor whose measurements are not used, until it has agreed with the rest for a while."""

from __future__ import annotations

from dataclasses import replace
from math import inf

import numpy as np
from numpy.typing import NDArray

from detectors.navigation.innovation import Innovation
from detectors.navigation.ratio import LikelihoodRatio
from detectors.navigation.sample import FaultKind, Sensor, Vector

FloatArray = NDArray[np.float64]

# Squared size of an innovation in standard deviations, for each component: above it, it contradicts.
CONTRADICTS = 9.0
LEAST_SAMPLES = 5
# Times that an isolated sensor begins to contradict again: it comes and goes.
COMES_AND_GOES = 2
# It had gone if the error was less than this share of what it was; more only agrees with dead reckoning's doubt.
CAME_BACK = 0.3
# How its error is followed: seconds that a line through it needs, samples that it has at most, and how much of it
# must be slope to be a drift.
LINE_S, LINE_SAMPLES = 4.0, 64
DRIFTS = 0.6
# A drift goes on while it has this share of the rate at which it surely was one.
GOES_ON = 0.5


class Probation:
    """What the filter would know if it used the isolated sensor again, since some instant.

    Alone, a sample says little: dead reckoning grows so uncertain that nearly everything agrees with it. Used again,
    a sensor that still drifts betrays itself within seconds.

    Args:
        sensor: on probation.
        covariance: (N, N) of the filter.

    Attributes:
        error: (N,) of the filter's states, as the sensor shows it. covariance: (N, N) of what is left then.
        agreed: number of samples so far.
    """

    def __init__(self, sensor: Sensor, covariance: FloatArray) -> None:
        self.error, self.covariance = np.zeros(len(covariance)), covariance.copy()
        self.agreed = 0
        self._sensor = sensor
        self._ratio = LikelihoodRatio()

    def update(self, innovation: Innovation, *, isolated: bool) -> float:
        """Takes an innovation, of the sensor on probation (`isolated`) or another.

        Returns:
            How much it contradicts: squared standard deviations for each component.
        """
        transition, observation = innovation.transition, innovation.observation
        self.error = transition @ self.error
        self.covariance = transition @ self.covariance @ transition.T + innovation.process
        values = innovation.values - observation @ self.error
        covariance = observation @ self.covariance @ observation.T + innovation.noise
        used = isolated or innovation.gain is not None
        gain = self.covariance @ observation.T @ np.linalg.inv(covariance) if used else None
        own = replace(innovation, values=values, covariance=covariance, gain=gain)
        self._ratio.update(own)
        if gain is not None:
            self.error = self.error + gain @ values
            kept = np.eye(len(self.error)) - gain @ observation
            self.covariance = kept @ self.covariance @ kept.T + gain @ innovation.noise @ gain.T
        if innovation.gain is not None:
            self.error = self.error - innovation.gain @ innovation.values
        self.agreed += isolated
        return own.squared / len(values)

    def doubt(self) -> float:
        """Twice the logarithm of the likelihood ratio of a fault of the sensor since the beginning."""
        explanations = self._ratio.explanations()
        return max((one.ratio for one in explanations if one.family.sensor is self._sensor), default=0.0)


class Isolation:
    """What is known of a sensor since its measurements are not used.

    Args:
        sensor: which.
        kind: how it seemed to fail. size: its error, (3,). rate: at which it grows, per second.

    Attributes:
        kind, size, rate: as seen by now.
        probation: what it would say if it were used again; None while it contradicts.
    """

    def __init__(self, sensor: Sensor, kind: FaultKind, size: Vector, rate: float) -> None:
        self.kind, self.size, self.rate = kind, size, rate
        self.probation: Probation | None = None
        self._sensor = sensor
        self._agrees_since_s = inf
        self._relapses, self._came_back = 0, False
        self._line: list[tuple[float, FloatArray]] = []
        # rate when last it was surely a drift; the newest would follow one that ends down to nothing
        self._grew = rate if kind is FaultKind.DRIFT else inf

    def call(self, kind: FaultKind) -> None:
        """It fails as its own samples show."""
        self.kind, self.rate = kind, 0.0

    def update(self, innovation: Innovation, filtered: FloatArray, *, own: bool, sound: bool, limit: float) -> None:
        """Takes an innovation.

        Args:
            innovation: of any sensor.
            filtered: (N, N) covariance of the filter's states after it.
            own: it is the isolated sensor's.
            sound: nothing shows in the sensor's samples themselves.
            limit: ratio at which a fault is suspected.
        """
        if own:
            self._follow(innovation)
        if self.probation is not None:
            off = self.probation.update(innovation, isolated=own)
            if own and (not sound or off > CONTRADICTS or self.probation.doubt() > limit):
                self._relapses += self._came_back
                self.probation, self._agrees_since_s = None, inf
                if self._relapses >= COMES_AND_GOES and self.kind is FaultKind.STEP:
                    self.kind = FaultKind.INTERMITTENT
        elif own and sound and innovation.squared < CONTRADICTS * len(innovation.values):
            self.probation = Probation(self._sensor, filtered)
            self._came_back = bool(np.linalg.norm(innovation.values) < CAME_BACK * np.linalg.norm(self.size))
            self._agrees_since_s = innovation.time_s

    def healed(self, time_s: float, healthy_s: float) -> bool:
        """It has agreed for so long, and in enough samples."""
        agreed = 0 if self.probation is None else self.probation.agreed
        return agreed >= LEAST_SAMPLES and time_s - self._agrees_since_s >= healthy_s

    def _follow(self, innovation: Innovation) -> None:
        """Size and kind from the line through the innovations, which nothing corrects any more."""
        values = innovation.values
        if innovation.squared < CONTRADICTS * len(values):
            return
        x, y, z = values.tolist() if len(values) == 3 else (0.0, 0.0, float(values[0]))
        self.size = (x, y, z)
        if self.kind not in (FaultKind.STEP, FaultKind.DRIFT, FaultKind.SCALE):
            return
        self._line = [*self._line[1 - LINE_SAMPLES :], (innovation.time_s, values)]
        times_s = np.array([time_s for time_s, _ in self._line])
        if times_s[-1] - times_s[0] < LINE_S or len(times_s) < LEAST_SAMPLES:
            return
        slope, _ = np.polyfit(times_s - times_s[-1], np.array([one for _, one in self._line]), 1)
        rate, size = float(np.linalg.norm(slope)), float(np.linalg.norm(values))
        if rate * (times_s[-1] - times_s[0]) > DRIFTS * size:
            self._grew = rate
        if rate > GOES_ON * self._grew:
            self.kind, self.rate = FaultKind.DRIFT, rate
        elif self.kind is FaultKind.DRIFT:
            self.kind, self.rate = FaultKind.STEP, 0.0
