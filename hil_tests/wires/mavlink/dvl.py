"""Velocities of Doppler velocity logs, forward, right, down in m/s: in the three messages that DVLs' drivers send."""

from __future__ import annotations

from math import isfinite

from drivers.mavlink.formats import ATTITUDE, ODOMETRY, VISION_POSITION_DELTA, VISION_SPEED_ESTIMATE
from drivers.mavlink.velocities import MAV_ESTIMATOR_TYPE_AUTOPILOT, MAV_FRAME_BODY_FRD
from hil_tests.rig.kinematics import to_body, to_earth
from hil_tests.wires.distortion import Vector
from hil_tests.wires.mavlink.fields import Fields
from hil_tests.wires.mavlink.signal import Linear, Signal

FAILED = -1  # ODOMETRY.quality
US_PER_S = 1e6


class PositionDelta(Signal):
    """VISION_POSITION_DELTA: metres in the time since the last one; the angles and the confidence stay."""

    message = VISION_POSITION_DELTA
    _interval_us = Fields.of(VISION_POSITION_DELTA, 1)
    _deltas_m = Fields.of(VISION_POSITION_DELTA, 5, 3)
    _confidence = Fields.of(VISION_POSITION_DELTA, 8)

    def read(self, payload: bytes) -> Vector | None:
        """m/s; None without an interval."""
        [interval_us] = self._interval_us.read(payload)
        if not interval_us:
            return None
        return tuple(US_PER_S * delta_m / interval_us for delta_m in self._deltas_m.read(payload))

    def write(self, payload: bytearray, value: Vector) -> None:
        """See `Signal`."""
        [interval_us] = self._interval_us.read(payload)
        self._deltas_m.write(payload, [velocity * interval_us / US_PER_S for velocity in value])

    def lose_lock(self, payload: bytearray) -> bool:
        """As Cerulean's driver does: zeros with confidence 0."""
        self._confidence.write(payload, [0.0])
        return True


class Odometry(Signal):
    """ODOMETRY of a sensor, in the frame of the body; the autopilot's own is none."""

    message = ODOMETRY
    _velocity = Linear(ODOMETRY, 8, 3)
    _child_frame = Fields.of(ODOMETRY, 57)
    _estimator = Fields.of(ODOMETRY, 59)
    _quality = Fields.of(ODOMETRY, 60)

    def read(self, payload: bytes) -> Vector | None:
        """m/s; None where it is not a DVL's."""
        if self._child_frame.read(payload) != (MAV_FRAME_BODY_FRD,):
            return None
        if self._estimator.read(payload) == (MAV_ESTIMATOR_TYPE_AUTOPILOT,):
            return None
        return self._velocity.read(payload)

    def write(self, payload: bytearray, value: Vector) -> None:
        """See `Signal`."""
        self._velocity.write(payload, value)

    def lose_lock(self, payload: bytearray) -> bool:
        """Zeros of a quality that is said to have failed."""
        self._quality.write(payload, [FAILED])
        return True


class TrueAttitude(Signal):
    """The newest ATTITUDE of the vehicle, as it was before any fault; no fault changes anything here."""

    message = ATTITUDE
    _angles = Linear(ATTITUDE, 1, 3)

    def __init__(self) -> None:
        self.angles_rad: tuple[float, float, float] | None = None

    def read(self, payload: bytes) -> Vector | None:
        """None: it is only remembered."""
        roll_rad, pitch_rad, yaw_rad = self._angles.fields.read(payload)
        if isfinite(roll_rad + pitch_rad + yaw_rad):
            self.angles_rad = roll_rad, pitch_rad, yaw_rad
        return None

    def write(self, _payload: bytearray, _value: Vector) -> None:
        """It is never asked to."""


class SpeedEstimate(Signal):
    """VISION_SPEED_ESTIMATE: north, east, down, made by a driver that knows the vehicle's attitude.

    Args:
        attitude: of the vehicle; until it is known nothing is changed.
    """

    message = VISION_SPEED_ESTIMATE

    def __init__(self, attitude: TrueAttitude) -> None:
        self._attitude = attitude
        self._velocity = Fields.of(VISION_SPEED_ESTIMATE, 1, 3)

    def read(self, payload: bytes) -> Vector | None:
        """m/s forward, right, down."""
        if self._attitude.angles_rad is None:
            return None
        north, east, down = self._velocity.read(payload)
        return to_body((north, east, down), self._attitude.angles_rad)

    def write(self, payload: bytearray, value: Vector) -> None:
        """Back to north, east, down."""
        if self._attitude.angles_rad is not None:
            forward, right, down = value
            self._velocity.write(payload, to_earth((forward, right, down), self._attitude.angles_rad))


def velocities() -> list[Signal]:
    """Wherever a DVL's velocity is told."""
    attitude = TrueAttitude()
    return [PositionDelta(), Odometry(), attitude, SpeedEstimate(attitude)]
