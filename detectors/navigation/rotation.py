"""Attitudes as unit quaternions (w, x, y, z), which turn vectors of the body into the frame north-east-down.

Plain tuples and floats: for three or four numbers numpy is ten times slower.
"""

from __future__ import annotations

from math import atan2, copysign, cos, hypot, sin, sqrt

import numpy as np
from numpy.typing import NDArray

from detectors.navigation.sample import Vector

Quaternion = tuple[float, float, float, float]
FloatArray = NDArray[np.float64]

IDENTITY: Quaternion = (1.0, 0.0, 0.0, 0.0)
# Below it, four terms of a series are exact to the last bit.
_SMALL_RAD = 1e-2
# Nearer to straight up or down than this, roll and heading turn about the same axis.
_GIMBAL_LOCK = 1e-10


def product(left: Quaternion, right: Quaternion) -> Quaternion:
    """The rotation `right`, followed by `left`."""
    a, b, c, d = left
    w, x, y, z = right
    return (
        a * w - b * x - c * y - d * z,
        a * x + b * w + c * z - d * y,
        a * y - b * z + c * w + d * x,
        a * z + b * y - c * x + d * w,
    )


def normalised(attitude: Quaternion) -> Quaternion:
    """Of unit length again, after many products have rounded.

    Raises:
        ValueError: of no length.
    """
    w, x, y, z = attitude
    length = sqrt(w * w + x * x + y * y + z * z)
    if not length > 0.0:
        raise ValueError(f"attitude = {attitude}: want a quaternion of a length above 0")
    return w / length, x / length, y / length, z / length


def inverse(attitude: Quaternion) -> Quaternion:
    """The rotation back."""
    w, x, y, z = attitude
    return w, -x, -y, -z


def rotate(attitude: Quaternion, vector: Vector) -> Vector:
    """(3,) A vector of the body, in north-east-down."""
    w, x, y, z = attitude
    a, b, c = vector
    # v + 2 w (q x v) + 2 q x (q x v)
    across = 2.0 * (y * c - z * b)
    along = 2.0 * (z * a - x * c)
    about = 2.0 * (x * b - y * a)
    return (
        a + w * across + y * about - z * along,
        b + w * along + z * across - x * about,
        c + w * about + x * along - y * across,
    )


def rotate_back(attitude: Quaternion, vector: Vector) -> Vector:
    """(3,) A vector in north-east-down, in the frame of the body."""
    w, x, y, z = attitude
    return rotate((-w, x, y, z), vector)


def from_rotation_vector(vector_rad: Vector) -> Quaternion:
    """The rotation about this axis by as many radians as the vector is long; exact for small ones, too."""
    x, y, z = vector_rad
    squared = 0.25 * (x * x + y * y + z * z)
    if squared < _SMALL_RAD**2:
        # cos(a) and sin(a) / a of the half angle a
        real = 1.0 - squared * (0.5 - squared * (1.0 / 24.0 - squared / 720.0))
        half = 0.5 - squared * (1.0 / 12.0 - squared * (1.0 / 240.0 - squared / 10080.0))
    else:
        angle = sqrt(squared)
        real, half = cos(angle), 0.5 * sin(angle) / angle
    return real, half * x, half * y, half * z


def to_rotation_vector(attitude: Quaternion) -> Vector:
    """(3,) Axis times angle, of the shorter way round: 0 to pi."""
    w, x, y, z = attitude
    sine = sqrt(x * x + y * y + z * z)
    if sine == 0.0:
        return 0.0, 0.0, 0.0
    factor = 2.0 * atan2(copysign(sine, w), abs(w)) / sine
    return factor * x, factor * y, factor * z


def between(first: Quaternion, second: Quaternion) -> Vector:
    """(3,) The rotation vector, in north-east-down, that turns the attitude `first` into `second`."""
    return to_rotation_vector(product(second, inverse(first)))


def from_euler(attitude_rad: Vector) -> Quaternion:
    """From roll, pitch and yaw: turned by yaw about down, then by pitch about right, then by roll about forward."""
    roll, pitch, yaw = (0.5 * angle for angle in attitude_rad)
    about_forward = (cos(roll), sin(roll), 0.0, 0.0)
    about_right = (cos(pitch), 0.0, sin(pitch), 0.0)
    about_down = (cos(yaw), 0.0, 0.0, sin(yaw))
    return product(product(about_down, about_right), about_forward)


def to_euler(attitude: Quaternion) -> Vector:
    """(3,) Roll, pitch and yaw. Straight up or down, where only the sum or difference of roll and yaw is a fact, the
    roll is 0."""
    w, x, y, z = attitude
    forward_north, forward_east = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z)
    level = hypot(forward_north, forward_east)
    pitch = atan2(2.0 * (w * y - x * z), level)
    if level < _GIMBAL_LOCK:
        return 0.0, pitch, atan2(2.0 * (w * z - x * y), 1.0 - 2.0 * (x * x + z * z))
    roll = atan2(2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y))
    return roll, pitch, atan2(forward_east, forward_north)


def matrix(attitude: Quaternion) -> FloatArray:
    """(3, 3) The direction cosines: matrix @ vector of the body = vector in north-east-down."""
    w, x, y, z = attitude
    return np.array(
        (
            (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
            (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
            (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)),
        )
    )


def cross(left: Vector, right: Vector) -> Vector:
    """(3,) left x right."""
    a, b, c = left
    x, y, z = right
    return b * z - c * y, c * x - a * z, a * y - b * x
