"""Which way something goes along a wire, and the small contract that CAN and MAVLink wires share."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from enum import Enum, auto
from typing import Generic, Protocol, TypeVar

Item = TypeVar("Item")


class Towards(Enum):
    """Where to. A CAN wire lies between the autopilot's end of a bus, where the gateway listens as well, and the
    devices (ESCs); a MAVLink wire between the autopilot and the gateway with all else that is on its link."""

    AUTOPILOT = auto()
    DEVICES = auto()
    GATEWAY = auto()


@dataclass(frozen=True, slots=True)
class Passed(Generic[Item]):
    """Something that has come to the other end."""

    item: Item
    towards: Towards


class Wire(Protocol[Item]):
    """One wire. Items are CAN frames (stamped), or packets (bytes, one datagram or whatever came at once).

    With no fault active, what is put in is due at the same time, unchanged, in its order, in the same object.

    Attributes:
        counts: what faults have done, by cause: "frames lost", "rpm of thruster 3 changed", ...
    """

    counts: Counter[str]

    def put(self, time_s: float, item: Item, towards: Towards) -> None:
        """Something enters the wire; `time_s`, in unix seconds, does not go back."""
        ...

    def due(self, time_s: float) -> list[Passed[Item]]:
        """What has arrived by now, in order of arrival, with what faults have added."""
        ...

    def next_s(self) -> float:
        """When more is due without anything being put in; infinity: never."""
        ...
