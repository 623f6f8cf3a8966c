"""Where a vehicle meets the gateway: the bus and the link between them, in memory or real."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from drivers.can.frame import CanFrame
from hil_tests.rig.notes import Notes
from hil_tests.rig.truth import ModeChange, Truth


class VehicleBus(Protocol):
    """The CAN bus, as autopilot and ESCs have it."""

    def send(self, from_autopilot: Sequence[CanFrame], from_devices: Sequence[CanFrame]) -> None:
        """Both transmit; each in the order given."""
        ...

    def heard_by_devices(self) -> list[CanFrame]:
        """What the autopilot, or whoever else, has sent since this was last asked."""
        ...

    def close(self) -> None:
        """Let go of it. Never raises."""
        ...


class VehicleLink(Protocol):
    """The MAVLink link, as the autopilot's side has it."""

    def send(self, datagram: bytes) -> None:
        """To the gateway."""
        ...

    def heard(self) -> list[bytes]:
        """What has come since this was last asked."""
        ...

    def close(self) -> None:
        """Let go of it. Never raises."""
        ...


class Vehicle(Protocol):
    """What is played: a simulated vehicle, the devices around a real autopilot, or a recorded dive."""

    def advance(self, time_s: float) -> None:
        """Everything that is due by this time happens."""
        ...

    def sent_by_autopilot(self) -> list[CanFrame]:
        """Frames since this was last asked, stamped."""
        ...

    def sent_by_devices(self) -> list[CanFrame]:
        """Frames since this was last asked, stamped."""
        ...

    def to_devices(self, frames: Sequence[CanFrame]) -> None:
        """Frames have come to the ESCs."""
        ...

    def datagrams(self) -> list[tuple[float, bytes]]:
        """MAVLink from the autopilot's side, with its times, since this was last asked."""
        ...

    def to_autopilot(self, time_s: float, data: bytes) -> None:
        """MAVLink has come from the gateway."""
        ...


class Witness(Protocol):
    """Who knows how a play went for the autopilot."""

    @property
    def notes(self) -> Notes:
        """What has come to it."""

    @property
    def modes(self) -> Sequence[ModeChange]:
        """Its modes."""

    def truth(self) -> Truth | None:
        """What the vehicle really did; None: nobody knows."""


class Played(Vehicle, Witness, Protocol):
    """A vehicle that is stepped."""
