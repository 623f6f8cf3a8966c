"""The ellipsoid, and motion on it, in earth-centred, earth-fixed coordinates: written apart from what is tested."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import atan2, cos, hypot, sin, sqrt

import numpy as np
from scipy.integrate import solve_ivp

from detectors.navigation.earth import gravity_mps2
from detectors.navigation.sample import Vector

A_M, B_M = 6378137.0, 6356752.314245179
SPIN = 7.292115e-5
SPIN_MATRIX = SPIN * np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])


def ecef_m(latitude_rad: float, longitude_rad: float, depth_m: float) -> np.ndarray:
    """(3,) Position, from the form of the ellipse by its two axes."""
    cosine, sine = cos(latitude_rad), sin(latitude_rad)
    normal = A_M**2 / hypot(A_M * cosine, B_M * sine)
    axial = (normal - depth_m) * cosine
    return np.array(
        [axial * cos(longitude_rad), axial * sin(longitude_rad), (normal * (B_M / A_M) ** 2 - depth_m) * sine]
    )


def ned_axes(latitude_rad: float, longitude_rad: float) -> np.ndarray:
    """(3, 3) North, east and down as rows: matrix @ earth-fixed vector = north-east-down vector."""
    cosine, sine = cos(latitude_rad), sin(latitude_rad)
    along, across = cos(longitude_rad), sin(longitude_rad)
    return np.array(
        [[-sine * along, -sine * across, cosine], [-across, along, 0.0], [-cosine * along, -cosine * across, -sine]]
    )


def geodetic(position_m: np.ndarray) -> tuple[float, float, float]:
    """Latitude, longitude and depth of an earth-fixed position, by iteration."""
    x, y, z = position_m.tolist()
    axial, squared = hypot(x, y), 1.0 - (B_M / A_M) ** 2
    latitude = atan2(z, axial * (1.0 - squared))
    for _ in range(4):  # each gains three digits
        normal = A_M / sqrt(1.0 - squared * sin(latitude) ** 2)
        latitude = atan2(z + squared * normal * sin(latitude), axial)
    # the height by an equation that is well-conditioned at any latitude
    height = axial * cos(latitude) + z * sin(latitude) - A_M * sqrt(1.0 - squared * sin(latitude) ** 2)
    return latitude, atan2(y, x), -height


def every(interval_s: float, duration_s: float) -> np.ndarray:
    """Times from 0 on."""
    return np.arange(round(duration_s / interval_s) + 1) * interval_s


@dataclass(frozen=True)
class Truth:
    """State of a motion: geodetic position, velocity and direction cosines in north-east-down there."""

    latitude_rad: float
    longitude_rad: float
    depth_m: float
    velocity_mps: np.ndarray
    cosines: np.ndarray

    def distance_m(self, latitude_rad: float, longitude_rad: float, depth_m: float) -> float:
        here = ecef_m(self.latitude_rad, self.longitude_rad, self.depth_m)
        return float(np.linalg.norm(here - ecef_m(latitude_rad, longitude_rad, depth_m)))


@dataclass(frozen=True)
class Motion:
    """What an IMU feels while a vehicle moves, and where that leads.

    Attributes:
        attitude: roll, pitch, yaw at times (N,), and their rates, each (3, N): as on a flat earth that stands still.
        acceleration_mps2: north, east, down at times (N,): the same.
        latitude_rad, longitude_rad, depth_m, velocity_mps: at the beginning.
    """

    attitude: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]
    acceleration_mps2: Callable[[np.ndarray], np.ndarray]
    latitude_rad: float
    longitude_rad: float = 0.5
    depth_m: float = 20.0
    velocity_mps: Vector = (0.0, 0.0, 0.0)

    def felt(self, time_s: np.ndarray) -> np.ndarray:
        """(6, N) Specific force and angular rate of the body."""
        (roll, pitch, _), (roll_rate, pitch_rate, yaw_rate) = angles, _ = self.attitude(time_s)
        back = np.swapaxes(_cosines(*angles), 0, 1)
        earth = np.array([SPIN * cos(self.latitude_rad), 0.0, -SPIN * sin(self.latitude_rad)])
        gravity = np.array([0.0, 0.0, gravity_mps2(self.latitude_rad, self.depth_m)])
        turning = np.array(
            [
                roll_rate - yaw_rate * np.sin(pitch),
                pitch_rate * np.cos(roll) + yaw_rate * np.sin(roll) * np.cos(pitch),
                yaw_rate * np.cos(roll) * np.cos(pitch) - pitch_rate * np.sin(roll),
            ]
        )
        force = np.einsum("ijn,jn->in", back, self.acceleration_mps2(time_s) - gravity[:, None])
        return np.concatenate((force, turning + np.einsum("ijn,j->in", back, earth)))

    def samples(self, edges_s: Sequence[float]) -> list[tuple[Vector, Vector, float]]:
        """Means of specific force and angular rate between these times, and the interval: by Gauss's rule."""
        nodes, weights = np.polynomial.legendre.leggauss(4)
        begins, lasts = np.array(edges_s[:-1]), np.diff(edges_s)
        means = sum(
            0.5 * weight * self.felt(begins + 0.5 * (1.0 + node) * lasts)
            for node, weight in zip(nodes, weights, strict=True)
        )
        return [
            (tuple(row[:3]), tuple(row[3:]), last) for row, last in zip(means.T.tolist(), lasts.tolist(), strict=True)
        ]

    def truth(self, times_s: Sequence[float]) -> list[Truth]:
        """Where that leads on the turning ellipsoid, at these times: to 0.1 mm in ten minutes."""
        origin = ecef_m(self.latitude_rad, self.longitude_rad, self.depth_m)
        axes = ned_axes(self.latitude_rad, self.longitude_rad)
        cosines = _cosines(*self.attitude(np.zeros(1))[0])[..., 0]
        start = np.concatenate((np.zeros(3), axes.T @ self.velocity_mps, (axes.T @ cosines).ravel()))
        solution = solve_ivp(
            lambda time, values: self._derivative(time, values, origin),
            (0.0, max(times_s)),
            start,
            method="DOP853",
            t_eval=times_s,
            rtol=1e-10,
            atol=1e-10,
            max_step=2.0,
        )
        return [_truth(values, origin) for values in solution.y.T]

    def _derivative(self, time_s: float, values: np.ndarray, origin: np.ndarray) -> np.ndarray:
        velocity, cosines = values[3:6], values[6:].reshape(3, 3)
        felt = self.felt(np.array([time_s]))[:, 0]
        latitude, longitude, depth = geodetic(origin + values[:3])
        down = ned_axes(latitude, longitude)[2]
        acceleration = cosines @ felt[:3] - 2.0 * SPIN_MATRIX @ velocity + gravity_mps2(latitude, depth) * down
        turning = cosines @ _skew(felt[3:]) - SPIN_MATRIX @ cosines
        return np.concatenate((velocity, acceleration, turning.ravel()))


def _truth(values: np.ndarray, origin: np.ndarray) -> Truth:
    latitude, longitude, depth = geodetic(origin + values[:3])
    axes = ned_axes(latitude, longitude)
    return Truth(latitude, longitude, depth, axes @ values[3:6], axes @ values[6:].reshape(3, 3))


def _cosines(roll: np.ndarray, pitch: np.ndarray, yaw: np.ndarray) -> np.ndarray:
    """(3, 3, N) The product of three elementary rotations, written out."""
    (sr, sp, sy), (cr, cp, cy) = np.sin((roll, pitch, yaw)), np.cos((roll, pitch, yaw))
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def _skew(vector: np.ndarray) -> np.ndarray:
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
