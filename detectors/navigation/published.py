"""Paper 003's statistics on the filter's innovations: chi-square, amplified cumulative residual, learnt predictor.

Its equations 10 to 14 are lost in the text that we have; the reading is: with r the size of a residual and beta just
above the healthy one, x = r - beta. While x <= 0 the statistic is x and the count n is 1; else
S = max(0, S) + lambda n x, with n counting the exceedances in a row; alarm at S > T.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import inf
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from detectors.navigation.config import NavigationConfig
from detectors.navigation.innovation import Innovation
from detectors.navigation.lstm import Predictor, lstm_statistic
from detectors.navigation.sample import DepthSample, DvlSample, Sensor

FloatArray = NDArray[np.float64]

# The healthy beginning that beta is learnt from, and what it is then: a multiple of the median residual, so that few
# healthy ones exceed it (of normal ones 1 in 370).
LEARNING_SAMPLES = 60
BIAS_MEDIANS = 3.0 / 0.6745
# A sample that comes by so little of the predictor's interval too early is the next one all the same.
EARLY = 0.9


class DepthInnovation(NamedTuple):
    """Of the depth sensor."""

    value: float
    variance: float


class Residual(NamedTuple):
    """Newest innovations of DVL (3) and depth sensor (1) together, with each new sample of the DVL.

    Attributes:
        values: (4,) m/s and m; the depth is 0 where there is no such sensor.
        covariance: (4, 4)
        features: (12,) of the learnt predictor; None where no IMU sample came.
        time_s: of the DVL's sample.
    """

    values: FloatArray
    covariance: FloatArray
    features: FloatArray | None
    time_s: float = 0.0


class Residuals:
    """Puts the newest innovation of the depth sensor to each of the DVL."""

    def __init__(self) -> None:
        self._depth = DepthInnovation(0.0, 1.0)

    def take(self, innovation: Innovation) -> Residual | None:
        """The residual that an innovation of the DVL makes; None with those of other sensors."""
        match innovation.measurement:
            case DepthSample():
                self._depth = DepthInnovation(float(innovation.values[0]), float(innovation.covariance[0, 0]))
                return None
            case DvlSample():
                covariance = np.zeros((4, 4))
                covariance[:3, :3], covariance[3, 3] = innovation.covariance, self._depth.variance
                values = np.append(innovation.values, self._depth.value)
                return Residual(values, covariance, innovation.features, innovation.time_s)
            case _:
                return None


class Score(NamedTuple):
    """A statistic as a share of its threshold, and the sensor that most of it comes from."""

    share: float
    sensor: Sensor


class Method(Protocol):
    """Judges residuals, one after the other."""

    def judge(self, residual: Residual) -> Score:
        """The score with the newest residual."""
        ...


class ChiSquare:
    """r' V^-1 r with four degrees of freedom (paper 003, section 3, references 24 and 25)."""

    def __init__(self, config: NavigationConfig) -> None:
        self._threshold = config.chi_square_threshold

    def judge(self, residual: Residual) -> Score:
        """See `Method`."""
        squared = float(residual.values @ np.linalg.solve(residual.covariance, residual.values))
        return Score(squared / self._threshold, _blamed(residual.values**2 / np.diag(residual.covariance)))


class AmplifiedCusum:
    """Cumulative residual with amplification of the error coefficient (paper 003, equations 12 to 15, figure 3).

    Each component by itself; until beta is known the score is 0.
    """

    def __init__(self, config: NavigationConfig) -> None:
        self._gain, self._threshold = config.cusum_gain, config.cusum_threshold_mps
        self._bias = None if config.cusum_bias_mps is None else np.full(4, config.cusum_bias_mps)
        self._learning: list[FloatArray] = []
        self._sums, self._counts = np.zeros(4), np.ones(4)

    def judge(self, residual: Residual) -> Score:
        """See `Method`."""
        size = np.abs(residual.values)
        if self._bias is None:
            self._learn(size)
            return Score(0.0, Sensor.DVL)
        excess = size - self._bias
        above = excess > 0.0
        grown = np.maximum(self._sums, 0.0) + self._gain * self._counts * excess
        self._sums = np.where(above, grown, excess)
        self._counts = np.where(above, self._counts + 1.0, 1.0)
        return Score(float(self._sums.max()) / self._threshold, _blamed(self._sums))

    def _learn(self, size: FloatArray) -> None:
        self._learning.append(size)
        if len(self._learning) == LEARNING_SAMPLES:
            self._bias = BIAS_MEDIANS * np.median(self._learning, axis=0)
            self._learning = []


class LearntPredictor:
    """(r - r_lstm)' (V + V_lstm)^-1 (r - r_lstm) (paper 003, equations 20 to 27).

    The network knows time by its steps: of a DVL that is faster than the one it was trained with, it sees a sample
    each of its own intervals, and its prediction holds for those in between.
    """

    def __init__(self, config: NavigationConfig, predictor: Predictor) -> None:
        self._threshold = config.lstm_threshold
        self._predictor = predictor
        self._stepped_s = -inf
        self._predicted: tuple[FloatArray, FloatArray] | None = None

    def judge(self, residual: Residual) -> Score:
        """See `Method`. Without an inertial sample since the last residual nothing is predicted: 0."""
        due_s = self._stepped_s + EARLY * self._predictor.model.interval_s
        if residual.features is not None and (self._predicted is None or residual.time_s >= due_s):
            self._predicted, self._stepped_s = self._predictor.step(residual.features), residual.time_s
        if self._predicted is None:
            return Score(0.0, Sensor.DVL)
        predicted, variance = self._predicted
        difference = residual.values - predicted
        squared = lstm_statistic(difference, residual.covariance, np.diag(variance))
        return Score(squared / self._threshold, _blamed(difference**2 / np.diag(residual.covariance)))


def published_methods(config: NavigationConfig) -> Mapping[str, Method]:
    """Those whose statistics are wanted, by name. Reading the model of the learnt one costs time and memory: only
    where it judges, or all are compared."""
    methods: dict[str, Method] = {"chi_square": ChiSquare(config), "cusum": AmplifiedCusum(config)}
    if config.method == "lstm" or config.compare:
        predictor = Predictor.load() if config.lstm_model is None else Predictor.load(config.lstm_model)
        methods["lstm"] = LearntPredictor(config, predictor)
    return methods


def _blamed(shares: FloatArray) -> Sensor:
    return Sensor.DEPTH if shares[3] > shares[:3].sum() else Sensor.DVL
