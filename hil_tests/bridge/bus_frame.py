"""A frame with all that the kernel says of it, so that it leaves a bridge as it has come.

Source: Linux include/uapi/linux/can.h, `struct can_frame` and `struct canfd_frame`.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from drivers.can.frame import CLASSIC_DATA_BYTES, EXTENDED_MASK, FD_DATA_BYTES, STANDARD_MASK, CanFrame, checked_frame
from drivers.can.packets import CLASSIC_BYTES, ERROR_FLAG, EXTENDED_FLAG, FD_BYTES, REMOTE_FLAG

# identifier with its flags, length, flags of CAN FD, raw DLC of a classic frame
_HEAD = struct.Struct("=IBBxB")
_CLASSIC, _FD = struct.Struct("=IBBxB8s"), struct.Struct("=IBBxB64s")
_SPECIAL = REMOTE_FLAG | ERROR_FLAG


@dataclass(frozen=True, slots=True)
class BusFrame(CanFrame):
    """A frame of which there is more to say than a `CanFrame` does; `dataclasses.replace` keeps it.

    Attributes:
        remote_dlc: a remote frame, that asks for so many bytes and has none; None: a data frame.
        fd_flags: of CAN FD: 1 the data was sent at the second bit rate (BRS), 2 its sender is error passive (ESI).
        raw_dlc: 9 to 15, where a classic frame of 8 bytes says so; else 0.
    """

    remote_dlc: int | None = None
    fd_flags: int = 0
    raw_dlc: int = 0


def unpacked(packet: bytes, time_s: float) -> CanFrame | None:
    """The frame in what a raw CAN socket gives; None where it is none.

    Args:
        packet: 16 or 72 bytes.
        time_s: reception.
    """
    size = len(packet)
    if size not in (CLASSIC_BYTES, FD_BYTES):
        return None
    word, length, flags, raw_dlc = _HEAD.unpack_from(packet)
    fd = size == FD_BYTES
    if length > (FD_DATA_BYTES if fd else CLASSIC_DATA_BYTES):
        return None
    start = _HEAD.size
    extended = word & EXTENDED_FLAG != 0
    identifier = word & (EXTENDED_MASK if extended or word & ERROR_FLAG else STANDARD_MASK)
    if not (word & _SPECIAL or fd or raw_dlc):
        return checked_frame(time_s, identifier, packet[start : start + length], extended, False, False)
    remote, error = word & REMOTE_FLAG != 0, word & ERROR_FLAG != 0
    data = b"" if remote else packet[start : start + length]
    return BusFrame(
        time_s, identifier, data, extended, fd, error, length if remote else None, flags if fd else 0, raw_dlc
    )


def packed(frame: CanFrame) -> bytes:
    """A frame as a raw CAN socket takes it. What has been cut or lengthened on the way has the DLC of its data."""
    word = frame.identifier | (EXTENDED_FLAG if frame.extended else 0) | (ERROR_FLAG if frame.error else 0)
    length, flags, raw_dlc = len(frame.data), 0, 0
    if isinstance(frame, BusFrame):
        flags, raw_dlc = frame.fd_flags, frame.raw_dlc if length == CLASSIC_DATA_BYTES else 0
        if frame.remote_dlc is not None:
            word, length, raw_dlc = word | REMOTE_FLAG, frame.remote_dlc, frame.raw_dlc
    if frame.fd:
        return _FD.pack(word, length, flags, 0, frame.data)
    return _CLASSIC.pack(word, length, 0, raw_dlc, frame.data)
