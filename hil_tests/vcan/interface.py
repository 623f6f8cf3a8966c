"""Is there a vcan on this machine itself?"""

from __future__ import annotations

import socket
from pathlib import Path

INTERFACE = "vcan0"
_IFF_UP = 0x1  # linux/if.h


def has_vcan(interface: str = INTERFACE) -> bool:
    """Whether a CAN interface of this name is up here and this process may open a raw socket on it."""
    flags = Path("/sys/class/net", interface, "flags")
    try:
        if not int(flags.read_text(), 16) & _IFF_UP:
            return False
        with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as raw:
            raw.bind((interface,))
    except OSError:
        return False
    return True
