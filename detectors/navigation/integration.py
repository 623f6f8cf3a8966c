"""The integrated navigation filter: strapdown system, error-state Kalman filter, closed-loop feedback (paper 003, 3).

Sensors are stamped earlier or later than what they measured, by up to a second or two, and how much is learnt. So the
filter runs behind the newest IMU sample by as much as the latest of them needs, and takes each measurement at its own
instant. A second strapdown system, corrected along with the first, says where the vehicle is now.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Iterator
from copy import copy
from dataclasses import dataclass
from math import exp, hypot, inf

import numpy as np
from filterpy.kalman import KalmanFilter
from numpy.typing import NDArray

from detectors.navigation.config import NavigationConfig
from detectors.navigation.delay_search import DelaySearch
from detectors.navigation.error_model import (
    ACCELEROMETER_BIAS,
    ATTITUDE,
    DEPTH_SENSOR,
    GYROSCOPE_BIAS,
    POSITION,
    VELOCITY,
    error_dynamics,
    initial_covariance,
    process_noise,
    strapdown_error,
    transition,
)
from detectors.navigation.features import MotionFeatures
from detectors.navigation.installation import (
    ALL_STATES,
    DEPTH_DELAY,
    DVL_DELAY,
    INSTALLED,
    LEVER_ARM,
    Installation,
    installation_noise,
)
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
from detectors.navigation.sample import (
    AttitudeSample,
    DepthSample,
    DvlSample,
    FixSample,
    ImuSample,
    NavigationState,
)
from detectors.navigation.strapdown import Strapdown

FloatArray = NDArray[np.float64]
Measurement = DvlSample | DepthSample | FixSample | AttitudeSample
KINDS: tuple[type[Measurement], ...] = (DvlSample, DepthSample, FixSample, AttitudeSample)

STEP_S = 0.1  # longest step of the covariance
# How often the present follows anew from the corrected past. In between it takes the corrections as they are, without
# what a tilt or a bias has done to it since then: that would add up.
CATCH_UP_S = 0.5
HORIZON_MAX_S = 2.5
DELAYS = 2.0  # standard deviations of a delay that the horizon waits for
WAITING_MAX = 64  # measurements of a kind, while the IMU is silent
# A gap of the IMU: nobody knows how the vehicle moved, so as much is added to the uncertainty, for each second.
GAP_S = 0.5
GAP_TURN_RADPS, GAP_ACCELERATION_MPS2 = 0.3, 0.5
# After it, how long it was does not matter any more, and what was measured meanwhile says nothing.
GAP_MAX_S = 100.0
# Standard deviations after an inertial sensor's bias has jumped: of attitude, velocity, and the biases.
SHAKEN_RAD, SHAKEN_MPS, SHAKEN_MPS2, SHAKEN_RADPS = 0.2, 2.0, 0.3, 0.02
# While the mounting is not known, the model is not even linear in it: caution in the first turns, until so many
# seconds of turning (at `TURNING_RADPS`, or less at more) have been seen.
CAUTION, CAUTION_S, TURNING_RADPS = 2.0, 15.0, 0.1
STRAIGHT_RADPS, STRAIGHT_MPS2 = 0.05, 0.15
DELAY_KNOWN_S = 0.3
# What a first guess of delay and lever arm errs by beyond what it knows of.
GUESS_S, GUESS_M = 0.2, 0.2
SEARCHED = [*range(ALL_STATES)[LEVER_ARM], DVL_DELAY]
UNKNOWN_LASTS_S = 5.0  # what these do to samples, while they are unknown
# A single sample farther off than this does not move the filter: squared standard deviations, for each component.
OUTLIER = 9.0
# After so many in a row it is not the sample that is off.
OUTLIERS_MAX = 5
# Headings of another system err for long in the same way: more of them say no more.
HEADING_S = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Innovation:
    """A measurement beside what the filter expected of it (paper 003, equations 7 to 9).

    Attributes:
        measurement: what was compared.
        values: (M,) measured minus expected.
        covariance: (M, M) that a healthy sensor's has.
        observation: (M, N) derivatives of what was expected by the N states.
        transition: (N, N) of the states since the innovation before, of whatever sensor.
        process: (N, N) covariance of what came to the states since then.
        gain: (N, M) with which the states were corrected; None: the measurement was not used.
        noise: (M, M) the measurement's own part of the covariance.
        features: (12,) of the learnt predictor, with a sample of the DVL.
    """

    measurement: Measurement
    values: FloatArray
    covariance: FloatArray
    observation: FloatArray
    transition: FloatArray
    process: FloatArray
    gain: FloatArray | None
    noise: FloatArray
    features: FloatArray | None = None

    @property
    def time_s(self) -> float:
        """Stamp of the measurement."""
        return self.measurement.time_s

    @property
    def squared(self) -> float:
        """Its size in standard deviations, squared: chi-square with M degrees of freedom."""
        return float(self.values @ np.linalg.solve(self.covariance, self.values))


class IntegratedFilter:
    """Samples in, innovations out; knows where the vehicle is.

    Args:
        config: noises and uncertainties.
        initial: where the vehicle is, about.
        installation: how its sensors are mounted; None: as the configuration says.

    Attributes:
        excluded: kinds of samples that are compared but not used.
        refused: samples that were not taken, by cause.
    """

    def __init__(
        self, config: NavigationConfig, initial: NavigationState, installation: Installation | None = None
    ) -> None:
        installation = Installation.of(config) if installation is None else installation
        self._config = config
        self.excluded: set[type[Measurement]] = set()
        self.refused: Counter[str] = Counter()
        self._filter = KalmanFilter(dim_x=ALL_STATES, dim_z=3)
        self._filter.P = initial_covariance(config, ALL_STATES)
        self._filter.P[INSTALLED, INSTALLED] = installation.covariance
        self._density = process_noise(config, ALL_STATES)
        self._density[INSTALLED, INSTALLED] = np.diag(installation_noise(config))
        self._constants = np.zeros(ALL_STATES)
        self._constants[INSTALLED] = installation.values
        self._behind, self._present = Strapdown(initial), Strapdown(initial)
        self._behind_s = self._present_s = self._caught_up_s = initial.time_s
        self._motion, self._present_motion, self._features = BodyMotion(), BodyMotion(), MotionFeatures()
        self._imu: deque[ImuSample] = deque()
        self._waiting: dict[type[Measurement], deque[Measurement]] = {kind: deque() for kind in KINDS}
        self._transition, self._process = np.eye(ALL_STATES), np.zeros((ALL_STATES, ALL_STATES))
        self._unpropagated_s = 0.0
        self._force = np.zeros(3)
        self._turned_s = 0.0
        delay = DelaySearch(config.dvl_delay_s, config.dvl_lever_arm_m, config.dvl_noise_mps)
        self._search = delay if self._deviation(DVL_DELAY) > DELAY_KNOWN_S else None
        self._heading_s = -inf
        self._last_s: dict[type[Measurement], float] = {}
        self._located = False
        self._between_s = 1.0
        self._outliers: Counter[type[Measurement]] = Counter()
        self._dvl_noise = NoiseLevel(np.full(3, config.dvl_noise_mps))

    @property
    def installation(self) -> Installation:
        """What is known of the mounting now."""
        covariance = self._filter.P[INSTALLED, INSTALLED].copy()
        return Installation(self._constants[INSTALLED].copy(), covariance)

    @property
    def covariance(self) -> FloatArray:
        """(N, N) of the states' errors."""
        return np.asarray(self._filter.P)

    @property
    def position_error_m(self) -> float:
        """Standard deviation of the horizontal position."""
        return float(np.sqrt(max(np.trace(self._filter.P[POSITION, POSITION][:2, :2]), 0.0)))

    @property
    def strapdown(self) -> Strapdown:
        """The system that measurements are compared with: some time ago."""
        return self._behind

    @property
    def acquainted(self) -> bool:
        """It has seen enough turns to know how the sensors are mounted."""
        return self._search is None

    def state(self, time_s: float) -> NavigationState:
        """Where the vehicle is now."""
        return self._present.state(time_s)

    def measure(self, sample: Measurement) -> None:
        """Keeps a measurement until the IMU has come to its instant."""
        if isinstance(sample, AttitudeSample):
            if sample.time_s - self._heading_s < HEADING_S:
                return
            self._heading_s = sample.time_s
        if isinstance(sample, DvlSample) and self._search is not None:
            self._search.measure(sample)
            self._settle_delay(self._search)
        waiting = self._waiting[type(sample)]
        if len(waiting) == WAITING_MAX:
            waiting.popleft()
            self.refused["measurement while the IMU was silent"] += 1
        waiting.append(sample)

    def advance(self, sample: ImuSample) -> Iterator[Innovation]:
        """Takes an IMU sample later than the one before; the innovations of the measurements that it brings within
        reach."""
        interval_s = sample.time_s - self._present_s
        self._present_s = self._advance(self._present, self._present_s, sample)
        if 0.0 < interval_s <= GAP_S:
            self._present_motion.follow(self._present, sample.angular_rate_radps, interval_s)
        if self._search is not None:
            motion = self._present_motion
            self._search.move(
                sample.time_s, motion.newest_acceleration_mps2, motion.rate_radps, min(interval_s, GAP_S)
            )
        self._imu.append(sample)
        horizon_s = sample.time_s - self._horizon_s()
        while self._imu and self._imu[0].time_s <= horizon_s:
            yield from self._step(self._imu.popleft())
        if sample.time_s - self._caught_up_s >= CATCH_UP_S:
            self._catch_up()

    def correct(self, error: FloatArray, covariance: FloatArray) -> None:
        """Takes in an error (N,) that was found otherwise, and its own uncertainty (N, N)."""
        self._feed_back(error)
        self._filter.P = self._filter.P + covariance

    def replace(self, error: FloatArray, covariance: FloatArray) -> None:
        """Takes in an error (N,) of the states, after which their covariance is this one (N, N)."""
        self._feed_back(error)
        self._filter.P = covariance.copy()

    def begin_anew(self, *, shaken: bool = False) -> None:
        """Knows no more of velocity, attitude, biases and mounting than at the start; position and heading stay.

        Args:
            shaken: an inertial sensor's bias has jumped, and may be anything.
        """
        fresh = np.diag(initial_covariance(self._config, ALL_STATES)).copy()
        if shaken:
            fresh[ATTITUDE], fresh[VELOCITY] = SHAKEN_RAD**2, SHAKEN_MPS**2
            fresh[ACCELEROMETER_BIAS], fresh[GYROSCOPE_BIAS] = SHAKEN_MPS2**2, SHAKEN_RADPS**2
        fresh[INSTALLED] = np.diag(Installation.of(self._config).covariance)
        fresh[POSITION] = 0.0
        self.loosen(fresh)
        if self._config.estimate_installation:
            self._turned_s = 0.0

    def loosen(self, variances: FloatArray) -> None:
        """Adds to the uncertainty of the states: (N,) variances."""
        self._filter.P = self._filter.P + np.diag(variances)
        self._process = self._process + np.diag(variances)

    def _advance(self, strapdown: Strapdown, last_s: float, sample: ImuSample) -> float:
        """To a sample; over a gap, the vehicle goes on as it went."""
        interval_s = sample.time_s - last_s
        if interval_s <= 0.0:
            return last_s
        force, rate = sample.specific_force_mps2, sample.angular_rate_radps
        if interval_s > GAP_S:
            strapdown.coast(min(interval_s, GAP_MAX_S))
        else:
            strapdown.advance(force, rate, interval_s)
        return sample.time_s

    def _catch_up(self) -> None:
        self._caught_up_s = self._present_s
        self._present, self._present_s = copy(self._behind), self._behind_s
        for sample in self._imu:
            self._present_s = self._advance(self._present, self._present_s, sample)

    def _horizon_s(self) -> float:
        latest_s = max(self._constants[state] + DELAYS * self._deviation(state) for state in (DVL_DELAY, DEPTH_DELAY))
        return float(min(max(latest_s, 0.0), HORIZON_MAX_S))

    def _deviation(self, state: int) -> float:
        return float(np.sqrt(max(self._filter.P[state, state], 0.0)))

    def _step(self, sample: ImuSample) -> Iterator[Innovation]:
        interval_s = sample.time_s - self._behind_s
        if interval_s <= 0.0:
            return
        self._behind_s = self._advance(self._behind, self._behind_s, sample)
        if interval_s > GAP_MAX_S:
            interval_s = GAP_MAX_S
            for waiting in self._waiting.values():
                waiting.clear()
        if interval_s > GAP_S:
            self._doubt(interval_s)
        else:
            self._motion.follow(self._behind, sample.angular_rate_radps, interval_s)
            self._turned_s += interval_s * min(hypot(*self._motion.rate_radps) / TURNING_RADPS, 1.0)
            self._features.add(
                _less(sample.specific_force_mps2, self._behind.accelerometer_bias_mps2),
                _less(sample.angular_rate_radps, self._behind.gyroscope_bias_radps),
            )
        self._unpropagated_s += interval_s
        self._force += np.array(self._behind.specific_force_mps2) * interval_s
        while (measurement := self._due(self._behind_s - 0.5 * interval_s)) is not None:
            yield self._take(measurement)
        if self._unpropagated_s >= STEP_S:
            self._propagate()

    def _due(self, until_s: float) -> Measurement | None:
        """The next measurement whose instant is before; removed from those that wait."""
        first_s, first = inf, None
        for kind, waiting in self._waiting.items():
            if waiting and (instant_s := waiting[0].time_s - self._delay_s(kind)) < min(first_s, until_s):
                first_s, first = instant_s, kind
        return None if first is None else self._waiting[first].popleft()

    def _delay_s(self, kind: type[Measurement]) -> float:
        if kind is DvlSample:
            return float(self._constants[DVL_DELAY])
        return float(self._constants[DEPTH_DELAY]) if kind is DepthSample else 0.0

    def _propagate(self) -> None:
        if self._unpropagated_s <= 0.0:
            return
        force = self._force / self._unpropagated_s
        dynamics = error_dynamics(self._behind, (force[0], force[1], force[2]), ALL_STATES)
        phi, added = transition(dynamics, self._density, min(self._unpropagated_s, 1.0))
        self._filter.predict(F=phi, Q=added)
        self._transition = phi @ self._transition
        self._process = phi @ self._process @ phi.T + added
        self._unpropagated_s, self._force = 0.0, np.zeros(3)

    def _doubt(self, gap_s: float) -> None:
        variances = np.zeros(ALL_STATES)
        variances[ATTITUDE] = (GAP_TURN_RADPS * gap_s) ** 2
        variances[VELOCITY] = (GAP_ACCELERATION_MPS2 * gap_s) ** 2
        variances[POSITION] = (GAP_ACCELERATION_MPS2 * gap_s**2) ** 2
        self.loosen(variances)
        self._motion = BodyMotion()
        self._dvl_noise.forget_last()

    def _take(self, measurement: Measurement) -> Innovation:
        self._propagate()
        ahead_s = measurement.time_s - self._delay_s(type(measurement)) - self._behind_s
        constants = self._constants
        moment = Moment(
            self._behind,
            self._motion,
            constants,
            ahead_s,
            self._interval_s(measurement),
            self._caution(),
            *self._motion.unsteady(self._present_motion),
            self._deviation(DVL_DELAY),
            self._deviation(DEPTH_DELAY),
        )
        comparison = self._compare(measurement, moment)
        features = None
        if isinstance(measurement, DvlSample):
            features = self._features.take(self._behind.body_velocity(), self._behind.attitude)
        return self._fuse(measurement, comparison, features)

    def _interval_s(self, measurement: Measurement) -> float:
        """Since the last measurement of its kind; 1 s for the first."""
        last_s = self._last_s.get(type(measurement), measurement.time_s - 1.0)
        self._last_s[type(measurement)] = measurement.time_s
        self._between_s = measurement.time_s - last_s
        return self._between_s

    def _compare(self, measurement: Measurement, moment: Moment) -> Comparison:
        match measurement:
            case DvlSample():
                comparison = compare_dvl(measurement, moment, self._dvl_noise.deviation)
                self._learn_noise(self._dvl_noise, comparison.innovation)
                return comparison
            case DepthSample():
                return compare_depth(measurement, moment, self._config.depth_noise_m)
            case FixSample():
                comparison = compare_fix(measurement, moment, self._config.fix_noise_m)
                if self._lost(comparison):
                    self._locate(measurement)
                    return compare_fix(measurement, moment, self._config.fix_noise_m)
                return comparison
            case AttitudeSample():
                return compare_heading(measurement, moment, self._config.heading_noise_rad)

    def _lost(self, comparison: Comparison) -> bool:
        """The first fix, or many in a row, are somewhere else."""
        believed = not self._located or self._outliers[FixSample] >= OUTLIERS_MAX
        self._located = True
        innovation, observation, noise = comparison
        covariance = observation @ self._filter.P @ observation.T + noise
        return believed and float(innovation @ np.linalg.solve(covariance, innovation)) > OUTLIER * len(innovation)

    def _locate(self, fix: FixSample) -> None:
        """Goes on from a fix: a way so long would make nonsense of all that is correlated with the position. Gravity
        may be another there, which has gone into the bias of the accelerometer."""
        for strapdown in (self._behind, self._present):
            strapdown.locate(fix.latitude_rad, fix.longitude_rad)
        covariance = self._filter.P.copy()
        horizontal = slice(POSITION.start, POSITION.stop - 1)
        covariance[horizontal, :], covariance[:, horizontal] = 0.0, 0.0
        covariance[horizontal, horizontal] = self._config.fix_noise_m**2 * np.eye(2)
        self._filter.P = covariance
        variances = np.zeros(ALL_STATES)
        variances[ACCELEROMETER_BIAS] = self._config.accelerometer_bias_mps2**2
        self.loosen(variances)

    def _learn_noise(self, level: NoiseLevel, innovation: FloatArray) -> None:
        rate, change = hypot(*self._motion.rate_radps), hypot(*self._motion.acceleration_mps2)
        if rate < STRAIGHT_RADPS and change < STRAIGHT_MPS2:
            level.learn(innovation)
        else:
            level.forget_last()

    def _caution(self) -> float:
        return 1.0 + CAUTION * exp(-self._turned_s / CAUTION_S)

    def _fuse(self, measurement: Measurement, comparison: Comparison, features: FloatArray | None) -> Innovation:
        kind = type(measurement)
        innovation, observation, noise = comparison
        unknown = self._unknown(observation)
        noise = noise + self._motion.lasting_share * UNKNOWN_LASTS_S / max(self._between_s, 0.02) * unknown
        covariance = observation @ self._filter.P @ observation.T + noise
        squared = float(innovation @ np.linalg.solve(covariance, innovation))
        outlier = squared > OUTLIER * len(innovation) and self._outliers[kind] < OUTLIERS_MAX
        self._outliers[kind] = self._outliers[kind] + 1 if outlier else 0
        used = not outlier and kind not in self.excluded
        gain = self._gain(innovation, observation, noise) if used else None
        passed = self._transition, self._process
        self._transition, self._process = np.eye(ALL_STATES), np.zeros((ALL_STATES, ALL_STATES))
        return Innovation(measurement, innovation, covariance, observation, *passed, gain, noise, features)

    def _gain(self, innovation: FloatArray, observation: FloatArray, noise: FloatArray) -> FloatArray:
        """Updates the filter and corrects the strapdown systems; the gain with which that was done."""
        size = len(innovation)
        _check_shapes(innovation, observation, noise)
        if self._instructive():
            self._filter.dim_z = size
            self._filter.update(innovation.reshape(size, 1), R=noise, H=observation)
            gain, error = np.asarray(self._filter.K), self._filter.x[:, 0].copy()
            self._filter.x[:] = 0.0
        else:
            gain = self._consider(observation, noise)
            error = gain @ innovation
        self._feed_back(error)
        return gain

    def _unknown(self, observation: FloatArray) -> FloatArray:
        """(M, M) uncertainty of an innovation because of a delay and a lever arm that are still searched for.

        In a turn it is no noise: it lasts, and measured again and again it is no better known.
        """
        if self._search is None:
            return np.zeros((len(observation), len(observation)))
        shown = observation[:, SEARCHED]
        return np.asarray(shown @ self._filter.P[np.ix_(SEARCHED, SEARCHED)] @ shown.T)

    def _instructive(self) -> bool:
        """Whether the mounting can be learnt from this moment. While a delay is unknown, what a hull wobbles by is
        measured at another instant than it was thought, and would only teach that there is no lever arm."""
        if self._search is not None:
            return False
        return self._deviation(DVL_DELAY) < DELAY_KNOWN_S or self._motion.lasts(self._present_motion)

    def _settle_delay(self, search: DelaySearch) -> None:
        """Begins to learn the mounting from the search's first guess, once there is one."""
        guess = search.guess()
        if guess is None:
            return
        self._search = None
        self._constants[DVL_DELAY], self._constants[LEVER_ARM] = guess.delay_s, guess.arm_m
        covariance = self._filter.P.copy()
        for states, own in ((slice(DVL_DELAY, DVL_DELAY + 1), GUESS_S**2), (LEVER_ARM, guess.covariance)):
            covariance[states, :], covariance[:, states] = 0.0, 0.0
            covariance[states, states] = own
        covariance[LEVER_ARM, LEVER_ARM] += GUESS_M**2 * np.eye(3)
        self._filter.P = covariance

    def _consider(self, observation: FloatArray, noise: FloatArray) -> FloatArray:
        """An update that takes the mounting's uncertainty into account, and leaves it as it is (Schmidt's filter)."""
        before = self._filter.P
        shown = before @ observation.T
        gain = shown @ np.linalg.inv(observation @ shown + noise)
        gain[SEARCHED] = 0.0
        kept = np.eye(ALL_STATES) - gain @ observation
        self._filter.P = kept @ before @ kept.T + gain @ noise @ gain.T
        return np.asarray(gain)

    def _feed_back(self, error: FloatArray) -> None:
        correction = strapdown_error(error)
        self._behind.correct(correction)
        self._present.correct(correction)
        self._constants[DEPTH_SENSOR] += error[DEPTH_SENSOR]
        self._constants[INSTALLED] += error[INSTALLED]


def _check_shapes(innovation: FloatArray, observation: FloatArray, noise: FloatArray) -> None:
    """filterpy multiplies whatever fits, and broadcasts what does not."""
    size = len(innovation)
    shapes = (innovation.shape, observation.shape, noise.shape)
    if shapes != ((size,), (size, ALL_STATES), (size, size)):
        raise ValueError(f"innovation, observation, noise {shapes}: want (M,), (M, {ALL_STATES}), (M, M)")


def _less(one: tuple[float, float, float], other: tuple[float, float, float]) -> tuple[float, float, float]:
    return one[0] - other[0], one[1] - other[1], one[2] - other[2]
