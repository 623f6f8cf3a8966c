"""Opening a CAN interface by python-can's name for it."""

from __future__ import annotations

import socket
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

import can

from drivers.can.frame import CanFilter
from drivers.can.port import CanPort, PollingPort, port_errors
from drivers.can.socketcan import SocketCanPort
from drivers.clock import Clock

PortOpener = Callable[[Sequence[CanFilter], Clock, Counter[str]], CanPort]


def port_opener(interface: str, channel: str, **options: Any) -> PortOpener:
    """How to open a bus of python-can, as often as needed. The opener raises CanPortError where it does not open.

    Nothing is read from python-can's own configuration files or environment variables.

    Args:
        interface: python-can's name: "socketcan", "virtual", ...
        channel: its channel, such as "can0".
        options: passed on to python-can, such as `fd=True`.

    Raises:
        ValueError: python-can has no such interface.
    """
    if interface not in can.VALID_INTERFACES:
        raise ValueError(f"interface must be one of {', '.join(sorted(can.VALID_INTERFACES))}, got {interface!r}")

    def open_port(filters: Sequence[CanFilter], clock: Clock, counters: Counter[str]) -> CanPort:
        wanted = [_python_can_filter(wanted) for wanted in filters]
        with port_errors():
            if interface == "socketcan":
                # Else python-can would log an error of its own at every attempt while the interface is missing.
                socket.if_nametoindex(channel)
            bus = can.Bus(channel, interface, ignore_config=True, can_filters=wanted or None, **options)
        return SocketCanPort(bus, clock, counters) if interface == "socketcan" else PollingPort(bus, clock, counters)

    return open_port


def _python_can_filter(wanted: CanFilter) -> dict[str, int | bool]:
    return {"can_id": wanted.identifier, "can_mask": wanted.mask, "extended": wanted.extended}
