"""Attitude, positions and navigation sensors of a PX4 log.

Sources are named as the message that PX4 makes of the same topic: sensor_combined is HIGHRES_IMU's, and
vehicle_visual_odometry, where DVLs come in, ODOMETRY's. Attitude has no rates and the global position no velocity:
the newest of vehicle_angular_velocity (else of the inertial unit) and of the local position are put to them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from drivers.logs.boot_clock import BootClock
from drivers.logs.damage import DamageReport
from drivers.logs.plausible import FloatArray, Mask, refuse_at, within
from drivers.logs.stamped import Newest, Stamped
from drivers.logs.ulog_topics import Topic
from drivers.mavlink.inertial import FORCE_MAX_MPS2
from drivers.mavlink.inertial import RATE_MAX_RADPS as IMU_RATE_MAX_RADPS
from drivers.mavlink.vehicle import LENGTH_TOLERANCE, POSITION_MAX_M, RATE_MAX_RADPS, STRAIGHT, VELOCITY_MAX_MPS
from drivers.mavlink.velocities import VELOCITY_MAX_MPS as DVL_MAX_MPS
from drivers.readings import Attitude, BodyVelocity, GlobalPosition, Inertial, LocalPosition, Reading

# in the order in which they are needed
WANTED = (
    "vehicle_angular_velocity",
    "sensor_combined",
    "vehicle_attitude",
    "vehicle_local_position",
    "vehicle_global_position",
    "vehicle_visual_odometry",
)
MAX_AGE_S = 0.5
BODY_FRD = 3.0
UNIT, DVL = "HIGHRES_IMU", "ODOMETRY ulog"
VALID = ("xy_valid", "z_valid", "v_xy_valid", "v_z_valid")


class UlogVehicle:
    """Attitude, positions, inertial unit, DVL.

    Args:
        clock: of the log.
        damage: told what is implausible.
        navigation: True where inertial unit and DVL are wanted, too.
        has_rates: True where the log has rates beside the inertial unit's.
    """

    def __init__(self, clock: BootClock, damage: DamageReport, navigation: bool, has_rates: bool) -> None:
        self._clock = clock
        self._damage = damage
        self._navigation = navigation
        self._has_rates = has_rates
        self._rates = Newest(3)
        self._velocity = Newest(3)

    def take(self, topic: Topic) -> Iterator[Stamped]:
        """Readings of one of `WANTED`, of its first instance; of one part of the log, topics come in that order."""
        match topic.name:
            case "vehicle_angular_velocity" if topic.has("xyz[2]"):
                self._rates.take(topic.boot_s, topic.vector("xyz", 3))
            case "sensor_combined" if topic.has("gyro_rad[2]", "accelerometer_m_s2[2]"):
                if not self._has_rates:
                    self._rates.take(topic.boot_s, topic.vector("gyro_rad", 3))
                if self._navigation:
                    yield self._inertial(topic)
            case "vehicle_attitude" if topic.has("q[3]"):
                yield self._attitudes(topic)
            case "vehicle_local_position" if topic.has("x", "y", "z", "vx", "vy", "vz"):
                yield self._local_positions(topic)
            case "vehicle_global_position" if topic.has("lat", "lon", "alt"):
                yield self._global_positions(topic)
            case "vehicle_visual_odometry" if topic.has("velocity_frame", "velocity[2]"):
                yield from self._velocities(topic, topic.vector("velocity", 3))
            case "vehicle_visual_odometry" if topic.has("velocity_frame", "vx", "vy", "vz"):  # before PX4 1.14
                yield from self._velocities(topic, topic.columns("vx", "vy", "vz"))

    def _inertial(self, topic: Topic) -> Stamped:
        forces, rates = topic.vector("accelerometer_m_s2", 3), topic.vector("gyro_rad", 3)
        good = within(forces, FORCE_MAX_MPS2) & within(rates, IMU_RATE_MAX_RADPS)
        self._refuse(topic, ~good, "implausible IMU")
        kept = topic.part(good)
        columns = (self._time_s(kept), kept.boot_s, forces[good], rates[good])
        readings = [
            Inertial(at_s, since_s, UNIT, (force[0], force[1], force[2]), (rate[0], rate[1], rate[2]))
            for at_s, since_s, force, rate in zip(*(column.tolist() for column in columns), strict=True)
        ]
        return self._stamped(kept, readings)

    def _attitudes(self, topic: Topic) -> Stamped:
        quaternion = topic.vector("q", 4)
        whole = np.abs(np.linalg.norm(quaternion, axis=1) - 1.0) <= LENGTH_TOLERANCE  # False for NaN
        rates = self._rates.at(topic.boot_s, MAX_AGE_S)
        unknown = np.isnan(rates[:, 0])
        good = whole & within(rates, RATE_MAX_RADPS)
        self._refuse(topic, unknown, "attitude without rates")
        self._refuse(topic, ~good & ~unknown, "implausible attitude")
        kept = topic.part(good)
        rows = np.column_stack([self._time_s(kept), _euler(quaternion[good]), rates[good], kept.boot_s])
        return self._stamped(kept, [Attitude(*row) for row in rows.tolist()])

    def _local_positions(self, topic: Topic) -> Stamped:
        position, velocity = topic.columns("x", "y", "z"), topic.columns("vx", "vy", "vz")
        told = np.ones(len(topic), dtype=np.bool_)
        for name in filter(topic.has, VALID):
            told &= topic.numbers(name) > 0.0
        good = told & within(position, POSITION_MAX_M) & within(velocity, VELOCITY_MAX_MPS)
        self._refuse(topic, ~told, "no local position")
        self._refuse(topic, told & ~good, "implausible local position")
        kept, position, velocity = topic.part(good), position[good], velocity[good]
        self._velocity.take(kept.boot_s, velocity)
        rows = zip(self._time_s(kept).tolist(), position.tolist(), velocity.tolist(), strict=True)
        readings = [LocalPosition(at_s, (n, e, d), (vn, ve, vd)) for at_s, (n, e, d), (vn, ve, vd) in rows]
        return self._stamped(kept, readings)

    def _global_positions(self, topic: Topic) -> Stamped:
        place, depth_m = topic.columns("lat", "lon"), -topic.numbers("alt")
        velocity = self._velocity.at(topic.boot_s, MAX_AGE_S)
        moving = ~np.isnan(velocity[:, 0])
        good = _on_earth(place) & (np.abs(depth_m) <= POSITION_MAX_M)
        self._refuse(topic, ~moving, "global position without velocity")
        self._refuse(topic, moving & ~good, "implausible global position")
        good &= moving
        kept = topic.part(good)
        columns = (self._time_s(kept), np.radians(place[good]), depth_m[good], velocity[good], kept.boot_s)
        readings = [
            GlobalPosition(at_s, latitude, longitude, depth, (north, east, down), since_s)
            for at_s, (latitude, longitude), depth, (north, east, down), since_s in zip(
                *(column.tolist() for column in columns), strict=True
            )
        ]
        return self._stamped(kept, readings)

    def _velocities(self, topic: Topic, velocity: FloatArray) -> Iterator[Stamped]:
        """The number of the body's frame is the same in all versions."""
        if not self._navigation:
            return
        body = topic.numbers("velocity_frame") == BODY_FRD
        good = body & within(velocity, DVL_MAX_MPS)
        self._refuse(topic, ~body, "odometry in another frame")
        self._refuse(topic, body & ~good, "implausible velocity")
        kept = topic.part(good)
        rows = zip(self._time_s(kept).tolist(), velocity[good].tolist(), strict=True)
        yield self._stamped(kept, [BodyVelocity(at_s, None, (a, r, d), DVL) for at_s, (a, r, d) in rows])

    def _time_s(self, topic: Topic) -> FloatArray:
        return topic.boot_s + self._clock.offset_s

    def _stamped(self, topic: Topic, readings: Sequence[Reading]) -> Stamped:
        return Stamped(self._time_s(topic), np.zeros(len(topic), dtype=np.intp), readings)

    def _refuse(self, topic: Topic, refused: Mask, cause: str) -> None:
        refuse_at(self._damage, topic.boot_s, refused, cause)


def _euler(quaternion: FloatArray) -> FloatArray:
    """(N, 3) roll, pitch and yaw of (N, 4), w first, of about unit length; straight up or down roll is in the yaw."""
    w, x, y, z = (quaternion / np.linalg.norm(quaternion, axis=1, keepdims=True)).T
    up = np.clip(2.0 * (w * y - z * x), -1.0, 1.0)
    straight = np.abs(up) > STRAIGHT
    roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    about_vertical = np.copysign(2.0, -up) * np.arctan2(x, w)
    return np.column_stack([np.where(straight, 0.0, roll), np.arcsin(up), np.where(straight, about_vertical, yaw)])


def _on_earth(place: FloatArray) -> Mask:
    there: Mask = np.logical_and.reduce(np.abs(place) <= (90.0, 180.0), axis=1)  # False for NaN
    return there
