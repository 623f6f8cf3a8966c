"""The constants of the sensors, learnt under way: how they are mounted, how late they are, what the depth is off by.

Until the delay of the DVL is known, the model is not even linear in it: a search tries delays meanwhile, and the
filter considers what it does not know instead of learning it.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import exp, hypot

import numpy as np
from numpy.typing import NDArray

from detectors.navigation.config import NavigationConfig
from detectors.navigation.delay_search import DelaySearch, Guess
from detectors.navigation.error_filter import ErrorFilter
from detectors.navigation.error_model import DEPTH_SENSOR
from detectors.navigation.innovation import Measurement
from detectors.navigation.installation import (
    ALL_STATES,
    DEPTH_DELAY,
    DVL_DELAY,
    INSTALLED,
    LEVER_ARM,
    Installation,
)
from detectors.navigation.measurement import Moment
from detectors.navigation.motion import BodyMotion
from detectors.navigation.sample import DepthSample, DvlSample, Vector

FloatArray = NDArray[np.float64]

# While the mounting is not known: caution in the first turns, until so many seconds of turning (at `TURNING_RADPS`,
# or less at more) have been seen.
CAUTION, CAUTION_S, TURNING_RADPS = 2.0, 15.0, 0.1
DELAY_KNOWN_S = 0.3
HORIZON_MAX_S = 2.5
DELAYS = 2.0  # standard deviations of a delay that the horizon waits for
# What a first guess of delay and lever arm errs by beyond what it knows of.
GUESS_S, GUESS_M = 0.2, 0.2
ARM = list(range(ALL_STATES)[LEVER_ARM])
SEARCHED = [*ARM, DVL_DELAY]
UNKNOWN_LASTS_S = 5.0  # what these do to samples, while they are unknown
LEAST_S = 0.02  # of two samples with the same stamp, or nearly


class Calibration:
    """Values of the constants, and how far they are learnt; their covariance is the filter's.

    Args:
        config: where the search for the delay begins.
        installation: what is known of the mounting at the start.
        errors: the filter, which knows as much of it.

    Attributes:
        constants: (N,) in the places of their states; others are 0.
    """

    def __init__(self, config: NavigationConfig, installation: Installation, errors: ErrorFilter) -> None:
        self._estimated = config.estimate_installation
        self.constants = np.zeros(ALL_STATES)
        self.constants[INSTALLED] = installation.values
        search = DelaySearch(config.dvl_delay_s, config.dvl_lever_arm_m, config.dvl_noise_mps)
        self._search = search if errors.deviation(DVL_DELAY) > DELAY_KNOWN_S else None
        self._turned_s = 0.0

    @property
    def searching(self) -> bool:
        """Not enough turns have been seen to know the delay at all."""
        return self._search is not None

    @property
    def caution(self) -> float:
        """Factor of the noise in turns, 1 or more."""
        return 1.0 + CAUTION * exp(-self._turned_s / CAUTION_S)

    def installation(self, errors: ErrorFilter) -> Installation:
        """What is known of the mounting now."""
        covariance = errors.covariance[INSTALLED, INSTALLED].copy()
        return Installation(self.constants[INSTALLED].copy(), covariance)

    def delay_s(self, kind: type[Measurement]) -> float:
        """By which measurements of a kind are stamped later than what they measured."""
        if kind is DvlSample:
            return float(self.constants[DVL_DELAY])
        return float(self.constants[DEPTH_DELAY]) if kind is DepthSample else 0.0

    def horizon_s(self, errors: ErrorFilter) -> float:
        """How far behind the newest sample no measurement is to be expected any more."""
        latest_s = max(self.constants[state] + DELAYS * errors.deviation(state) for state in (DVL_DELAY, DEPTH_DELAY))
        return float(min(max(latest_s, 0.0), HORIZON_MAX_S))

    def move(self, time_s: float, motion: BodyMotion, interval_s: float) -> None:
        """Takes how the body moves at the newest sample of the IMU."""
        if self._search is not None:
            self._search.move(time_s, motion.newest_acceleration_mps2, motion.rate_radps, interval_s)

    def measure(self, sample: DvlSample, errors: ErrorFilter) -> None:
        """Takes a sample of the DVL when it comes, long before the filter does."""
        if self._search is None:
            return
        self._search.measure(sample)
        if (guess := self._search.guess()) is not None:
            self._search = None
            self._settle(guess, errors)

    def turn(self, rate_radps: Vector, interval_s: float) -> None:
        """The vehicle has turned at this rate (3,), and something of the mounting was to be seen."""
        self._turned_s += interval_s * min(hypot(*rate_radps) / TURNING_RADPS, 1.0)

    def considered(self, motion: BodyMotion, later: BodyMotion) -> Sequence[int]:
        """States that are not to be learnt from this moment, only considered.

        What a hull wobbles by is measured at a somewhat other instant than it was thought, and would teach that there
        is hardly a lever arm. Only what lasts teaches of it; and while the delay is searched for, nothing does.
        """
        if self._search is not None:
            return SEARCHED
        return () if motion.lasts(later) else ARM

    def unknown(self, observation: FloatArray, moment: Moment, errors: ErrorFilter) -> FloatArray:
        """(M, M) uncertainty of an innovation because of a delay and a lever arm that are still searched for.

        In a turn it is no noise: it lasts, and measured again and again it is no better known.
        """
        if self._search is None:
            return np.zeros((len(observation), len(observation)))
        shown = observation[:, SEARCHED]
        once = np.asarray(shown @ errors.covariance[np.ix_(SEARCHED, SEARCHED)] @ shown.T)
        return moment.motion.lasting_share * UNKNOWN_LASTS_S / max(moment.interval_s, LEAST_S) * once

    def correct(self, error: FloatArray) -> None:
        """Takes in an error (N,) of the states."""
        self.constants[DEPTH_SENSOR] += error[DEPTH_SENSOR]
        self.constants[INSTALLED] += error[INSTALLED]

    def begin_anew(self) -> None:
        """The mounting may be another: caution again."""
        if self._estimated:
            self._turned_s = 0.0

    def _settle(self, guess: Guess, errors: ErrorFilter) -> None:
        """Begins to learn the mounting from the search's first guess."""
        self.constants[DVL_DELAY], self.constants[LEVER_ARM] = guess.delay_s, guess.arm_m
        errors.renew(slice(DVL_DELAY, DVL_DELAY + 1), np.array([[GUESS_S**2]]))
        errors.renew(LEVER_ARM, guess.covariance + GUESS_M**2 * np.eye(3))
