"""The same packet by another route: known by its sender and sequence number, where a message has no time stamp."""

from __future__ import annotations

from collections import deque

from drivers.mavlink.frames import Packet

KEPT = 32
ROUTES_S = 1.0  # by which one route is slower than another; sequence numbers hardly come again sooner


class RouteCopies:
    """Remembers packets for as long as a copy of them may still be under way."""

    def __init__(self) -> None:
        self._lately: deque[tuple[float, Packet]] = deque(maxlen=KEPT)

    def repeats(self, packet: Packet, time_s: float) -> bool:
        """Whether this packet was there before; if not, it is from now on."""
        known = any(packet == before and 0.0 <= time_s - at_s < ROUTES_S for at_s, before in self._lately)
        if not known:
            self._lately.append((time_s, packet))
        return known
