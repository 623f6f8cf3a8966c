"""CAN frames that an autopilot forwards over MAVLink: CAN_FRAME and CANFD_FRAME, unpacked, to frames of its buses.

Frames get lost on the way wherever the link is full: what comes is a sample of the bus. Identifiers carry ArduPilot's
flags (AP_HAL/CANIface.h), which are those of SocketCAN.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Any

from drivers.can.frame import CLASSIC_DATA_BYTES, EXTENDED_MASK, STANDARD_MASK, CanFrame
from drivers.readings import Reading

FLAG_EXTENDED, FLAG_REMOTE, FLAG_ERROR = 1 << 31, 1 << 30, 1 << 29
FD_LENGTHS = frozenset({*range(CLASSIC_DATA_BYTES + 1), 12, 16, 20, 24, 32, 48, 64})


@dataclass(frozen=True, slots=True)
class ForwardedFrame:
    """A frame, and the autopilot's bus that it was on, from 1 as its users count: CAN1, CAN2."""

    bus: int
    frame: CanFrame


class ForwardedFrames:
    """Collects what a MAVLink decoder finds, for somebody to take.

    Args:
        drops: counts "remote frame", "error frame" and "malformed frame".
    """

    def __init__(self, drops: Counter[str]) -> None:
        self._drops = drops
        self._frames: list[ForwardedFrame] = []

    def take(self) -> list[ForwardedFrame]:
        """All since the last time, in the order of the stream."""
        frames, self._frames = self._frames, []
        return frames

    def classic(self, values: tuple[Any, ...], time_s: float) -> list[Reading]:
        """CAN_FRAME; nothing to read yet."""
        return self._add(values, time_s, fd=False)

    def fd(self, values: tuple[Any, ...], time_s: float) -> list[Reading]:
        """CANFD_FRAME; nothing to read yet."""
        return self._add(values, time_s, fd=True)

    def _add(self, values: tuple[Any, ...], time_s: float, *, fd: bool) -> list[Reading]:
        word, _system, _component, bus, length, data = values
        if cause := _fault(word, length, fd):
            self._drops[cause] += 1
        else:
            extended = bool(word & FLAG_EXTENDED)
            frame = CanFrame(time_s, word & EXTENDED_MASK, data[:length], extended=extended, fd=fd)
            self._frames.append(ForwardedFrame(bus + 1, frame))
        return []


def _fault(word: int, length: int, fd: bool) -> str:
    """Why a frame is of no use, "" where it is."""
    if word & FLAG_REMOTE:
        return "remote frame"
    if word & FLAG_ERROR:
        return "error frame"
    possible = length in FD_LENGTHS if fd else length <= CLASSIC_DATA_BYTES
    fits = word & FLAG_EXTENDED or word & EXTENDED_MASK <= STANDARD_MASK
    return "" if possible and fits else "malformed frame"
