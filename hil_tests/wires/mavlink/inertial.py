"""Specific force in m/s2 and angular rate in rad/s, forward, right, down, in the messages of inertial units."""

from __future__ import annotations

from math import copysign

from drivers.mavlink.formats import HIGHRES_IMU, RAW_IMU, SCALED_IMUS, MessageFormat
from drivers.mavlink.inertial import STANDARD_GRAVITY_MPS2
from hil_tests.wires.distortion import Vector
from hil_tests.wires.mavlink.fields import Fields
from hil_tests.wires.mavlink.signal import Linear, Signal

MILLI_G_MPS2 = STANDARD_GRAVITY_MPS2 / 1000.0
MILLI = 1.0 / 1000.0
FORCE_PLACE, RATE_PLACE = 1, 4


class Counted(Signal):
    """Three axes in whole numbers, of which autopilots have cut the fractions off, towards zero.

    A unit that lacks one of its sensors measures nothing: its message is not sent, the other one's values neither.

    Args:
        message: RAW_IMU or a SCALED_IMU.
        first: the first of the three fields.
        unit: of them.
    """

    def __init__(self, message: MessageFormat, first: int, unit: float) -> None:
        self.message = message
        self._fields = Fields.of(message, first, 3)
        self._unit = unit

    def read(self, payload: bytes) -> Vector | None:
        """See `Signal`. What was measured lies half a unit further out, on average."""
        return tuple(
            (count + copysign(0.5, count)) * self._unit if count else 0.0 for count in self._fields.read(payload)
        )

    def write(self, payload: bytearray, value: Vector) -> None:
        """What the autopilot would have sent: without the fractions."""
        self._fields.write(payload, [int(one / self._unit) for one in value])


def forces() -> list[Signal]:
    """Specific force, wherever it is told."""
    return _axes(FORCE_PLACE, MILLI_G_MPS2)


def rates() -> list[Signal]:
    """Angular rate, wherever it is told."""
    return _axes(RATE_PLACE, MILLI)


def _axes(first: int, unit: float) -> list[Signal]:
    counted = [Counted(message, first, unit) for message in (RAW_IMU, *SCALED_IMUS)]
    return [*counted, Linear(HIGHRES_IMU, first, 3)]
