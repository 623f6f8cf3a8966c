"""Buses and wires to test bridges with: real sockets in place of CAN, and a port whose failures are fields."""

from __future__ import annotations

import socket
from collections import Counter, deque
from contextlib import contextmanager
from dataclasses import dataclass, field
from math import inf

from drivers.can.port import CanPortError
from drivers.clock import Clock
from hil_tests.bridge.bus_end import BusEnd
from hil_tests.bridge.can_bridge import CanBridge
from hil_tests.bridge.raw_port import RawPort, Sending
from hil_tests.wires.way import Passed


class HoldingWire:
    """Gives everything after a time: at once, unless it is told otherwise."""

    def __init__(self, hold_s=0.0):
        self.counts = Counter()
        self.hold_s = hold_s
        self._held = deque()

    def put(self, time_s, item, towards):
        self._held.append((time_s + self.hold_s, Passed(item, towards)))

    def due(self, time_s):
        passed = []
        while self._held and self._held[0][0] <= time_s:
            passed.append(self._held.popleft()[1])
        return passed

    def next_s(self):
        return self._held[0][0] if self._held else inf


class BrokenWire(HoldingWire):
    """Fails with the first item."""

    def put(self, time_s, item, towards):
        raise RuntimeError("the wire broke")


class FragileWire(HoldingWire):
    """Fails with the first frame that has no data."""

    def put(self, time_s, item, towards):
        if not item.data:
            raise RuntimeError("the wire broke")
        super().put(time_s, item, towards)


@dataclass
class Port:
    """A bus in memory, as far as `BusEnd` knows one.

    Attributes:
        room: frames that it takes before it is full.
        refusing: it takes no CAN FD.
        gone: why it has failed.
        coming: what is read next.
    """

    room: int = 1_000_000
    refusing: bool = False
    gone: str = ""
    coming: list = field(default_factory=list)
    taken: list = field(default_factory=list)
    closed: bool = False

    def read(self, frames):
        frames += self.coming
        self.coming = []
        self._check()

    def send(self, frame):
        self._check()
        if self.refusing and frame.fd:
            return Sending.REFUSED
        if not self.room:
            return Sending.FULL
        self.room -= 1
        self.taken.append(frame)
        return Sending.DONE

    def close(self):
        self.closed = True

    def _check(self):
        if self.gone:
            raise CanPortError(self.gone)


@contextmanager
def bridged_sockets(wire):
    """A bridge, and the far ends of its two buses: of the autopilot's and of the devices'."""
    clock = Clock()
    pairs = [socket.socketpair(socket.AF_UNIX, socket.SOCK_DGRAM) for _ in range(2)]
    ends = [
        BusEnd(name, lambda clock, lost, own=own: RawPort(own, clock, lost), clock)
        for name, (own, _) in zip(("can0", "can1"), pairs, strict=True)
    ]
    outer = [far for _, far in pairs]
    for far in outer:
        far.settimeout(5.0)
    try:
        with CanBridge(*ends, wire, clock) as bridge:
            yield bridge, *outer
    finally:
        for own, far in pairs:
            own.close()
            far.close()
