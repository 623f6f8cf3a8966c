"""What benchmarks of CAN decoders share: frames as SocketCAN hands them out, and the numbers that results come to.

Both sides of a ratio start from the same bytes (struct can_frame, 16 bytes each). The peers stop at their own message
objects, ours go on to readings.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from struct import Struct

import numpy as np

from drivers.can.frame import EXTENDED_MASK, CanFrame
from drivers.can.frame_block import EXTENDED, FrameBlock
from drivers.readings import Reading, ThrusterCommand, ThrusterReport

EXTENDED_FLAG = 0x8000_0000
# identifier with its flags, bytes of data, data
PACKED = Struct("<IB3x8s")
COLUMNS = np.dtype([("identifier", "<u4"), ("length", "u1"), ("padding", "u1", 3), ("data", "u1", 8)])


def packed(frames: Iterable[CanFrame]) -> bytes:
    """Struct can_frame of each."""
    return b"".join(
        PACKED.pack(frame.identifier | EXTENDED_FLAG * frame.extended, len(frame.data), frame.data.ljust(8, b"\0"))
        for frame in frames
    )


def unpacked(stream: bytes, period_s: float) -> FrameBlock:
    """The frames, one every `period_s`."""
    columns = np.frombuffer(stream, COLUMNS)
    return FrameBlock(
        period_s * np.arange(len(columns), dtype=np.float64),
        columns["identifier"] & np.uint32(EXTENDED_MASK),
        np.where(columns["identifier"] >= EXTENDED_FLAG, EXTENDED, 0).astype(np.uint8),
        columns["length"],
        columns["data"],
    )


def numbers(readings: Sequence[Reading], command_full: float) -> list[int]:
    """Speeds, and commands as counts, in order."""
    numbers = []
    for reading in readings:
        if isinstance(reading, ThrusterCommand):
            numbers.append(round(reading.fraction * command_full))
        elif isinstance(reading, ThrusterReport) and reading.speed_rpm is not None:
            numbers.append(round(reading.speed_rpm))
    return numbers
