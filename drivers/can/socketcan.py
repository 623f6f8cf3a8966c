"""SocketCAN, read from its socket in batches, and written to it frame by frame.

python-can's own reader has no count of the frames that the kernel lost, and takes 8 us for a frame; this one 1 us.

Frames bear the time at which the kernel took them from the driver (SO_TIMESTAMPNS). Stamps of the controller's own
(SO_TIMESTAMPING, where a driver has them at all) run on a clock of their own, which nobody keeps in step with that
of the other bus and of MAVLink: what they gain in fineness, some 0.1 ms, is lost many times over in joining them.
"""

from __future__ import annotations

import asyncio
import os
import socket
from collections import Counter
from collections.abc import Sequence

from drivers.can.datagrams import DatagramReader, Datagrams
from drivers.can.frame import CanFilter, CanFrame
from drivers.can.frame_block import FrameBlock
from drivers.can.packets import (
    CONTROL_BYTES,
    FD_BYTES,
    OVERFLOW,
    SO_RXQ_OVFL,
    SO_TIMESTAMPNS,
    frames_in,
    lost_before,
    packed,
    packed_filter,
    stamps_of,
)
from drivers.can.port import BATCH_MAX, GATHER_S, port_errors
from drivers.clock import Clock

RECEIVE_BUFFER_BYTES = 4 << 20  # a second and more of a full bus at 1 Mbit/s
SO_RCVBUFFORCE = 33
# linux/can/raw.h and linux/can.h (CAN_ERR_MASK); Python has no name for them
CAN_RAW_ERR_FILTER = 2
ALL_ERRORS = 0x1FFF_FFFF


def open_socket(channel: str, filters: Sequence[CanFilter]) -> socket.socket:
    """A raw CAN socket on an interface: classic frames and CAN FD, error frames, of the rest what is wanted.

    Args:
        channel: the interface.
        filters: frames that are wanted; none: all.

    Raises:
        OSError: there is no such interface, or it is down.
    """
    opened = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
    try:
        if filters:
            wanted = b"".join(packed_filter(one) for one in filters)
            opened.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, wanted)
        opened.setsockopt(socket.SOL_CAN_RAW, CAN_RAW_ERR_FILTER, ALL_ERRORS)
        opened.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FD_FRAMES, 1)
        opened.bind((channel,))
        # The kernel binds to an interface that is down without complaint, and leaves ENETDOWN as a pending error.
        pending = opened.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
        if pending:
            raise OSError(pending, os.strerror(pending))
    except BaseException:
        opened.close()
        raise
    return opened


def configure(opened: socket.socket) -> None:
    """Have the kernel stamp and count what a socket receives, keep a second of it, and never wait.

    Raises:
        OSError: the socket failed.
    """
    opened.setblocking(False)
    opened.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
    opened.setsockopt(socket.SOL_SOCKET, SO_RXQ_OVFL, 1)
    try:
        opened.setsockopt(socket.SOL_SOCKET, SO_RCVBUFFORCE, RECEIVE_BUFFER_BYTES)
    except PermissionError:  # only root may go beyond net.core.rmem_max
        opened.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES)


class SocketCanPort:
    """A SocketCAN interface, with kernel time stamps and the kernel's own count of the frames that it had to drop.

    Args:
        opened: a raw CAN socket, or any socket whose datagrams are CAN frames as the kernel has them; owned by the
            port from now on.
        clock: stamps the frames.
        counters: gets "remote frame", "malformed frame" and "receive buffer overflow" (frames lost because the reader
            was too slow).

    Raises:
        CanPortError: the socket failed.
    """

    def __init__(self, opened: socket.socket, clock: Clock, counters: Counter[str]) -> None:
        self._socket = opened
        self._clock = clock
        self._counters = counters
        self._lost = 0
        try:
            with port_errors():
                configure(opened)
                self._reader = DatagramReader(opened, FD_BYTES, CONTROL_BYTES, BATCH_MAX)
        except BaseException:
            self.close()
            raise

    async def receive(self) -> FrameBlock:
        """See CanPort."""
        while True:
            await self._readable()
            await asyncio.sleep(GATHER_S)
            with port_errors():
                frames = self._frames(self._reader.read())
            if len(frames):
                return frames

    async def _readable(self) -> None:
        loop = asyncio.get_running_loop()
        ready = asyncio.Event()
        loop.add_reader(self._socket, ready.set)
        try:
            await ready.wait()
        finally:
            loop.remove_reader(self._socket)

    def _frames(self, packets: Datagrams) -> FrameBlock:
        lost = lost_before(packets)
        if lost is not None:  # the kernel counts over the life of the socket, in 32 bits
            self._counters[OVERFLOW] += (lost - self._lost) & 0xFFFF_FFFF
            self._lost = lost
        return frames_in(packets, self._clock.stamps(stamps_of(packets)), self._counters)

    def send(self, frame: CanFrame) -> None:
        """See CanPort."""
        with port_errors():
            self._socket.send(packed(frame))

    def close(self) -> None:
        """See CanPort."""
        self._socket.close()
