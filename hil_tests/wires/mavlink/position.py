"""Positions, metres north and east: of a local origin, or of the first place that a message told."""

from __future__ import annotations

from math import cos, pi, radians

from drivers.mavlink.formats import GLOBAL_POSITION_INT, GPS_INPUT, GPS_RAW_INT, LOCAL_POSITION_NED, MessageFormat
from hil_tests.wires.distortion import Vector
from hil_tests.wires.mavlink.fields import Fields
from hil_tests.wires.mavlink.signal import Linear, Signal

EARTH_RADIUS_M = 6_371_000.0  # on average: sizes of faults are right within half a percent
METRES_PER_UNIT = EARTH_RADIUS_M * pi / 180.0 * 1e-7
DEGREES_PER_UNIT = 1e-7
HALF_TURN, FULL_TURN = 1_800_000_000, 3_600_000_000


class LatitudeLongitude(Signal):
    """A latitude and the longitude behind it, in 1e-7 degree. Zeros of both are how senders say that they know none.

    Args:
        message: that carries them.
        first: the latitude's place.
    """

    def __init__(self, message: MessageFormat, first: int) -> None:
        self.message = message
        self._fields = Fields.of(message, first, 2)
        self._origin: tuple[float, float] | None = None

    def read(self, payload: bytes) -> Vector | None:
        """Metres from the first one; None where there is none."""
        latitude, longitude = self._fields.read(payload)
        if latitude == 0 and longitude == 0:
            return None
        if self._origin is None:
            self._origin = latitude, longitude
        return (latitude - self._origin[0]) * METRES_PER_UNIT, (longitude - self._origin[1]) * self._metres_east()

    def write(self, payload: bytearray, value: Vector) -> None:
        """See `Signal`."""
        if self._origin is not None:
            latitude = self._origin[0] + value[0] / METRES_PER_UNIT
            longitude = self._origin[1] + value[1] / self._metres_east()
            self._fields.write(payload, [latitude, (longitude + HALF_TURN) % FULL_TURN - HALF_TURN])

    def _metres_east(self) -> float:
        latitude = 0.0 if self._origin is None else self._origin[0]
        return METRES_PER_UNIT * cos(radians(latitude * DEGREES_PER_UNIT))


def positions() -> list[Signal]:
    """Wherever the vehicle's position is told."""
    return [
        Linear(LOCAL_POSITION_NED, 1, 2),
        LatitudeLongitude(GLOBAL_POSITION_INT, 1),
        LatitudeLongitude(GPS_RAW_INT, 1),
        LatitudeLongitude(GPS_INPUT, 2),
    ]
