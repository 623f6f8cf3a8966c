"""Frames of the lines of a text, put in in any order and given out as blocks, one an interface, in their order."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from drivers.can.frame import CLASSIC_DATA_BYTES, FD_DATA_BYTES, CanFrame
from drivers.can.frame_block import ERROR, EXTENDED, FD, FrameBlock

_NO_FRAME = -1
_SHORT_MAX = np.iinfo(np.int16).max


class LineFrames:
    """The frames of a number of lines, each of which has one or none.

    Attributes:
        time_s: (lines,) float64, of those that have one.
    """

    def __init__(self, lines: int) -> None:
        self.time_s = np.zeros(lines)
        self._identifier = np.zeros(lines, dtype=np.uint32)
        self._kind = np.zeros(lines, dtype=np.uint8)
        self._length = np.zeros(lines, dtype=np.uint8)
        self._data = np.zeros((lines, CLASSIC_DATA_BYTES), dtype=np.uint8)
        self._interface = np.full(lines, _NO_FRAME, dtype=np.int32)
        self._interfaces: dict[str, int] = {}

    def put(self, row: int, interface: str, frame: CanFrame) -> None:
        """The frame of one line."""
        length = len(frame.data)
        self.time_s[row] = frame.time_s
        self._identifier[row] = frame.identifier
        self._kind[row] = frame.extended * EXTENDED | frame.fd * FD | frame.error * ERROR
        self._length[row] = length
        self._widen(length)
        self._data[row, :length] = np.frombuffer(frame.data, dtype=np.uint8)
        self._interface[row] = self._interfaces.setdefault(interface, len(self._interfaces))

    def fill(self, rows: NDArray[np.intp], interface: str, frames: FrameBlock) -> None:
        """The frames of many lines."""
        self.time_s[rows] = frames.time_s
        self._identifier[rows] = frames.identifier
        self._kind[rows] = frames.kind
        self._length[rows] = frames.length
        self._widen(frames.data.shape[1])
        self._data[rows, : frames.data.shape[1]] = frames.data
        self._interface[rows] = self._interfaces.setdefault(interface, len(self._interfaces))

    def blocks(self) -> Iterator[tuple[str, FrameBlock]]:
        """Each interface's frames."""
        rows = np.flatnonzero(self._interface != _NO_FRAME)
        interface = self._interface[rows]
        if len(self._interfaces) < _SHORT_MAX:
            interface = interface.astype(np.int16)  # numpy sorts short integers by radix, in a tenth of the time
        order = np.argsort(interface, kind="stable")
        bounds = np.searchsorted(interface[order], np.arange(len(self._interfaces) + 1))
        for name, number in self._interfaces.items():
            yield name, self._block(rows[order[bounds[number] : bounds[number + 1]]])

    def _block(self, rows: NDArray[np.intp]) -> FrameBlock:
        kind = self._kind[rows]
        width = FD_DATA_BYTES if (kind & FD).any() else CLASSIC_DATA_BYTES
        data = self._data[rows, :width]
        return FrameBlock(self.time_s[rows], self._identifier[rows], kind, self._length[rows], data)

    def _widen(self, width: int) -> None:
        if width > self._data.shape[1]:
            wide = np.zeros((len(self._data), FD_DATA_BYTES), dtype=np.uint8)
            wide[:, :CLASSIC_DATA_BYTES] = self._data
            self._data = wide
