"""What a bus is: a virtual one, or one that may have a vehicle at its other end."""

from __future__ import annotations

import json
import socket
import subprocess
from typing import Any

from drivers.can.interface import SOCKETCAN
from drivers.can.network_interface import parse_controller
from hil_tests.bridge.permission import ABSENT, Bus

# Linux calls them so (`ip -details link`). An slcan adapter is a virtual device, too, but no virtual bus; nor is a
# vxcan, by which containers reach the buses of their host: what its other end is joined to cannot be seen from here.
VIRTUAL_KINDS = frozenset({"vcan"})
VIRTUAL = "virtual"  # python-can's, inside one process
UNKNOWN = "of unknown kind"

# An emulated machine takes seconds to start a program, and who is about to touch a bus has them.
ANSWER_S = 20.0


def bus_of(interface: str, channel: str) -> Bus:
    """What a bus is. In doubt it is real.

    Args:
        interface: python-can's name of it.
        channel: its channel, such as "can0".
    """
    if interface == VIRTUAL:
        return Bus(channel, virtual=True, kind=VIRTUAL)
    if interface != SOCKETCAN:
        return Bus(channel, virtual=False, kind=interface)
    kind = parse_kind(_details(channel))
    return Bus(channel, virtual=kind in VIRTUAL_KINDS, kind=kind or (UNKNOWN if _is_there(channel) else ABSENT))


def listens_only(channel: str) -> bool:
    """Whether the controller of a SocketCAN interface is set up to send nothing: it drops all that it is given."""
    found = parse_controller(_details(channel))
    return found is not None and found.listen_only


def _is_there(channel: str) -> bool:
    return channel in [name for _, name in socket.if_nameindex()]


def _details(channel: str) -> bytes:
    """The answer of iproute2's `ip`; nothing where it has none to give."""
    words = ["ip", "-details", "-json", "link", "show", "dev", channel]
    try:
        return subprocess.run(words, capture_output=True, check=False, timeout=ANSWER_S).stdout
    except (OSError, subprocess.TimeoutExpired):
        return b""


def parse_kind(answer: bytes) -> str | None:
    """The kind of the one interface in the answer of `ip -details -json link show`; None: it says none.

    The adapters' drivers say "can"; slcan and others say none, but that they are CAN.
    """
    try:
        [link] = json.loads(answer)
        info: Any = link.get("linkinfo", {})
        kind, kin = info.get("info_kind"), link.get("link_type")
    except (ValueError, TypeError, AttributeError):
        return None
    return next((one for one in (kind, kin) if isinstance(one, str)), None)
