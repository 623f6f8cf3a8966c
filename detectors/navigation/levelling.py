"""Which way is down, from an IMU and a DVL on a vehicle that is under way."""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot

import numpy as np
from numpy.typing import NDArray

from detectors.navigation.config import NavigationConfig
from detectors.navigation.rotation import (
    IDENTITY,
    Quaternion,
    cross,
    from_euler,
    from_rotation_vector,
    matrix,
    product,
    rotate,
)
from detectors.navigation.sample import DvlSample, ImuSample, Vector

FloatArray = NDArray[np.float64]

GAP_MAX_S = 1.0
VELOCITIES_MIN = 3  # a line through two is no test of either


@dataclass(frozen=True, slots=True)
class Levelled:
    """What a vehicle's own sensors say of its attitude, at the end of a span.

    Attributes:
        gravity_mps2: (3,) in the body; its direction is down.
        velocity_mps: (3,) of the IMU over ground, in the body; None without a DVL.
    """

    gravity_mps2: Vector
    velocity_mps: Vector | None


@dataclass(frozen=True, slots=True)
class _Moment:
    """Where the body is, after one sample, as seen in the axes that it had at the beginning.

    Attributes:
        attitude: by the gyroscopes.
        gained_mps: integral of the specific force.
    """

    time_s: float
    attitude: Quaternion
    gained_mps: Vector
    angular_rate_radps: Vector


class Levelling:
    """Levels by what remains of the specific force when the vehicle's own acceleration is taken away.

    In axes that do not turn (those of the body at the beginning, carried on by the gyroscopes), velocity is
    v(t) = v(0) + integral of the specific force + g t. So g is the slope of what the DVL measures, turned into these
    axes, less that integral: the straight line of least squares through a span's samples. Turns and changes of speed
    are in there, centripetal parts included. Without a DVL the velocity counts as constant, and g is the mean
    specific force, turned round.

    A gyroscope's bias tilts it by half of what it turns in the span; the turning of the earth in so short a time is
    nothing.
    """

    def __init__(self, config: NavigationConfig) -> None:
        self._lever_arm_m = config.dvl_lever_arm_m
        self._mounting = from_euler(config.dvl_mounting_rad)
        self._delay_s = config.dvl_delay_s
        self.restart()

    def restart(self) -> None:
        """Begins another span."""
        self._moments: list[_Moment] = []
        self._velocities: list[DvlSample] = []

    @property
    def span_s(self) -> float:
        """So long is the span by now."""
        return self._moments[-1].time_s - self._moments[0].time_s if self._moments else 0.0

    def turn(self, sample: ImuSample) -> None:
        """Takes the next sample of the IMU; after a gap it is the first of a new span."""
        if self._moments and sample.time_s - self._moments[-1].time_s > GAP_MAX_S:
            self.restart()
        if not self._moments:
            self._moments.append(_Moment(sample.time_s, IDENTITY, (0.0, 0.0, 0.0), sample.angular_rate_radps))
            return
        last = self._moments[-1]
        interval_s = sample.time_s - last.time_s
        x, y, z = sample.angular_rate_radps
        half = from_rotation_vector((0.5 * interval_s * x, 0.5 * interval_s * y, 0.5 * interval_s * z))
        middle = product(last.attitude, half)
        north, east, down = rotate(middle, sample.specific_force_mps2)
        gained = last.gained_mps
        gained = (gained[0] + interval_s * north, gained[1] + interval_s * east, gained[2] + interval_s * down)
        self._moments.append(_Moment(sample.time_s, product(middle, half), gained, sample.angular_rate_radps))

    def measure(self, sample: DvlSample) -> None:
        """Takes the next sample of the DVL."""
        self._velocities.append(sample)

    def level(self) -> Levelled:
        """What the span says.

        Raises:
            ValueError: it has no length yet.
        """
        if not self.span_s > 0.0:
            raise ValueError("levelling needs two samples of the IMU at least")
        end = self._moments[-1]
        back = matrix(end.attitude).T
        times, velocities = self._measured()
        if len(times) < VELOCITIES_MIN:
            return Levelled(_vector(back @ np.array(end.gained_mps) / -self.span_s), None)
        centre_s = float(times.mean())
        gravity = (times - centre_s) @ velocities / ((times - centre_s) @ (times - centre_s))
        velocity = velocities.mean(axis=0) + gravity * (end.time_s - centre_s) + np.array(end.gained_mps)
        return Levelled(_vector(back @ gravity), _vector(back @ velocity))

    def _measured(self) -> tuple[FloatArray, FloatArray]:
        """(M,) times and (M, 3) velocities by the DVL within the span, less the integral of the specific force."""
        times = np.array([moment.time_s for moment in self._moments])
        rows = []
        for sample in self._velocities:
            time_s = sample.time_s - self._delay_s
            if times[0] <= time_s <= times[-1]:
                moment = self._moments[int(np.searchsorted(times, time_s))]
                # at the moment's own time: gravity gains 0.1 m/s in the 10 ms between the two, the vehicle little
                rows.append((moment.time_s, *self._less_gained(moment, sample)))
        measured = np.array(rows).reshape(-1, 4)
        return measured[:, 0], measured[:, 1:]

    def _less_gained(self, moment: _Moment, sample: DvlSample) -> Vector:
        velocity = at_imu(sample.velocity_mps, moment.angular_rate_radps, self._mounting, self._lever_arm_m)
        x, y, z = rotate(moment.attitude, velocity)
        gained_x, gained_y, gained_z = moment.gained_mps
        return x - gained_x, y - gained_y, z - gained_z


def at_imu(velocity_mps: Vector, angular_rate_radps: Vector, mounting: Quaternion, lever_arm_m: Vector) -> Vector:
    """(3,) velocity of the IMU, in the body, from that of a DVL elsewhere on it and turned against it."""
    x, y, z = rotate(mounting, velocity_mps)
    whirl_x, whirl_y, whirl_z = cross(angular_rate_radps, lever_arm_m)
    return x - whirl_x, y - whirl_y, z - whirl_z


def roll_and_pitch(gravity: Vector) -> tuple[float, float]:
    """In radians, from the direction of gravity in the body."""
    forward, right, down = gravity
    return float(np.arctan2(right, down)), float(np.arctan2(-forward, hypot(right, down)))


def _vector(array: FloatArray) -> Vector:
    x, y, z = array.tolist()
    return x, y, z
