"""SocketCAN, opened by python-can and read from its socket.

python-can's own reader has no count of the frames that the kernel lost, and takes 6 us for a frame.
"""

from __future__ import annotations

import asyncio
import os
import socket
import struct
from collections import Counter

import can

from drivers.can.frame import EXTENDED_MASK, STANDARD_MASK, CanFrame
from drivers.can.port import BATCH_MAX, GATHER_S, port_errors, send
from drivers.clock import Clock

RECEIVE_BUFFER_BYTES = 4 << 20  # a second and more of a full bus at 1 Mbit/s

# linux/can.h and asm-generic/socket.h; Python's socket module does not have them all.
EXTENDED_FLAG = 0x8000_0000
REMOTE_FLAG = 0x4000_0000
ERROR_FLAG = 0x2000_0000
CLASSIC_FRAME_BYTES = 16
FD_FRAME_BYTES = 72
SO_RCVBUFFORCE = 33
SCM_TIMESTAMPNS = 35
SO_RXQ_OVFL = 40

_HEADER = struct.Struct("=IB3x")
_TIMESPEC = struct.Struct("@ll")
_COUNT = struct.Struct("=I")
_ANCILLARY_BYTES = socket.CMSG_SPACE(_TIMESPEC.size) + socket.CMSG_SPACE(_COUNT.size)


def parse_packet(packet: bytes, time_s: float) -> CanFrame | None:
    """A frame from the kernel's `struct can_frame` or `struct canfd_frame`; None for a remote frame: it has no data.

    Args:
        packet: 16 bytes of a classic frame, 72 of CAN FD.
        time_s: reception.
    """
    identifier, length = _HEADER.unpack_from(packet)
    if identifier & REMOTE_FLAG:
        return None
    error, extended = bool(identifier & ERROR_FLAG), bool(identifier & EXTENDED_FLAG)
    mask = EXTENDED_MASK if extended or error else STANDARD_MASK
    data = packet[_HEADER.size : _HEADER.size + length]
    return CanFrame(time_s, identifier & mask, data, extended, len(packet) > CLASSIC_FRAME_BYTES, error)


class SocketCanPort:
    """A SocketCAN interface, with kernel time stamps and the kernel's own count of the frames that it had to drop.

    Args:
        bus: python-can's bus, owned by the port from now on.
        clock: stamps the frames.
        counters: gets "remote frame" and "receive buffer overflow" (frames lost because the reader was too slow).

    Raises:
        CanPortError: the interface is down.
    """

    def __init__(self, bus: can.BusABC, clock: Clock, counters: Counter[str]) -> None:
        self._bus = bus
        self._clock = clock
        self._counters = counters
        self._lost = 0
        self._socket = socket.socket(fileno=os.dup(bus.fileno()))
        try:
            with port_errors():
                self._configure()
        except Exception:
            self.close()
            raise

    def _configure(self) -> None:
        self._socket.setblocking(False)
        self._socket.setsockopt(socket.SOL_SOCKET, SO_RXQ_OVFL, 1)
        try:
            self._socket.setsockopt(socket.SOL_SOCKET, SO_RCVBUFFORCE, RECEIVE_BUFFER_BYTES)
        except PermissionError:  # only root may go beyond net.core.rmem_max
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES)
        # The kernel binds to an interface that is down without complaint, and leaves ENETDOWN as a pending error.
        pending = self._socket.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
        if pending:
            raise OSError(pending, os.strerror(pending))

    async def receive(self) -> list[CanFrame]:
        """See CanPort."""
        frames: list[CanFrame] = []
        while not frames:
            await self._readable()
            await asyncio.sleep(GATHER_S)
            with port_errors():
                frames = self._drain()
        return frames

    async def _readable(self) -> None:
        loop = asyncio.get_running_loop()
        ready = asyncio.Event()
        loop.add_reader(self._socket, ready.set)
        try:
            await ready.wait()
        finally:
            loop.remove_reader(self._socket)

    def _drain(self) -> list[CanFrame]:
        frames: list[CanFrame] = []
        for _ in range(BATCH_MAX):
            try:
                packet, ancillary, _, _ = self._socket.recvmsg(FD_FRAME_BYTES, _ANCILLARY_BYTES)
            except BlockingIOError:
                break
            frame = parse_packet(packet, self._stamp(ancillary))
            if frame is None:
                self._counters["remote frame"] += 1
            else:
                frames.append(frame)
        return frames

    def _stamp(self, ancillary: list[tuple[int, int, bytes]]) -> float:
        """Time of reception, from the kernel's stamp; counts what the kernel says it lost before this frame."""
        time_s = None
        for _, kind, data in ancillary:
            if kind == SCM_TIMESTAMPNS and len(data) == _TIMESPEC.size:
                seconds, nanoseconds = _TIMESPEC.unpack(data)
                time_s = self._clock.stamp(seconds + nanoseconds * 1e-9)
            elif kind == SO_RXQ_OVFL:
                self._count_lost(_COUNT.unpack(data)[0])
        return self._clock.now() if time_s is None else time_s

    def _count_lost(self, total: int) -> None:
        # The kernel counts over the life of the socket, in 32 bits.
        self._counters["receive buffer overflow"] += (total - self._lost) & 0xFFFF_FFFF
        self._lost = total

    def send(self, frame: CanFrame) -> None:
        """See CanPort."""
        send(self._bus, frame)

    def close(self) -> None:
        """See CanPort."""
        self._socket.close()
        self._bus.shutdown()
