"""CAN frames as bytes to be damaged, and back: each the step in time to it, then the frame as Linux gives it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from drivers.can.datagrams import ByteArray, Datagrams, SizeArray
from drivers.can.frame import CanFrame
from drivers.can.frame_block import FrameBlock
from drivers.can.packets import CLASSIC_BYTES, CONTROL_BYTES, FD_BYTES, frames_in, packed

STEPS_S = (0.0, 0.0001, 0.001, 0.02, 0.02, 0.02, 0.5, 1.0, 2.5, 3.5, 60.0, -0.001, -0.5, -5.0)
START_S = 1000.0
_USUAL_STEP = STEPS_S.index(0.02)
_FD = 0x80  # in the byte of the step


def bytes_of(frames: Sequence[CanFrame]) -> bytes:
    """What `block_of` makes these frames of, a fiftieth of a second from one to the next."""
    return b"".join(bytes([_USUAL_STEP | (_FD if one.fd else 0)]) + packed(one) for one in frames)


def block_of(data: bytes) -> FrameBlock:
    """The frames of any bytes; a last one that is not whole is cut short."""
    steps_s, packets, place = [], [], 0
    while place < len(data):
        size = FD_BYTES if data[place] & _FD else CLASSIC_BYTES
        steps_s.append(STEPS_S[(data[place] & ~_FD) % len(STEPS_S)])
        packets.append(data[place + 1 : place + 1 + size])
        place += 1 + size
    return frames_in(datagrams(packets), START_S + np.cumsum(steps_s, dtype=np.float64), Counter())


def datagrams(packets: Sequence[bytes], control: Sequence[bytes] = ()) -> Datagrams:
    """What a socket gave: packets, each with its control data, none where there is less of it than packets."""
    controls = [*control, *(b"" for _ in packets)][: len(packets)]
    return Datagrams(*_rows(packets, FD_BYTES), *_rows(controls, CONTROL_BYTES))


def _rows(pieces: Sequence[bytes], width: int) -> tuple[ByteArray, SizeArray]:
    """(N, width) and the length of each."""
    joined = b"".join(one[:width].ljust(width, b"\0") for one in pieces)
    sizes = np.array([min(len(one), width) for one in pieces], dtype=np.int64)
    return np.frombuffer(joined, dtype=np.uint8).reshape(len(pieces), width), sizes
