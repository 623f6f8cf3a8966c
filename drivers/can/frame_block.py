"""Many CAN frames as columns: what a log gives and what numpy decodes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from drivers.can.frame import CLASSIC_DATA_BYTES, FD_DATA_BYTES, CanFrame, checked_frame

FloatArray: TypeAlias = NDArray[np.float64]
Selection: TypeAlias = slice | NDArray[np.intp] | NDArray[np.bool_]

EXTENDED, FD, ERROR = 1, 2, 4  # bits of `FrameBlock.kind`
# (extended, fd, error) by kind
_KINDS = tuple((bool(kind & EXTENDED), bool(kind & FD), bool(kind & ERROR)) for kind in range(8))


@dataclass(frozen=True, slots=True)
class FrameBlock:
    """N frames of one bus, in the order of their arrival. Whoever makes one has checked every frame of it.

    Attributes:
        time_s: (N,) float64, reception.
        identifier: (N,) uint32, 29 or 11 bits.
        kind: (N,) uint8, `EXTENDED`, `FD` and `ERROR` together.
        length: (N,) uint8, bytes of data.
        data: (N, 8) uint8, or (N, 64) if any is CAN FD; zero behind `length`.

    Raises:
        ValueError: columns of different lengths, or data of another width.
    """

    time_s: FloatArray
    identifier: NDArray[np.uint32]
    kind: NDArray[np.uint8]
    length: NDArray[np.uint8]
    data: NDArray[np.uint8]

    def __post_init__(self) -> None:
        rows = {len(column) for column in (self.time_s, self.identifier, self.kind, self.length, self.data)}
        if len(rows) != 1:
            raise ValueError(f"columns must have one length, got {sorted(rows)}")
        if self.data.ndim != 2 or self.data.shape[1] not in (CLASSIC_DATA_BYTES, FD_DATA_BYTES):
            raise ValueError(f"data must be (N, 8) or (N, 64), got {self.data.shape}")

    def __len__(self) -> int:
        return len(self.time_s)

    def part(self, rows: Selection) -> FrameBlock:
        """Some of the frames."""
        return FrameBlock(
            self.time_s[rows], self.identifier[rows], self.kind[rows], self.length[rows], self.data[rows]
        )

    def frames(self) -> Iterator[CanFrame]:
        """One by one."""
        columns = (self.time_s, self.identifier, self.kind, self.length)
        width, data = self.data.shape[1], self.data.tobytes()
        starts = range(0, len(data), width)
        for start, time_s, identifier, kind, length in zip(starts, *(one.tolist() for one in columns), strict=True):
            extended, fd, error = _KINDS[kind]
            yield checked_frame(time_s, identifier, data[start : start + length], extended, fd, error)

    @staticmethod
    def joined(blocks: Sequence[FrameBlock]) -> FrameBlock:
        """One after the other: of one block at least."""
        width = max(block.data.shape[1] for block in blocks)
        wide = [
            block.data
            if block.data.shape[1] == width
            else np.pad(block.data, ((0, 0), (0, width - CLASSIC_DATA_BYTES)))
            for block in blocks
        ]
        return FrameBlock(
            np.concatenate([block.time_s for block in blocks]),
            np.concatenate([block.identifier for block in blocks]),
            np.concatenate([block.kind for block in blocks]),
            np.concatenate([block.length for block in blocks]),
            np.concatenate(wide),
        )

    @staticmethod
    def of(frames: Sequence[CanFrame]) -> FrameBlock:
        """The block of these frames."""
        width = FD_DATA_BYTES if any(frame.fd for frame in frames) else CLASSIC_DATA_BYTES
        packed = b"".join(frame.data.ljust(width, b"\0") for frame in frames)
        return FrameBlock(
            np.array([frame.time_s for frame in frames], dtype=np.float64),
            np.array([frame.identifier for frame in frames], dtype=np.uint32),
            np.array([_kind(frame) for frame in frames], dtype=np.uint8),
            np.array([len(frame.data) for frame in frames], dtype=np.uint8),
            np.frombuffer(packed, dtype=np.uint8).reshape(len(frames), width),
        )


def _kind(frame: CanFrame) -> int:
    return frame.extended * EXTENDED | frame.fd * FD | frame.error * ERROR
