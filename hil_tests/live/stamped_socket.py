"""UDP sockets of the loopback whose datagrams the kernel stamps: when one is read plays no part."""

from __future__ import annotations

import socket
import struct
from collections.abc import Iterator

from drivers.can.packets import SO_TIMESTAMPNS

STAMP = struct.Struct("@qq")


def stamping_socket() -> socket.socket:
    """A UDP socket on the loopback whose datagrams the kernel stamps with its wall clock."""
    opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    opened.bind(("127.0.0.1", 0))
    opened.setblocking(False)
    opened.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
    return opened


def received(opened: socket.socket) -> Iterator[tuple[bytes, int]]:
    """What has arrived, and when."""
    while True:
        try:
            data, ancillary, _, _ = opened.recvmsg(2048, socket.CMSG_SPACE(STAMP.size))
        except BlockingIOError:
            return
        for _, _, stamp in ancillary:
            seconds, nanoseconds = STAMP.unpack(stamp)
            yield data, seconds * 10**9 + nanoseconds
