"""Opening a CAN interface by python-can's name for it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import can

from drivers.can.frame import CanFilter
from drivers.can.port import CanPort, PollingPort, port_errors
from drivers.can.socketcan import SocketCanPort, open_socket
from drivers.clock import Clock

SOCKETCAN = "socketcan"

# How an interface of python-can is told to acknowledge nothing either; others cannot, or are told elsewhere
LISTEN_ONLY: Mapping[str, Mapping[str, Any]] = {
    "kvaser": {"driver_mode": False},
    "nixnet": {"listen_only": True},
    "pcan": {"state": can.BusState.PASSIVE},
    "seeedstudio": {"operation_mode": "silent"},
    "slcan": {"listen_only": True},
    "systec": {"state": can.BusState.PASSIVE},
    "vector": {"listen_only": True},
}

PortOpener = Callable[[Sequence[CanFilter], Clock, Counter[str]], CanPort]


def port_opener(interface: str, channel: str, **options: Any) -> PortOpener:
    """How to open a bus, as often as needed. The opener raises CanPortError where it does not open.

    SocketCAN is opened here, all else by python-can; nothing is read from python-can's own configuration files or
    environment variables.

    Args:
        interface: python-can's name: "socketcan", "virtual", ...
        channel: its channel, such as "can0".
        options: passed on to python-can, such as `fd=True`; SocketCAN has none: its interface is set up by `ip link`.

    Raises:
        ValueError: python-can has no such interface.
    """
    if interface not in can.VALID_INTERFACES:
        raise ValueError(f"interface must be one of {', '.join(sorted(can.VALID_INTERFACES))}, got {interface!r}")

    def open_port(filters: Sequence[CanFilter], clock: Clock, counters: Counter[str]) -> CanPort:
        with port_errors():
            if interface == SOCKETCAN:
                return SocketCanPort(open_socket(channel, filters), clock, counters)
            wanted = [_python_can_filter(wanted) for wanted in filters]
            bus = can.Bus(channel, interface, ignore_config=True, can_filters=wanted or None, **options)
        return PollingPort(bus, clock, counters)

    return open_port


def _python_can_filter(wanted: CanFilter) -> dict[str, int | bool]:
    return {"can_id": wanted.identifier, "can_mask": wanted.mask, "extended": wanted.extended}
