"""What is read out of one message of fixed layout, compiled once: commands and reports of thrusters."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from drivers.can.frame import CLASSIC_DATA_BYTES, FD_DATA_BYTES, CanFrame
from drivers.can.frame_block import FD, FrameBlock
from drivers.can.messages.field_layout import FieldLayout
from drivers.can.messages.thruster_reader import CommandReader, CommandSignal, ReportReader, ReportSignals
from drivers.reading_block import CommandColumns, ReportColumns
from drivers.readings import Reading

IndexArray: TypeAlias = NDArray[np.intp]
Columns: TypeAlias = tuple[list[CommandColumns], list[ReportColumns]]

PADDING = 0xFF  # J1939 fills up what a message does not use


@dataclass(frozen=True, slots=True)
class MessageLayout:
    """The frame that carries a message.

    Attributes:
        identifier, extended: of its frames.
        length: of its data, in bytes.
        tail: True: whatever stands behind the data is let pass.

    Raises:
        ValueError: a length that no frame has.
    """

    identifier: int
    extended: bool
    length: int
    tail: bool = False

    def __post_init__(self) -> None:
        if not 0 <= self.length <= FD_DATA_BYTES:
            raise ValueError(f"length must lie in 0..{FD_DATA_BYTES}, got {self.length}")


class MessagePlan:
    """Reads one message.

    Args:
        message: its frame.
        commands, reports: what is read, at most one of each for a thruster.
        drops: where is counted what is thrown away.

    Attributes:
        message: its frame.
        commands, reports: what is read, by thruster.
        decode: function from a frame of this message to its readings.

    Raises:
        ValueError: a field that ends behind the message.
    """

    def __init__(
        self,
        message: MessageLayout,
        commands: Sequence[CommandSignal],
        reports: Sequence[ReportSignals],
        drops: Counter[str],
    ) -> None:
        self.message = message
        self.commands = tuple(sorted(commands, key=lambda one: one.thruster))
        self.reports = tuple(sorted(reports, key=lambda one: one.thruster))
        self._length = message.length
        self._drops = drops
        fields = [field for command in commands for field in command.signal.fields()]
        layout = FieldLayout(fields + [field for report in reports for field in report.fields()], message.length)
        self._unpack, self._columns = layout.unpack, layout.columns
        self._commands = [CommandReader(one, layout, drops) for one in self.commands]
        self._reports = [ReportReader(one, layout, drops) for one in self.reports]
        self.decode = self._compiled()

    def _compiled(self) -> Callable[[CanFrame], Sequence[Reading]]:
        """Closures: thousands of frames a second find what they need soonest in their cells."""
        length, own_data, unpack = self._length, self._own_data, self._unpack
        readers = [one.read for one in self._commands] + [one.read for one in self._reports]
        (only,) = readers if len(readers) == 1 else (None,)

        def decode(frame: CanFrame) -> Sequence[Reading]:
            data = frame.data if len(frame.data) == length else own_data(frame)
            if data is None:
                return ()
            numbers, time_s = unpack(data), frame.time_s
            if only is not None:
                reading = only(numbers, time_s)
                return () if reading is None else (reading,)
            readings = [read(numbers, time_s) for read in readers]
            return [reading for reading in readings if reading is not None]

        return decode

    def _own_data(self, frame: CanFrame) -> bytes | None:
        """The message's data of a frame that has more; None, and counted, where it is not the message."""
        if self._fits(frame):
            return frame.data[: self._length]
        self._drops["wrong length"] += 1
        return None

    def decode_block(self, block: FrameBlock, row: IndexArray) -> Columns:
        """`decode` of the frames of this message, which are those at `row` of the block."""
        row = self._fitting(block, row)
        if len(row) == 0:
            return [], []
        columns, time_s = self._columns(block.data[row]), block.time_s[row]
        commands = [command.columns(columns, row, time_s) for command in self._commands]
        reports = [report.columns(columns, row, time_s) for report in self._reports]
        return [one for one in commands if len(one.row)], [one for one in reports if len(one.row)]

    def _fits(self, frame: CanFrame) -> bool:
        """True if data that are longer than the message may be the message and what its sender padded it with.

        CAN FD has no frames of 9 to 11 bytes, to take the first, and pads to the next; J1939 pads to 8 bytes.
        """
        data, length = frame.data, self._length
        if len(data) <= length:
            return False
        return (
            self.message.tail
            or (frame.fd and length > CLASSIC_DATA_BYTES)
            or (
                self.message.extended
                and len(data) == CLASSIC_DATA_BYTES
                and data[length:] == bytes([PADDING]) * (CLASSIC_DATA_BYTES - length)
            )
        )

    def _fitting(self, block: FrameBlock, row: IndexArray) -> IndexArray:
        """Those of the rows whose frames are long enough and no longer than padding makes them."""
        length = block.length[row]
        fits = length == self._length
        if fits.all():
            return row
        odd = np.flatnonzero(~fits)
        fits[odd] = self._padded(block.part(row[odd]))
        dropped = len(row) - int(fits.sum())
        if dropped:
            self._drops["wrong length"] += dropped
        fitting: IndexArray = row[fits]
        return fitting

    def _padded(self, block: FrameBlock) -> NDArray[np.bool_]:
        """(N,) `_fits` of frames that have not the message's length."""
        padded = np.full(len(block), self.message.tail)
        if self._length > CLASSIC_DATA_BYTES:
            padded |= (block.kind & FD) != 0
        elif self.message.extended:
            filled = (block.data[:, self._length : CLASSIC_DATA_BYTES] == PADDING).all(axis=1)
            padded |= (block.length == CLASSIC_DATA_BYTES) & filled
        longer: NDArray[np.bool_] = padded & (block.length > self._length)
        return longer
