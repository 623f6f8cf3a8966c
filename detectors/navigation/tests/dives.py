"""Simulated dives: a motion that is prescribed, and what sensors mounted somewhere on the vehicle say of it.

Written apart from the filter: the motion is given as attitude and velocity along the body's axes, and differentiated
for what an IMU feels, on the turning ellipsoid; nothing is integrated but the position.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from math import cos, sin

import numpy as np
from scipy.spatial.transform import Rotation

from detectors.navigation.earth import gravity_mps2
from detectors.navigation.sample import (
    AttitudeSample,
    DepthSample,
    DvlSample,
    FixSample,
    ImuSample,
    NavigationSample,
    NavigationState,
    Vector,
)
from detectors.navigation.tests.ecef import A_M, B_M, SPIN

# (6, N) at times (N,): roll, pitch, yaw, and velocity forward, right, down
Motion = Callable[[np.ndarray], np.ndarray]
DIFFERENCE_S = 1e-4
FINE_S = 0.01


def manoeuvring(time_s: np.ndarray) -> np.ndarray:
    """Turns, speeds up and slows down, climbs and sinks all the time: everything can be learnt from it."""
    t = time_s
    roll = 0.12 * np.sin(0.7 * t)
    pitch = 0.25 * np.sin(0.21 * t) + 0.05 * np.sin(0.9 * t)
    yaw = 1.5 * np.sin(0.12 * t) + 0.5 * np.sin(0.37 * t)
    ahead = 1.3 + 0.5 * np.sin(0.25 * t) + 0.2 * np.sin(0.8 * t)
    return np.array([roll, pitch, yaw, ahead, 0.15 * np.sin(0.33 * t), 0.1 * np.sin(0.45 * t)])


def legs(time_s: np.ndarray) -> np.ndarray:
    """Straight on for half a minute and a quarter turn in ten seconds, again and again, at a nearly even speed."""
    t = time_s
    share = np.clip((np.mod(t, 40.0) - 30.0) / 10.0, 0.0, 1.0)
    yaw = 0.5 * np.pi * (np.floor(t / 40.0) + share**3 * (10.0 - 15.0 * share + 6.0 * share**2))
    ahead = 1.5 + 0.1 * np.sin(0.15 * t)
    still = np.zeros_like(t)
    return np.array([0.02 * np.sin(0.8 * t), 0.03 + 0.03 * np.sin(0.2 * t), yaw, ahead, still, still])


@dataclass(frozen=True, kw_only=True)
class Mounting:
    """How DVL and depth sensor are fitted, and how late their samples are stamped."""

    lever_arm_m: Vector = (0.0, 0.0, 0.0)
    rotation_rad: Vector = (0.0, 0.0, 0.0)
    scale: float = 0.0
    dvl_delay_s: float = 0.0
    depth_delay_s: float = 0.0
    depth_arm_m: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Dive:
    """A vehicle under way, and its sensors; a rate of 0 is no such sensor.

    Attributes:
        accelerometer_noise_mps2, gyroscope_noise_radps: per root Hz; the other noises are of each sample.
    """

    motion: Motion = manoeuvring
    duration_s: float = 120.0
    mounting: Mounting = Mounting()
    seed: int = 0
    latitude_rad: float = 0.57
    longitude_rad: float = 0.61
    depth_m: float = 30.0
    imu_hz: float = 50.0
    dvl_hz: float = 2.0
    depth_hz: float = 1.0
    fix_hz: float = 0.0
    attitude_hz: float = 0.0
    accelerometer_bias_mps2: Vector = (0.02, -0.015, 0.01)
    gyroscope_bias_radps: Vector = (3e-4, -2e-4, 4e-4)
    accelerometer_noise_mps2: float = 1e-3
    gyroscope_noise_radps: float = 1e-4
    dvl_noise_mps: float = 0.01
    depth_noise_m: float = 0.05
    fix_noise_m: float = 1.0
    heading_noise_rad: float = 0.01

    @property
    def initial(self) -> NavigationState:
        """The truth at the beginning."""
        return self.truth(0.0)

    def truth(self, time_s: float) -> NavigationState:
        """Where the vehicle is, and how it moves."""
        times_s = np.array([time_s])
        angles, velocity, position = self.motion(times_s)[:3], self._velocity(times_s), self._displacement(times_s)
        return self._state(time_s, angles[:, 0], velocity[:, 0], position[:, 0])

    def samples(self) -> list[NavigationSample]:
        """Of all sensors, in the order of their stamps; inertial ones first."""
        rng = np.random.default_rng(self.seed)
        streams = (self._imu(rng), self._dvl(rng), self._depths(rng), self._fixes(rng), self._attitudes(rng))
        return sorted((sample for stream in streams for sample in stream), key=lambda sample: sample.time_s)

    def _state(
        self, time_s: float, angles: np.ndarray, velocity: np.ndarray, position: np.ndarray
    ) -> NavigationState:
        north_m, east_m, down_m = position.tolist()
        meridian_m, transverse_m = self._radii_m
        return NavigationState(
            time_s,
            self.latitude_rad + north_m / meridian_m,
            self.longitude_rad + east_m / (transverse_m * cos(self.latitude_rad)),
            self.depth_m + down_m,
            tuple(velocity.tolist()),
            tuple(angles.tolist()),
        )

    @property
    def _radii_m(self) -> tuple[float, float]:
        """Along the meridian and across it, at this depth, from the axes of the ellipse."""
        squared = (A_M * cos(self.latitude_rad)) ** 2 + (B_M * sin(self.latitude_rad)) ** 2
        return (A_M * B_M) ** 2 / squared**1.5 - self.depth_m, A_M**2 / squared**0.5 - self.depth_m

    def _turned(self, time_s: np.ndarray) -> Rotation:
        """Body to north-east-down."""
        return Rotation.from_euler("ZYX", self.motion(time_s)[2::-1].T)

    def _velocity(self, time_s: np.ndarray) -> np.ndarray:
        """(3, N) north, east, down."""
        return self._turned(time_s).apply(self.motion(time_s)[3:].T).T

    @cached_property
    def _fine(self) -> tuple[np.ndarray, np.ndarray]:
        times_s = np.arange(round((self.duration_s + 3.0) / FINE_S) + 1) * FINE_S
        velocity = self._velocity(times_s)
        way = np.cumsum(0.5 * FINE_S * (velocity[:, 1:] + velocity[:, :-1]), axis=1)
        return times_s, np.concatenate((np.zeros((3, 1)), way), axis=1)

    def _displacement(self, time_s: np.ndarray) -> np.ndarray:
        """(3, N) metres north, east, down since the beginning."""
        times_s, way = self._fine
        return np.array([np.interp(time_s, times_s, axis) for axis in way])

    def _rate(self, time_s: np.ndarray) -> np.ndarray:
        """(3, N) turn rate of the body against north-east-down, along its own axes."""
        before, after = self._turned(time_s - DIFFERENCE_S), self._turned(time_s + DIFFERENCE_S)
        return (before.inv() * after).as_rotvec().T / (2.0 * DIFFERENCE_S)

    def _felt(self, time_s: np.ndarray) -> np.ndarray:
        """(6, N) Specific force and angular rate of the body, against the stars."""
        velocity = self._velocity(time_s)
        change = self._velocity(time_s + DIFFERENCE_S) - self._velocity(time_s - DIFFERENCE_S)
        depth_m = self.depth_m + self._displacement(time_s)[2]
        gravity = np.zeros_like(velocity)
        gravity[2] = [gravity_mps2(self.latitude_rad, one) for one in depth_m.tolist()]
        earth = SPIN * np.array([cos(self.latitude_rad), 0.0, -sin(self.latitude_rad)])
        meridian_m, transverse_m = self._radii_m
        north, east, _ = velocity
        carried = np.array(
            [east / transverse_m, -north / meridian_m, -east * np.tan(self.latitude_rad) / transverse_m]
        )
        coriolis = np.cross((2.0 * earth[:, None] + carried).T, velocity.T).T
        to_body = self._turned(time_s).inv()
        force = to_body.apply((change / (2.0 * DIFFERENCE_S) + coriolis - gravity).T).T
        return np.concatenate((force, self._rate(time_s) + to_body.apply((earth[:, None] + carried).T).T))

    def _imu(self, rng: np.random.Generator) -> list[NavigationSample]:
        """Means over the intervals, by Gauss's rule."""
        edges_s = np.arange(round(self.duration_s * self.imu_hz) + 1) / self.imu_hz
        nodes, weights = np.polynomial.legendre.leggauss(2)
        means = sum(
            0.5 * weight * self._felt(edges_s[:-1] + 0.5 * (1.0 + node) / self.imu_hz)
            for node, weight in zip(nodes, weights, strict=True)
        )
        density = np.repeat((self.accelerometer_noise_mps2, self.gyroscope_noise_radps), 3)[:, None]
        bias = np.concatenate((self.accelerometer_bias_mps2, self.gyroscope_bias_radps))[:, None]
        said = means + bias + density * np.sqrt(self.imu_hz) * rng.normal(size=means.shape)
        return [
            ImuSample(time_s, tuple(row[:3]), tuple(row[3:]))
            for time_s, row in zip(edges_s[1:].tolist(), said.T.tolist(), strict=True)
        ]

    def _instants(self, rate_hz: float) -> np.ndarray:
        return np.arange(1, int(self.duration_s * rate_hz) + 1) / rate_hz if rate_hz else np.zeros(0)

    def _dvl(self, rng: np.random.Generator) -> list[NavigationSample]:
        times_s, mounting = self._instants(self.dvl_hz), self.mounting
        lever = np.cross(self._rate(times_s).T, mounting.lever_arm_m)
        along = Rotation.from_rotvec(mounting.rotation_rad).inv().apply(self.motion(times_s)[3:].T + lever)
        said = (1.0 + mounting.scale) * along + self.dvl_noise_mps * rng.normal(size=along.shape)
        stamps = (times_s + mounting.dvl_delay_s).tolist()
        return [DvlSample(time_s, tuple(row)) for time_s, row in zip(stamps, said.tolist(), strict=True)]

    def _depths(self, rng: np.random.Generator) -> list[NavigationSample]:
        times_s, mounting = self._instants(self.depth_hz), self.mounting
        place = self._turned(times_s).apply((mounting.depth_arm_m, 0.0, 0.0))
        depths = self.depth_m + self._displacement(times_s)[2] + place.reshape(-1, 3)[:, 2]
        said = depths + self.depth_noise_m * rng.normal(size=depths.shape)
        stamps = (times_s + mounting.depth_delay_s).tolist()
        return [DepthSample(time_s, depth) for time_s, depth in zip(stamps, said.tolist(), strict=True)]

    def _fixes(self, rng: np.random.Generator) -> list[NavigationSample]:
        fixes: list[NavigationSample] = []
        for time_s in self._instants(self.fix_hz).tolist():
            position = self._displacement(np.array([time_s]))[:, 0]
            position[:2] += self.fix_noise_m * rng.normal(size=2)
            state = self._state(time_s, np.zeros(3), np.zeros(3), position)
            fixes.append(FixSample(time_s, state.latitude_rad, state.longitude_rad))
        return fixes

    def _attitudes(self, rng: np.random.Generator) -> list[NavigationSample]:
        times_s = self._instants(self.attitude_hz)
        angles = self.motion(times_s)[:3] + self.heading_noise_rad * rng.normal(size=(3, len(times_s)))
        return [
            AttitudeSample(time_s, tuple(row))
            for time_s, row in zip(times_s.tolist(), angles.T.tolist(), strict=True)
        ]


