"""When frames of simulated nodes are on the bus: one after the other, each for as long as its bits take."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from drivers.can.frame import CanFrame, checked_frame
from drivers.can.load import BitRates, byte_s, overhead_s


class Unsent(NamedTuple):
    """A frame that waits for the bus."""

    identifier: int
    data: bytes
    extended: bool = True


class BusClock:
    """Stamps frames with the time at which they have been received, as a controller on the bus would.

    Who speaks while somebody else does waits. Arbitration is not simulated: frames go in the order in which their
    senders have asked, which is the same unless several wait at once.

    Args:
        bitrate: in bit/s.
    """

    def __init__(self, bitrate: int) -> None:
        rates = BitRates(bitrate)
        frames = {extended: CanFrame(0.0, 0, b"\0", extended=extended) for extended in (False, True)}
        self._overhead_s = {extended: overhead_s(frame, rates) for extended, frame in frames.items()}
        self._byte_s = byte_s(frames[True], rates)
        self._free_s = float("-inf")

    def send(self, time_s: float, frames: Iterable[Unsent]) -> list[CanFrame]:
        """Frames of one sender, asked for at `time_s`; stamps never go back from call to call."""
        sent = []
        free_s = max(self._free_s, time_s)
        for identifier, data, extended in frames:
            free_s += self._overhead_s[extended] + len(data) * self._byte_s
            sent.append(checked_frame(free_s, identifier, data, extended, False, False))
        self._free_s = free_s
        return sent
