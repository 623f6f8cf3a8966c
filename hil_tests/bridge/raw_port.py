"""One end of a bridge: a raw CAN socket that is read and written at once, frame by frame.

The gateway's own port gathers frames for 20 ms before it takes them, which a bridge must not; and it needs no remote
frames, which a bridge does.
"""

from __future__ import annotations

import errno
import socket
import struct
from collections import Counter
from collections.abc import Callable
from enum import Enum, auto
from typing import Protocol

from drivers.can.frame import CanFrame
from drivers.can.packets import FD_BYTES, OVERFLOW, SO_RXQ_OVFL, SO_TIMESTAMPNS
from drivers.can.port import port_errors
from drivers.can.socketcan import configure, open_socket
from drivers.clock import Clock
from hil_tests.bridge.bus_frame import packed, unpacked

# so many frames of one bus at most before the other has its turn
BATCH = 64
MALFORMED = "malformed frame"

# of asm-generic: `struct timespec`, and the count of lost frames
_STAMP, _LOST = struct.Struct("@ll"), struct.Struct("@I")
_CONTROL_BYTES = socket.CMSG_SPACE(_STAMP.size) + socket.CMSG_SPACE(_LOST.size)
# the interface's queue is full; the socket's is
_FULL = frozenset({errno.ENOBUFS, errno.EAGAIN})
# CAN FD onto a bus that has none; a length that its driver does not know
_REFUSED = frozenset({errno.EINVAL, errno.EMSGSIZE})


class Sending(Enum):
    """What became of a frame that was handed on."""

    DONE = auto()
    FULL = auto()  # no room now
    REFUSED = auto()  # the interface will never take it


class BridgePort(Protocol):
    """What a bridge needs of an open interface: nothing that waits."""

    def fileno(self) -> int:
        """Becomes readable when frames have come, or the interface has failed."""
        ...

    def read(self, frames: list[CanFrame]) -> None:
        """Put frames that have come, at most some, behind these; then CanPortError if the interface failed."""
        ...

    def send(self, frame: CanFrame) -> Sending:
        """Hand a frame on; CanPortError if the interface failed."""
        ...

    def close(self) -> None:
        """Give the interface up."""
        ...


OpenPort = Callable[[Clock, Counter[str]], BridgePort]


class RawPort:
    """A raw CAN socket. What it sends, it does not hear itself, but all others on its interface do.

    Args:
        opened: a raw CAN socket, or any socket whose datagrams are CAN frames as the kernel has them; owned by the
            port from now on.
        clock: stamps the frames, by the kernel's time of their reception.
        counts: gets "malformed frame" and "receive buffer overflow".

    Raises:
        CanPortError: the socket failed.
    """

    def __init__(self, opened: socket.socket, clock: Clock, counts: Counter[str]) -> None:
        self._socket, self._clock, self._counts = opened, clock, counts
        self._lost = 0
        try:
            with port_errors():
                configure(opened)
        except BaseException:
            self.close()
            raise

    def fileno(self) -> int:
        """See BridgePort."""
        return self._socket.fileno()

    def read(self, frames: list[CanFrame]) -> None:
        """See BridgePort."""
        try:
            for _ in range(BATCH):
                packet, control, _, _ = self._socket.recvmsg(FD_BYTES, _CONTROL_BYTES)
                frame = unpacked(packet, self._stamp(control))
                if frame is None:
                    self._counts[MALFORMED] += 1
                else:
                    frames.append(frame)
        except BlockingIOError:
            return
        except OSError:
            with port_errors():
                raise

    def _stamp(self, control: list[tuple[int, int, bytes]]) -> float:
        time_s = None
        for _, kind, data in control:
            if kind == SO_TIMESTAMPNS:
                seconds, nanoseconds = _STAMP.unpack(data)
                time_s = self._clock.stamp(seconds + 1e-9 * nanoseconds)
            elif kind == SO_RXQ_OVFL:  # counted over the life of the socket, in 32 bits
                (lost,) = _LOST.unpack(data)
                self._counts[OVERFLOW] += (lost - self._lost) & 0xFFFF_FFFF
                self._lost = lost
        return self._clock.now() if time_s is None else time_s

    def send(self, frame: CanFrame) -> Sending:
        """See BridgePort."""
        try:
            self._socket.send(packed(frame))
        except OSError as error:
            if error.errno in _FULL:
                return Sending.FULL
            if error.errno in _REFUSED:
                return Sending.REFUSED
            with port_errors():
                raise
        return Sending.DONE

    def close(self) -> None:
        """See BridgePort."""
        self._socket.close()


def socketcan(channel: str) -> OpenPort:
    """How an interface of SocketCAN is opened for a bridge, as often as needed; CanPortError where it does not."""

    def open_port(clock: Clock, counts: Counter[str]) -> BridgePort:
        with port_errors():
            return RawPort(open_socket(channel, ()), clock, counts)

    return open_port