def changed_dvl(
    samples: list[NavigationSample], change: Callable[[float, np.ndarray], np.ndarray], *, since_s: float
) -> list[NavigationSample]:
    """With another velocity (3,) from an instant on: `change` takes the seconds since then, and the true one."""

    def changed(sample: NavigationSample) -> NavigationSample:
        if not isinstance(sample, DvlSample) or sample.time_s < since_s:
            return sample
        velocity = change(sample.time_s - since_s, np.array(sample.velocity_mps))
        return replace(sample, velocity_mps=tuple(np.asarray(velocity, dtype=float).tolist()))

    return [changed(sample) for sample in samples]


def changed_depth(
    samples: list[NavigationSample], change: Callable[[float, float], float], *, since_s: float
) -> list[NavigationSample]:
    """The same of the depth."""
    return [
        replace(sample, depth_m=change(sample.time_s - since_s, sample.depth_m))
        if isinstance(sample, DepthSample) and sample.time_s >= since_s
        else sample
        for sample in samples
    ]


def changed_imu(
    samples: list[NavigationSample],
    *,
    since_s: float,
    force_mps2: Vector = (0.0,) * 3,
    rate_radps: Vector = (0.0,) * 3,
) -> list[NavigationSample]:
    """With these biases added from an instant on."""

    def changed(sample: NavigationSample) -> NavigationSample:
        if not isinstance(sample, ImuSample) or sample.time_s < since_s:
            return sample
        force = np.add(sample.specific_force_mps2, force_mps2)
        rate = np.add(sample.angular_rate_radps, rate_radps)
        return ImuSample(sample.time_s, tuple(force.tolist()), tuple(rate.tolist()))

    return [changed(sample) for sample in samples]
