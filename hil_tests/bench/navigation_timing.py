"""The navigation detector beside a plain loop around filterpy that does the same filter and judges nothing."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, sin, tan

import numpy as np
from filterpy.kalman import KalmanFilter
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from detectors.navigation import (
    DepthSample,
    DvlSample,
    ImuSample,
    NavigationConfig,
    NavigationDetector,
    NavigationSample,
    NavigationState,
)
from hil_tests.bench.timing import Comparison
from hil_tests.dives import random_dive
from hil_tests.navigation_trials import samples

FloatArray = NDArray[np.float64]

SEED = 8  # an AUV whose DVL is nearly on time, for the plain filter knows of no delay
DURATION_S = 30.0
DVL_HZ = DEPTH_HZ = 5.0
CLOSE_MPS = 0.3  # each component of the last velocity, of the truth

EARTH_RADIUS_M, EARTH_RATE_RADPS, GRAVITY_MPS2 = 6_378_137.0, 7.292115e-5, 9.80665
DOWN = np.array([0.0, 0.0, 1.0])
ATTITUDE, VELOCITY, POSITION, FORCE_BIAS, RATE_BIAS, DEPTH_ERROR = (
    slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 12), slice(12, 15), 15,
)  # fmt: skip
STATES = 16


def navigation_watch() -> Comparison:
    """One dive judged sample by sample, with the IMU at 100 Hz, DVL and depth at 5 Hz.

    They agree where both know the velocity at the end.
    """
    dive = random_dive(SEED, duration_s=DURATION_S, dvl_hz=DVL_HZ, depth_hz=DEPTH_HZ)
    seen, config = list(samples(dive)), NavigationConfig()
    true_mps = dive.motion.velocity_mps(seen[-1].time_s)

    def ours() -> FloatArray:
        detector = NavigationDetector(config, dive.initial)
        for sample in seen:
            verdict = detector.update(sample)
        return np.array(verdict.state.velocity_mps)

    return Comparison(
        work="NavigationDetector.update",
        peer="plain filterpy loop",
        unit="second of data",
        count=int(DURATION_S),
        ours=ours,
        theirs=lambda: plain_navigation(dive.initial, config, seen),
        agree=lambda one, other: bool(np.allclose([one, other], true_mps, rtol=0.0, atol=CLOSE_MPS)),
    )


def plain_navigation(
    initial: NavigationState, config: NavigationConfig, seen: Sequence[NavigationSample]
) -> FloatArray:
    """(3,) velocity at the end, by a strapdown system and an error-state Kalman filter of 16 states."""
    navigation = PlainNavigation(initial, config)
    before_s = initial.time_s
    for sample in seen:
        match sample:
            case ImuSample():
                force_mps2, rate_radps = np.array(sample.specific_force_mps2), np.array(sample.angular_rate_radps)
                navigation.predict(force_mps2, rate_radps, sample.time_s - before_s)
                before_s = sample.time_s
            case DvlSample():
                navigation.correct_velocity(np.array(sample.velocity_mps))
            case DepthSample():
                navigation.correct_depth(sample.depth_m)
    return navigation.velocity_mps


class PlainNavigation:
    """Strapdown system in north-east-down and filter, written with numpy's matrices, one step for each sample."""

    def __init__(self, initial: NavigationState, config: NavigationConfig) -> None:
        self.frame = Rotation.from_euler("ZYX", initial.attitude_rad[::-1]).as_matrix()
        self.velocity_mps = np.array(initial.velocity_mps)
        self.latitude_rad, self.depth_m, self.north_m, self.east_m = initial.latitude_rad, initial.depth_m, 0.0, 0.0
        self.force_bias_mps2, self.rate_bias_radps, self.depth_error_m = np.zeros(3), np.zeros(3), 0.0
        self.config = config
        self.filter = KalmanFilter(dim_x=STATES, dim_z=3)
        level = config.attitude_error_rad
        self.filter.P = np.diag(
            np.square(
                [level, level, config.heading_error_rad, *[config.velocity_error_mps] * 3]
                + [config.position_error_m] * 3
                + [config.accelerometer_bias_mps2] * 3
                + [config.gyroscope_bias_radps] * 3
                + [0.2]
            )
        )

    def predict(self, force_mps2: FloatArray, rate_radps: FloatArray, interval_s: float) -> None:
        """One sample of the IMU."""
        earth = EARTH_RATE_RADPS * np.array([cos(self.latitude_rad), 0.0, -sin(self.latitude_rad)])
        north_mps, east_mps, _ = self.velocity_mps
        transport = np.array([east_mps, -north_mps, -east_mps * tan(self.latitude_rad)]) / EARTH_RADIUS_M
        turned = rate_radps - self.rate_bias_radps - self.frame.T @ (earth + transport)
        self.frame = self.frame @ Rotation.from_rotvec(turned * interval_s).as_matrix()
        force = self.frame @ (force_mps2 - self.force_bias_mps2)
        coriolis = np.cross(2.0 * earth + transport, self.velocity_mps)
        self.velocity_mps = self.velocity_mps + interval_s * (force + GRAVITY_MPS2 * DOWN - coriolis)
        self.latitude_rad += interval_s * self.velocity_mps[0] / EARTH_RADIUS_M
        self.north_m += interval_s * self.velocity_mps[0]
        self.east_m += interval_s * self.velocity_mps[1]
        self.depth_m += interval_s * self.velocity_mps[2]
        self._predict_errors(force, earth, transport, interval_s)

    def _predict_errors(
        self, force_mps2: FloatArray, earth: FloatArray, transport: FloatArray, interval_s: float
    ) -> None:
        transition = np.eye(STATES)
        transition[ATTITUDE, ATTITUDE] -= interval_s * skew(earth + transport)
        transition[ATTITUDE, RATE_BIAS] = -interval_s * self.frame
        transition[VELOCITY, ATTITUDE] = -interval_s * skew(force_mps2)
        transition[VELOCITY, VELOCITY] -= interval_s * skew(2.0 * earth + transport)
        transition[VELOCITY, FORCE_BIAS] = -interval_s * self.frame
        transition[POSITION, VELOCITY] = interval_s * np.eye(3)
        rate, force = self.config.gyroscope_noise_radps, self.config.accelerometer_noise_mps2
        noise = np.square([*[rate] * 3, *[force] * 3, *[0.0] * 3, *[2e-5] * 3, *[3e-6] * 3, 4e-3])
        self.filter.predict(F=transition, Q=np.diag(noise * interval_s))

    def correct_velocity(self, velocity_mps: FloatArray) -> None:
        """One sample of the DVL."""
        measurement = np.zeros((3, STATES))
        measurement[:, VELOCITY] = self.frame.T
        measurement[:, ATTITUDE] = self.frame.T @ skew(self.velocity_mps)
        innovation = velocity_mps - self.frame.T @ self.velocity_mps
        self._correct(innovation, measurement, self.config.dvl_noise_mps**2 * np.eye(3))

    def correct_depth(self, depth_m: float) -> None:
        """One sample of the depth sensor."""
        measurement = np.zeros((1, STATES))
        measurement[0, POSITION.stop - 1] = measurement[0, DEPTH_ERROR] = 1.0
        innovation = np.array([depth_m - self.depth_m - self.depth_error_m])
        self._correct(innovation, measurement, self.config.depth_noise_m**2 * np.eye(1))

    def _correct(self, innovation: FloatArray, measurement: FloatArray, noise: FloatArray) -> None:
        self.filter.dim_z = len(innovation)
        self.filter.update(innovation[:, np.newaxis], R=noise, H=measurement)
        error = self.filter.x[:, 0]
        self.frame = Rotation.from_rotvec(error[ATTITUDE]).as_matrix() @ self.frame
        self.velocity_mps = self.velocity_mps + error[VELOCITY]
        self.latitude_rad += error[POSITION.start] / EARTH_RADIUS_M
        self.depth_m += error[POSITION.stop - 1]
        self.force_bias_mps2 = self.force_bias_mps2 + error[FORCE_BIAS]
        self.rate_bias_radps = self.rate_bias_radps + error[RATE_BIAS]
        self.depth_error_m += error[DEPTH_ERROR]
        self.filter.x = np.zeros((STATES, 1))


def skew(vector: FloatArray) -> FloatArray:
    """(3, 3) of which the product with another vector is the cross product."""
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
