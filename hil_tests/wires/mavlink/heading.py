"""Headings in degrees, in the messages that tell the vehicle's attitude."""

from __future__ import annotations

from math import atan2, cos, degrees, pi, radians, remainder, sin

from drivers.mavlink.formats import ATTITUDE, ATTITUDE_QUATERNION, GLOBAL_POSITION_INT
from hil_tests.wires.distortion import Vector
from hil_tests.wires.mavlink.fields import Fields
from hil_tests.wires.mavlink.signal import Signal

HEADING_UNKNOWN = 65_535  # GLOBAL_POSITION_INT.hdg
FULL_TURN_CDEG = 36_000


class Yaw(Signal):
    """ATTITUDE: radians, -pi to pi. Without a heading none is sent: roll and pitch do not come alone."""

    message = ATTITUDE
    _yaw = Fields.of(ATTITUDE, 3)

    def read(self, payload: bytes) -> Vector | None:
        """Degrees, -180 to 180."""
        return (degrees(self._yaw.read(payload)[0]),)

    def write(self, payload: bytearray, value: Vector) -> None:
        """See `Signal`."""
        self._yaw.write(payload, [remainder(radians(value[0]), 2.0 * pi)])


class QuaternionYaw(Signal):
    """ATTITUDE_QUATERNION: from the body to north-east-down, w first."""

    message = ATTITUDE_QUATERNION
    _quaternion = Fields.of(ATTITUDE_QUATERNION, 1, 4)

    def read(self, payload: bytes) -> Vector | None:
        """Degrees, -180 to 180."""
        w, x, y, z = self._quaternion.read(payload)
        return (degrees(atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)),)

    def write(self, payload: bytearray, value: Vector) -> None:
        """The same attitude, turned about the vertical by what the heading differs."""
        before = self.read(bytes(payload))
        half_rad = 0.5 * radians(value[0] - (before[0] if before else 0.0))
        c, s = cos(half_rad), sin(half_rad)
        w, x, y, z = self._quaternion.read(payload)
        self._quaternion.write(payload, [c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w])


class GlobalHeading(Signal):
    """GLOBAL_POSITION_INT.hdg: hundredths of a degree, 0 to 359.99, or not known."""

    message = GLOBAL_POSITION_INT
    _heading = Fields.of(GLOBAL_POSITION_INT, 8)

    def read(self, payload: bytes) -> Vector | None:
        """Degrees, -180 to 180; None where it is not known."""
        [heading_cdeg] = self._heading.read(payload)
        return None if heading_cdeg == HEADING_UNKNOWN else (remainder(heading_cdeg / 100.0, 360.0),)

    def write(self, payload: bytearray, value: Vector) -> None:
        """See `Signal`."""
        self._heading.write(payload, [round(100.0 * value[0]) % FULL_TURN_CDEG])

    def silence(self, payload: bytearray, told: bytes) -> bool:
        """It is said to be not known."""
        self._heading.write(payload, [HEADING_UNKNOWN])
        return True


def headings() -> list[Signal]:
    """Wherever the vehicle's heading is told."""
    return [Yaw(), QuaternionYaw(), GlobalHeading()]
