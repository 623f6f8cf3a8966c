"""Frames as Linux passes them through a socket: `struct can_frame`, `struct canfd_frame`, and what it says of them.

Source: Linux include/uapi/linux/can.h, and socket(7) for the control data.
"""

from __future__ import annotations

import socket
import struct
from collections import Counter
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from drivers.can.datagrams import Datagrams
from drivers.can.frame import CLASSIC_DATA_BYTES, EXTENDED_MASK, FD_DATA_BYTES, STANDARD_MASK, CanFilter, CanFrame
from drivers.can.frame_block import ERROR, EXTENDED, FD, FloatArray, FrameBlock

# counted: frames that the kernel dropped, for the socket's buffer was full
OVERFLOW = "receive buffer overflow"

NumberT = TypeVar("NumberT", bound=np.generic)

EXTENDED_FLAG = 0x8000_0000
REMOTE_FLAG = 0x4000_0000
ERROR_FLAG = 0x2000_0000
CLASSIC_BYTES = 16
FD_BYTES = 72

# asm-generic/socket.h; Python's socket module does not have them all
SO_TIMESTAMPNS = 35
SO_RXQ_OVFL = 40

_CLASSIC = struct.Struct("=IB3x8s")
_FD = struct.Struct("=IB3x64s")
_FILTER = struct.Struct("=II")
_DATA_START = 8

_INT = np.dtype(np.int32)
_LONG = np.dtype(np.long)
_TIMESPEC_BYTES = 2 * _LONG.itemsize
_COUNT_BYTES = 4
# a header of control data: its length, SOL_SOCKET, and what it is
_KIND_START = socket.CMSG_LEN(0) - 4
_STAMP_START = socket.CMSG_LEN(0)
_LOST_AT = socket.CMSG_SPACE(_TIMESPEC_BYTES)
_LOST_START = _LOST_AT + socket.CMSG_LEN(0)
CONTROL_BYTES = _LOST_AT + socket.CMSG_SPACE(_COUNT_BYTES)


def packed(frame: CanFrame) -> bytes:
    """A data frame as the kernel takes it."""
    identifier = frame.identifier | (EXTENDED_FLAG if frame.extended else 0) | (ERROR_FLAG if frame.error else 0)
    return (_FD if frame.fd else _CLASSIC).pack(identifier, len(frame.data), frame.data)


def packed_filter(wanted: CanFilter) -> bytes:
    """`struct can_filter`, that tells standard frames from extended ones, too."""
    kind = EXTENDED_FLAG if wanted.extended else 0
    return _FILTER.pack(wanted.identifier | kind, wanted.mask | EXTENDED_FLAG)


def frames_in(packets: Datagrams, time_s: FloatArray, counters: Counter[str]) -> FrameBlock:
    """The data and error frames.

    Args:
        packets: N of them.
        time_s: (N,) reception.
        counters: gets "remote frame" (it has no data) and "malformed frame" (neither of the two structures).
    """
    identifier = _column(packets.data, 0, np.dtype(np.uint32))
    fd = packets.size == FD_BYTES
    whole = fd | (packets.size == CLASSIC_BYTES)
    remote = whole & (identifier & REMOTE_FLAG != 0)
    good = whole & ~remote
    if not good.all():
        _count(counters, "remote frame", remote)
        _count(counters, "malformed frame", ~whole)
        identifier, fd, time_s = identifier[good], fd[good], time_s[good]
        return _block(packets.data[good], identifier, fd, time_s)
    return _block(packets.data, identifier, fd, time_s)


def _block(
    data: NDArray[np.uint8], identifier: NDArray[np.uint32], fd: NDArray[np.bool_], time_s: FloatArray
) -> FrameBlock:
    extended, error = identifier & EXTENDED_FLAG != 0, identifier & ERROR_FLAG != 0
    width = FD_DATA_BYTES if fd.any() else CLASSIC_DATA_BYTES
    length = np.minimum(data[:, 4], np.where(fd, FD_DATA_BYTES, CLASSIC_DATA_BYTES).astype(np.uint8))
    # behind its data, a frame holds whatever its sender had in memory there
    kept = np.arange(width) < length[:, np.newaxis]
    return FrameBlock(
        time_s=time_s,
        identifier=identifier & np.where(extended | error, np.uint32(EXTENDED_MASK), np.uint32(STANDARD_MASK)),
        kind=extended * np.uint8(EXTENDED) | fd * np.uint8(FD) | error * np.uint8(ERROR),
        length=length,
        data=data[:, _DATA_START : _DATA_START + width] * kept,
    )


def _count(counters: Counter[str], cause: str, rows: NDArray[np.bool_]) -> None:
    if rows.any():
        counters[cause] += int(rows.sum())


def stamps_of(packets: Datagrams) -> FloatArray:
    """(N,) the kernel's wall-clock time of reception, in seconds since 1970; NaN where it gave none."""
    stamped = (packets.control_size >= _LOST_AT) & (_column(packets.control, _KIND_START, _INT) == SO_TIMESTAMPNS)
    seconds = _column(packets.control, _STAMP_START, _LONG)
    nanoseconds = _column(packets.control, _STAMP_START + _LONG.itemsize, _LONG)
    stamps: FloatArray = np.where(stamped, seconds + 1e-9 * nanoseconds, np.nan)
    return stamps


def lost_before(packets: Datagrams) -> int | None:
    """What the kernel counts as lost since the socket was opened, up to the last of them; None: it says nothing."""
    long_enough = packets.control_size >= _LOST_START + _COUNT_BYTES
    if not long_enough.any():
        return None
    counted = np.flatnonzero(long_enough & (_column(packets.control, _LOST_AT + _KIND_START, _INT) == SO_RXQ_OVFL))
    if not counted.size:
        return None
    return int(_column(packets.control[counted[-1:]], _LOST_START, np.dtype(np.uint32))[0])


def _column(rows: NDArray[np.uint8], start: int, kind: np.dtype[NumberT]) -> NDArray[NumberT]:
    """The number that stands at this place of each row, in the machine's own byte order."""
    return np.ascontiguousarray(rows[:, start : start + kind.itemsize]).view(kind)[:, 0]
