"""What a recorded dive is made of: frames of its buses, packets of its link."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from drivers.can.frame import CanFrame
from drivers.mavlink.frames import Packet


@dataclass(frozen=True, slots=True)
class OnBus:
    """A frame, by its own `time_s`, and the name of its bus in the configuration."""

    time_s: float
    frame: CanFrame
    bus: str


@dataclass(frozen=True, slots=True)
class OnLink:
    """A packet of the MAVLink link, and when it came."""

    time_s: float
    packet: Packet


Piece: TypeAlias = OnBus | OnLink
