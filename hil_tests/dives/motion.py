"""How a vehicle moves over the turning earth, and what perfect inertial sensors feel of it.

The motion is given, not integrated: roll, pitch, yaw and the velocity over ground are splines of time, and the rates
and forces their derivatives. So this shares nothing with a navigation system, which goes the other way. The frame of
the earth is north-east-down on the ellipsoid WGS 84, that of the body forward-right-down.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

FloatArray = NDArray[np.float64]

# WGS 84 (NIMA TR8350.2): semi-major axis, first eccentricity squared, turning rate, and normal gravity at the equator
# with the factor of Somigliana's formula.
SEMI_MAJOR_M = 6378137.0
ECCENTRICITY_2 = 6.69437999014e-3
EARTH_RATE_RADPS = 7.292115e-5
EQUATOR_GRAVITY_MPS2 = 9.7803253359
SOMIGLIANA = 1.931852652458e-3
# Growth with depth: the free-air gradient, less twice the pull of the layer of sea water above (4 pi G rho).
GRAVITY_GRADIENT_MPS2_M = 3.086e-6 - 0.860e-6


@dataclass(frozen=True, slots=True, eq=False)
class Motion:
    """Attitude, velocity and position as functions of time, smooth in their first two derivatives.

    Attributes:
        attitude_rad: of roll, pitch and yaw, (3,), yaw without jumps.
        velocity_mps: over ground, north, east, down.
        position: latitude in rad, longitude in rad, depth in m.
    """

    attitude_rad: CubicSpline
    velocity_mps: CubicSpline
    position: CubicSpline

    def frame(self, time_s: FloatArray) -> Rotation:
        """(N,) rotations from the body to north-east-down."""
        return Rotation.from_euler("ZYX", self.attitude_rad(time_s)[:, ::-1])

    def body_velocity_mps(self, time_s: FloatArray, arm_m: Sequence[float] = (0.0, 0.0, 0.0)) -> FloatArray:
        """(N, 3) velocity over ground of a point of the hull, in its own axes.

        Args:
            time_s: (N,)
            arm_m: (3,) from the inertial sensors to the point.
        """
        centre_mps = self.frame(time_s).inv().apply(self.velocity_mps(time_s))
        return np.asarray(centre_mps + np.cross(self.turning_radps(time_s), arm_m))

    def turning_radps(self, time_s: FloatArray) -> FloatArray:
        """(N, 3) angular rate of the body against north-east-down, in the axes of the body."""
        roll, pitch, _ = self.attitude_rad(time_s).T
        roll_radps, pitch_radps, yaw_radps = self.attitude_rad(time_s, 1).T
        return np.column_stack(
            [
                roll_radps - yaw_radps * np.sin(pitch),
                pitch_radps * np.cos(roll) + yaw_radps * np.sin(roll) * np.cos(pitch),
                yaw_radps * np.cos(roll) * np.cos(pitch) - pitch_radps * np.sin(roll),
            ]
        )

    def angular_rate_radps(self, time_s: FloatArray) -> FloatArray:
        """(N, 3) what a gyroscope measures: with the earth's rate and that of north-east-down over it."""
        carried = self._earth_rate_radps(time_s) + self._transport_rate_radps(time_s)
        return np.asarray(self.turning_radps(time_s) + self.frame(time_s).inv().apply(carried))

    def specific_force_mps2(self, time_s: FloatArray) -> FloatArray:
        """(N, 3) what an accelerometer measures: acceleration without gravity, with that of Coriolis."""
        velocity_mps = self.velocity_mps(time_s)
        turning = 2.0 * self._earth_rate_radps(time_s) + self._transport_rate_radps(time_s)
        force_mps2 = self.velocity_mps(time_s, 1) + np.cross(turning, velocity_mps)
        latitude_rad, _, depth_m = self.position(time_s).T
        force_mps2[:, 2] -= gravity_mps2(latitude_rad, depth_m)
        return np.asarray(self.frame(time_s).inv().apply(force_mps2))

    def _earth_rate_radps(self, time_s: FloatArray) -> FloatArray:
        latitude_rad = self.position(time_s)[:, 0]
        axis = [np.cos(latitude_rad), np.zeros_like(latitude_rad), -np.sin(latitude_rad)]
        return EARTH_RATE_RADPS * np.column_stack(axis)

    def _transport_rate_radps(self, time_s: FloatArray) -> FloatArray:
        """North-east-down turns by as much as the position goes round the earth."""
        latitude_rad = self.position(time_s)[:, 0]
        latitude_radps, longitude_radps, _ = self.position(time_s, 1).T
        return np.column_stack(
            [longitude_radps * np.cos(latitude_rad), -latitude_radps, -longitude_radps * np.sin(latitude_rad)]
        )


def motion_of(
    time_s: FloatArray, attitude_rad: FloatArray, body_mps: FloatArray, start: tuple[float, float, float]
) -> Motion:
    """The motion through these attitudes, with these velocities.

    Args:
        time_s: (N,) instants, so dense that a spline through them is smooth.
        attitude_rad: (N, 3) roll, pitch, yaw without jumps; pitch below a right angle.
        body_mps: (N, 3) velocity over ground in the axes of the body.
        start: latitude in rad, longitude in rad, depth in m at the first instant.
    """
    attitude = CubicSpline(time_s, attitude_rad)
    velocity = CubicSpline(time_s, Rotation.from_euler("ZYX", attitude_rad[:, ::-1]).apply(body_mps))
    way_m = velocity.antiderivative()(time_s)
    # first on a sphere of the radii at the start, then with those where that way leads
    near = np.array(start) + way_m * _per_metre(np.full(len(time_s), start[0]), start[2] + way_m[:, 2])
    rates = CubicSpline(time_s, velocity(time_s) * _per_metre(near[:, 0], near[:, 2]))
    position = CubicSpline(time_s, np.array(start) + rates.antiderivative()(time_s))
    return Motion(attitude, velocity, position)


def gravity_mps2(latitude_rad: FloatArray, depth_m: FloatArray) -> FloatArray:
    """(N,) normal gravity (Somigliana) and its growth with the depth of sea water."""
    sine_2 = np.sin(latitude_rad) ** 2
    normal = EQUATOR_GRAVITY_MPS2 * (1.0 + SOMIGLIANA * sine_2) / np.sqrt(1.0 - ECCENTRICITY_2 * sine_2)
    return np.asarray(normal + GRAVITY_GRADIENT_MPS2_M * depth_m)


def radii_m(latitude_rad: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(N,) each: radii of curvature of the ellipsoid, along the meridian and across it."""
    left = 1.0 - ECCENTRICITY_2 * np.sin(latitude_rad) ** 2
    return SEMI_MAJOR_M * (1.0 - ECCENTRICITY_2) / left**1.5, SEMI_MAJOR_M / np.sqrt(left)


def _per_metre(latitude_rad: FloatArray, depth_m: FloatArray) -> FloatArray:
    """(N, 3) change of latitude, longitude and depth for each metre north, east and down."""
    meridian_m, transverse_m = radii_m(latitude_rad)
    north, east = 1.0 / (meridian_m - depth_m), 1.0 / ((transverse_m - depth_m) * np.cos(latitude_rad))
    return np.column_stack([north, east, np.ones_like(north)])
