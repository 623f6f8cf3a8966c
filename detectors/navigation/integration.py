"""The integrated navigation filter: strapdown system, error-state Kalman filter, closed-loop feedback (paper 003, 3).

Sensors are stamped earlier or later than what they measured, by up to a second or two, and how much is learnt. So the
filter runs behind the newest IMU sample by as much as the latest of them needs, and takes each measurement at its own
instant. A second strapdown system, corrected along with the first, says where the vehicle is now.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from detectors.navigation.calibration import Calibration
from detectors.navigation.config import NavigationConfig
from detectors.navigation.dead_reckoning import GAP_MAX_S, GAP_S, DeadReckoning
from detectors.navigation.error_filter import ErrorFilter
from detectors.navigation.error_model import ACCELEROMETER_BIAS, ATTITUDE, POSITION, VELOCITY
from detectors.navigation.gate import InnovationGate, outlying
from detectors.navigation.innovation import Innovation, Measurement
from detectors.navigation.installation import ALL_STATES, Installation
from detectors.navigation.measurement import Comparison, Moment
from detectors.navigation.observation import ObservationModel
from detectors.navigation.sample import DvlSample, FixSample, ImuSample, NavigationState
from detectors.navigation.strapdown import Strapdown
from detectors.navigation.uncertainty import covariance_at_start, noise_density, variances_anew, variances_of_gap
from detectors.navigation.waiting import WaitingMeasurements

FloatArray = NDArray[np.float64]

# Standard deviations of velocity and attitude of a vehicle that many fixes find somewhere else.
LOST_MPS, LOST_RAD = 5.0, 0.2
HORIZONTAL = slice(POSITION.start, POSITION.stop - 1)


class IntegratedFilter:
    """Samples in, innovations out; knows where the vehicle is.

    Args:
        config: noises and uncertainties.
        initial: where the vehicle is, about.
        installation: how its sensors are mounted; None: as the configuration says.

    Attributes:
        excluded: kinds of samples that are compared but not used.
    """

    def __init__(
        self, config: NavigationConfig, initial: NavigationState, installation: Installation | None = None
    ) -> None:
        installation = Installation.of(config) if installation is None else installation
        self._config = config
        self.excluded: set[type[Measurement]] = set()
        self._reckoning = DeadReckoning(initial)
        self._errors = ErrorFilter(covariance_at_start(config, installation), noise_density(config))
        self._calibration = Calibration(config, installation, self._errors)
        self._observation = ObservationModel(config)
        self._waiting = WaitingMeasurements()
        self._gate = InnovationGate()
        self._located = False

    @property
    def refused(self) -> Counter[str]:
        """Samples that were not taken, by cause."""
        return self._waiting.refused

    @property
    def installation(self) -> Installation:
        """What is known of the mounting now."""
        return self._calibration.installation(self._errors)

    @property
    def covariance(self) -> FloatArray:
        """(N, N) of the states' errors."""
        return self._errors.covariance

    @property
    def position_error_m(self) -> float:
        """Standard deviation of the horizontal position."""
        return float(np.sqrt(max(np.trace(self._errors.covariance[HORIZONTAL, HORIZONTAL]), 0.0)))

    @property
    def strapdown(self) -> Strapdown:
        """The system that measurements are compared with: some time ago."""
        return self._reckoning.behind

    @property
    def acquainted(self) -> bool:
        """It has seen enough turns to know how the sensors are mounted."""
        return not self._calibration.searching

    def state(self, time_s: float) -> NavigationState:
        """Where the vehicle is now."""
        return self._reckoning.state(time_s)

    def measure(self, sample: Measurement) -> None:
        """Keeps a measurement until the IMU has come to its instant."""
        if isinstance(sample, DvlSample):
            self._calibration.measure(sample, self._errors)
        self._waiting.add(sample)

    def advance(self, sample: ImuSample) -> Iterator[Innovation]:
        """Takes an IMU sample later than the one before; the innovations of the measurements that it brings within
        reach."""
        interval_s = self._reckoning.advance(sample)
        self._calibration.move(sample.time_s, self._reckoning.present_motion, min(interval_s, GAP_S))
        horizon_s = sample.time_s - self._calibration.horizon_s(self._errors)
        for followed_s in self._reckoning.follow(horizon_s):
            yield from self._step(followed_s)
        self._reckoning.catch_up()

    def correct(self, error: FloatArray, covariance: FloatArray) -> None:
        """Takes in an error (N,) that was found otherwise, and its own uncertainty (N, N)."""
        self._feed_back(error)
        self._errors.add(covariance)

    def replace(self, error: FloatArray, covariance: FloatArray) -> None:
        """Takes in an error (N,) of the states, after which their covariance is this one (N, N)."""
        self._feed_back(error)
        self._errors.replace(covariance)

    def begin_anew(self, *, shaken: bool = False) -> None:
        """Knows no more of velocity, attitude, biases and mounting than at the start; position and heading stay.

        Args:
            shaken: an inertial sensor's bias has jumped, and may be anything.
        """
        self.loosen(variances_anew(self._config, shaken=shaken))
        self._calibration.begin_anew()

    def loosen(self, variances: FloatArray) -> None:
        """Adds to the uncertainty of the states: (N,) variances."""
        self._errors.loosen(variances)

    def _step(self, interval_s: float) -> Iterator[Innovation]:
        """The strapdown system behind has come so much further."""
        if interval_s > GAP_MAX_S:
            interval_s = GAP_MAX_S
            self._waiting.clear()
        if interval_s > GAP_S:
            self.loosen(variances_of_gap(interval_s))
            self._observation.interrupt()
        else:
            self._calibration.turn(self._reckoning.motion.rate_radps, interval_s)
        strapdown = self._reckoning.behind
        self._errors.elapse(interval_s, strapdown.specific_force_mps2)
        until_s = self._reckoning.behind_s - 0.5 * interval_s
        while (measurement := self._waiting.due(until_s, self._calibration.delay_s)) is not None:
            yield self._take(measurement)
        if self._errors.step_due:
            self._errors.propagate(strapdown)

    def _take(self, measurement: Measurement) -> Innovation:
        self._errors.propagate(self._reckoning.behind)
        moment = self._observation.moment(measurement, self._reckoning, self._calibration, self._errors)
        comparison = self._observation.compare(measurement, moment)
        if isinstance(measurement, FixSample):
            if self._lost(comparison):
                self._locate(measurement)
                comparison = self._observation.compare(measurement, moment)
            self._located = True
        features = self._reckoning.take_features() if isinstance(measurement, DvlSample) else None
        return self._fuse(measurement, comparison, moment, features)

    def _lost(self, comparison: Comparison) -> bool:
        """The first fix, or many in a row, are somewhere else."""
        believed = not self._located or self._gate.insists(FixSample)
        innovation, observation, noise = comparison
        return believed and outlying(innovation, self._errors.expected(observation, noise))

    def _locate(self, fix: FixSample) -> None:
        """Goes on from a fix: a way so long would make nonsense of all that is correlated with the position. Gravity
        may be another there, which has gone into the bias of the accelerometer."""
        self._reckoning.locate(fix.latitude_rad, fix.longitude_rad)
        self._errors.renew(HORIZONTAL, self._config.fix_noise_m**2 * np.eye(2))
        variances = np.zeros(ALL_STATES)
        variances[ACCELEROMETER_BIAS] = self._config.accelerometer_bias_mps2**2
        if self._located:  # and yet it was lost: then velocity and attitude are not what they were thought to be
            variances[VELOCITY], variances[ATTITUDE] = LOST_MPS**2, LOST_RAD**2
        self.loosen(variances)

    def _fuse(
        self, measurement: Measurement, comparison: Comparison, moment: Moment, features: FloatArray | None
    ) -> Innovation:
        kind = type(measurement)
        values, observation, noise = comparison
        noise = noise + self._calibration.unknown(observation, moment, self._errors)
        covariance = self._errors.expected(observation, noise)
        used = self._gate.admits(kind, values, covariance) and kind not in self.excluded
        gain = self._learn(Comparison(values, observation, noise)) if used else None
        return Innovation(measurement, values, covariance, observation, *self._errors.passed(), gain, noise, features)

    def _learn(self, comparison: Comparison) -> FloatArray:
        """Updates the filter and corrects the strapdown systems; the gain with which that was done."""
        reckoning = self._reckoning
        considered = self._calibration.considered(reckoning.motion, reckoning.present_motion)
        update = self._errors.consider(comparison, considered) if considered else self._errors.update(comparison)
        gain, error = update
        self._feed_back(error)
        return gain

    def _feed_back(self, error: FloatArray) -> None:
        self._reckoning.correct(error)
        self._calibration.correct(error)
