"""Two buses with a bridge between them: vcan where the kernel has it, else pairs of UDP sockets of the loopback.

Over UDP go the same 16 bytes of `struct can_frame`, and the kernel stamps them in the same way.
"""

from __future__ import annotations

import socket
from collections import Counter
from dataclasses import dataclass

import can
from can.interfaces.socketcan import SocketcanBus

from drivers.can.packets import SO_TIMESTAMPNS
from drivers.can.port import port_errors
from drivers.can.socketcan import RECEIVE_BUFFER_BYTES
from drivers.clock import Clock
from hil_tests.bridge.raw_port import BridgePort, OpenPort, RawPort, socketcan
from hil_tests.live.buses import HOST, VCAN
from hil_tests.loopback import free_port
from hil_tests.vcan.interface import has_vcan


@dataclass(frozen=True, slots=True)
class BridgedBus:
    """One of the two buses.

    Attributes:
        name: of the interface; of a pair of UDP sockets, any.
        inner, outer: ports of the bridge's end and of whoever else is on the bus; 0: it is an interface.
    """

    name: str
    inner: int = 0
    outer: int = 0

    def node(self) -> socket.socket:
        """Who plays on the bus: an open socket whose datagrams are stamped."""
        opened = self._socketcan() if not self.inner else _pair(self.outer, self.inner)
        opened.setblocking(False)
        opened.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES)
        return opened

    def opener(self) -> OpenPort:
        """How our bridge opens it."""
        if not self.inner:
            return socketcan(self.name)

        def open_port(clock: Clock, counts: Counter[str]) -> BridgePort:
            with port_errors():
                return RawPort(_pair(self.inner, self.outer), clock, counts)

        return open_port

    def python_can(self) -> can.BusABC:
        """How python-can opens it."""
        if not self.inner:
            return can.Bus(self.name, "socketcan", ignore_config=True)
        return PairedBus(self.name, _pair(self.inner, self.outer))

    def _socketcan(self) -> socket.socket:
        opened = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        opened.bind((self.name,))
        return opened


class PairedBus(SocketcanBus):
    """python-can's SocketCAN, all of its code, on a socket that is not of CAN.

    Args:
        channel: its name.
        opened: the bus's from now on.
    """

    def __init__(self, channel: str, opened: socket.socket) -> None:
        opened.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
        self.socket, self.channel, self.channel_info = opened, channel, channel
        self._bcm_sockets: dict[str, socket.socket] = {}
        self._is_filtered = False
        can.BusABC.__init__(self, channel=channel)

    def _apply_filters(self, filters: object) -> None:
        """All frames are wanted, and a socket that is not of CAN has none."""


def bridged_buses() -> tuple[str, tuple[BridgedBus, BridgedBus]]:
    """Those of this machine, and what they are, in words."""
    if all(map(has_vcan, VCAN)):
        return " and ".join(VCAN), (BridgedBus(VCAN[0]), BridgedBus(VCAN[1]))
    pairs = [BridgedBus(f"bus {number}", free_port(), free_port()) for number in range(2)]
    return f"UDP in place of SocketCAN (no {' and '.join(VCAN)} here)", (pairs[0], pairs[1])


def _pair(own: int, other: int) -> socket.socket:
    """A UDP socket that speaks with one other."""
    opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    opened.bind((HOST, own))
    opened.connect((HOST, other))
    return opened
