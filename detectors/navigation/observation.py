"""What each sensor's measurements should be at a moment, with the noise that the sensor has shown."""

from __future__ import annotations

from math import hypot

import numpy as np
from numpy.typing import NDArray

from detectors.navigation.calibration import Calibration
from detectors.navigation.config import NavigationConfig
from detectors.navigation.dead_reckoning import DeadReckoning
from detectors.navigation.error_filter import ErrorFilter
from detectors.navigation.innovation import Measurement
from detectors.navigation.installation import DEPTH_DELAY, DVL_DELAY
from detectors.navigation.measurement import (
    Comparison,
    Moment,
    compare_depth,
    compare_dvl,
    compare_fix,
    compare_heading,
)
from detectors.navigation.motion import BodyMotion
from detectors.navigation.noise import NoiseLevel
from detectors.navigation.sample import AttitudeSample, DepthSample, DvlSample, FixSample

FloatArray = NDArray[np.float64]

# Slower than this, a vehicle goes straight on, and what scatters is noise.
STRAIGHT_RADPS, STRAIGHT_MPS2 = 0.05, 0.15
FIRST_S = 1.0  # before the first measurement of a kind


class ObservationModel:
    """Compares measurements, and learns the DVL's noise from them.

    Args:
        config: noises of the sensors.
    """

    def __init__(self, config: NavigationConfig) -> None:
        self._config = config
        self._dvl_noise = NoiseLevel(np.full(3, config.dvl_noise_mps))
        self._last_s: dict[type[Measurement], float] = {}

    def moment(
        self, measurement: Measurement, reckoning: DeadReckoning, calibration: Calibration, errors: ErrorFilter
    ) -> Moment:
        """The state of things that a measurement, the next of its kind, is compared with."""
        unsteady_radps, unsteady_mps2 = reckoning.motion.unsteady(reckoning.present_motion)
        return Moment(
            reckoning.behind,
            reckoning.motion,
            calibration.constants,
            ahead_s=measurement.time_s - calibration.delay_s(type(measurement)) - reckoning.behind_s,
            interval_s=self._interval_s(measurement),
            caution=calibration.caution,
            unsteady_radps=unsteady_radps,
            unsteady_mps2=unsteady_mps2,
            dvl_delay_error_s=errors.deviation(DVL_DELAY),
            depth_delay_error_s=errors.deviation(DEPTH_DELAY),
        )

    def compare(self, measurement: Measurement, moment: Moment) -> Comparison:
        """A measurement beside what is expected of it at this moment."""
        match measurement:
            case DvlSample():
                comparison = compare_dvl(measurement, moment, self._dvl_noise.deviation)
                self._learn_noise(comparison.innovation, moment.motion)
                return comparison
            case DepthSample():
                return compare_depth(measurement, moment, self._config.depth_noise_m)
            case FixSample():
                return compare_fix(measurement, moment, self._config.fix_noise_m)
            case AttitudeSample():
                return compare_heading(measurement, moment, self._config.heading_noise_rad)

    def interrupt(self) -> None:
        """What was measured last does not go with what comes next."""
        self._dvl_noise.forget_last()

    def _interval_s(self, measurement: Measurement) -> float:
        """Since the last measurement of its kind."""
        last_s = self._last_s.get(type(measurement), measurement.time_s - FIRST_S)
        self._last_s[type(measurement)] = measurement.time_s
        return measurement.time_s - last_s

    def _learn_noise(self, innovation: FloatArray, motion: BodyMotion) -> None:
        rate, change = hypot(*motion.rate_radps), hypot(*motion.acceleration_mps2)
        if rate < STRAIGHT_RADPS and change < STRAIGHT_MPS2:
            self._dvl_noise.learn(innovation)
        else:
            self._dvl_noise.forget_last()
