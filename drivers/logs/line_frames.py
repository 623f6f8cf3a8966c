"""Frames of the lines of a text, put in in any order and given out as blocks, one an interface, in their order."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from drivers.can.frame import CLASSIC_DATA_BYTES, FD_DATA_BYTES, CanFrame
from drivers.can.frame_block import FD, FloatArray, FrameBlock

_NO_FRAME = -1
_SHORT_MAX = np.iinfo(np.int16).max


class LineFrames:
    """The frames of a number of lines, each of which has one or none."""

    def __init__(self, lines: int) -> None:
        self._time_s = np.zeros(lines)
        self._identifier = np.zeros(lines, dtype=np.uint32)
        self._kind = np.zeros(lines, dtype=np.uint8)
        self._length = np.zeros(lines, dtype=np.uint8)
        self._data = np.zeros((lines, CLASSIC_DATA_BYTES), dtype=np.uint8)
        self._interface = np.full(lines, _NO_FRAME, dtype=np.int32)
        self._interfaces: dict[str, int] = {}
        self._single: defaultdict[str, list[tuple[int, CanFrame]]] = defaultdict(list)

    @property
    def time_s(self) -> FloatArray:
        """(lines,) of those that have a frame; they may be changed."""
        self._settle()
        return self._time_s

    def put(self, row: int, interface: str, frame: CanFrame) -> None:
        """The frame of one line."""
        self._single[interface].append((row, frame))

    def fill(self, rows: NDArray[np.intp], interface: str, frames: FrameBlock) -> None:
        """The frames of many lines."""
        self._time_s[rows] = frames.time_s
        self._identifier[rows] = frames.identifier
        self._kind[rows] = frames.kind
        self._length[rows] = frames.length
        self._widen(frames.data.shape[1])
        self._data[rows, : frames.data.shape[1]] = frames.data
        self._interface[rows] = self._interfaces.setdefault(interface, len(self._interfaces))

    def blocks(self) -> Iterator[tuple[str, FrameBlock]]:
        """Each interface's frames."""
        self._settle()
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
        return FrameBlock(self._time_s[rows], self._identifier[rows], kind, self._length[rows], data)

    def _settle(self) -> None:
        """Takes in the single frames, all at once."""
        for interface, pairs in self._single.items():
            rows, frames = zip(*pairs, strict=True)
            self.fill(np.array(rows), interface, FrameBlock.of(frames))
        self._single.clear()

    def _widen(self, width: int) -> None:
        if width > self._data.shape[1]:
            wide = np.zeros((len(self._data), FD_DATA_BYTES), dtype=np.uint8)
            wide[:, :CLASSIC_DATA_BYTES] = self._data
            self._data = wide
