"""What a signal is: a measured or commanded quantity in the payload of one message."""

from __future__ import annotations

from abc import ABC, abstractmethod

from drivers.mavlink.formats import MessageFormat
from hil_tests.wires.distortion import Vector
from hil_tests.wires.mavlink.fields import Fields


class Signal(ABC):
    """One quantity of one message. All payloads are of full size.

    Attributes:
        message: that carries it.
    """

    message: MessageFormat

    @abstractmethod
    def read(self, payload: bytes) -> Vector | None:
        """Its value in the unit of the failure table; None: this payload does not carry it."""

    @abstractmethod
    def write(self, payload: bytearray, value: Vector) -> None:
        """Put another value in its place; `read` has found one there."""

    def silence(self, payload: bytearray, told: bytes) -> bool:
        """Let the payload say that no value has come; False: it has no words for that, and is not sent.

        Args:
            payload: with the true value.
            told: the payload that was sent last with a value.
        """
        return False

    def lose_lock(self, payload: bytearray) -> bool:
        """Let the payload say that a DVL does not see the bottom; False: see `silence`."""
        return False


class Linear(Signal):
    """A quantity that is its fields times a factor, and an offset.

    Args:
        message: see `Signal`.
        first: the first of its fields, see `Fields.of`.
        count: how many.
        unit: of the field, in the unit of the quantity.
        zero: what the field holds where the quantity is zero.
    """

    def __init__(
        self, message: MessageFormat, first: int, count: int = 1, unit: float = 1.0, zero: float = 0.0
    ) -> None:
        self.message = message
        self.fields = Fields.of(message, first, count)
        self._unit = unit
        self._zero = zero

    def read(self, payload: bytes) -> Vector | None:
        """See `Signal`."""
        return tuple((value - self._zero) * self._unit for value in self.fields.read(payload))

    def write(self, payload: bytearray, value: Vector) -> None:
        """See `Signal`."""
        self.fields.write(payload, [self._zero + one / self._unit for one in value])
