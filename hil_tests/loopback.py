"""Ports of this machine's own loopback, for programs that meet there."""

from __future__ import annotations

import socket

HOST = "127.0.0.1"


def free_port() -> int:
    """A UDP port of the loopback that nobody has now."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind((HOST, 0))
        return int(probe.getsockname()[1])
