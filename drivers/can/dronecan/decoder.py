"""Frames of a DroneCAN bus to readings: one by one as they come, and in blocks as logs have them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from functools import partial
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from drivers.can.dronecan.commands import CommandReader
from drivers.can.dronecan.esc_status import ESC_STATUS, STATUS_EXTENDED, unpack_status_extended
from drivers.can.dronecan.node_status import NODE_STATUS, unpack_node_status
from drivers.can.dronecan.nodes import NodeWatch
from drivers.can.dronecan.rates import FrameRates
from drivers.can.dronecan.reports import ReportReader
from drivers.can.dronecan.setpoints import RAW_COMMAND, RPM_COMMAND
from drivers.can.dronecan.thruster import DroneCanThruster
from drivers.can.dronecan.transfer import (
    END_OF_TRANSFER,
    MESSAGE_MASK,
    SOURCE_MASK,
    START_OF_TRANSFER,
    STREAM_MASK,
    TOGGLE,
    TRANSFER_ID_MASK,
    DataType,
    TransferReceiver,
)
from drivers.can.dronecan.transfer_block import Transfers, receive
from drivers.can.frame import CanFilter, CanFrame
from drivers.can.frame_block import ERROR, EXTENDED, FD, FrameBlock
from drivers.can.twins import refuse_twins
from drivers.reading_block import ReadingBlock
from drivers.readings import Reading

# No propeller in water turns nearly as fast: above are sentinels (65535 = unknown), ERPM taken for RPM, and garbage.
SPEED_LIMIT_RPM = 30_000.0

# what comes often, and in many frames
_OFTEN = (ESC_STATUS, RAW_COMMAND.data_type, RPM_COMMAND.data_type)
# what comes now and then, in one frame
_SELDOM = (STATUS_EXTENDED, NODE_STATUS)
_TYPES = {one.key: one for one in (*_OFTEN, *_SELDOM)}
_SINGLE_FRAME = START_OF_TRANSFER | END_OF_TRANSFER

Rows: TypeAlias = NDArray[np.int64]
Told: TypeAlias = list[tuple[int, Reading]]
# takes the data and the time of a frame
Read: TypeAlias = Callable[[bytes, float], Sequence[Reading]]


class DroneCanDecoder:
    """Frames of a DroneCAN bus to commands and reports of its thrusters, and to how its nodes are.

    Causes counted in `drops`, beside those of the transfer layer ("CRC", "toggle", "missing start", "transfer id",
    "repeated transfer", "repeated frame", "unfinished transfer", "timed out", "wrong length", "empty frame"):
    "CAN FD", "anonymous node", "unknown node" (not the node_id of the configuration), "unknown ESC" (an esc_index
    that is not in the configuration), "duplicate source" (a second node claims an esc_index or commands the
    thrusters), "command missing" (a command too short for an ESC), "command out of range", "implausible speed",
    "non-finite" (an infinite voltage, current or temperature; NaN means unknown and is not counted). Of a Status with
    one bad field only that field is lost.

    What is wrong with the nodes is told, too: `EscConflict`, `CommanderConflict`, `NodeIdConflict`, `BabblingNode`.

    Args:
        thrusters: what is wired to the bus.
        speed_limit_rpm: a faster report is implausible.

    Attributes:
        thrusters: as given.

    Raises:
        ValueError: two thrusters with one number or one esc_index, or a limit that is not positive.
    """

    def __init__(self, thrusters: Sequence[DroneCanThruster], speed_limit_rpm: float = SPEED_LIMIT_RPM) -> None:
        if not speed_limit_rpm > 0.0:
            raise ValueError(f"speed_limit_rpm must be positive, got {speed_limit_rpm}")
        refuse_twins(thruster=[one.thruster for one in thrusters], esc_index=[one.esc_index for one in thrusters])
        self.drops: Counter[str] = Counter()
        self.thrusters = tuple(thrusters)
        self._thrusters = {one.esc_index: one for one in thrusters}
        self._nodes = NodeWatch()
        self._rates = FrameRates()
        self._commands = CommandReader(thrusters, self.drops)
        self._reports = ReportReader(thrusters, speed_limit_rpm, self._nodes, self.drops)
        self._receivers: dict[int, TransferReceiver] = {}
        self._streams: dict[int, Read] = {}
        self._readers: dict[int, Callable[[bytes, int, float], Sequence[Reading]]] = {
            ESC_STATUS.key: self._reports.read,
            RAW_COMMAND.data_type.key: partial(self._commands.read, RAW_COMMAND),
            RPM_COMMAND.data_type.key: partial(self._commands.read, RPM_COMMAND),
            STATUS_EXTENDED.key: self._read_extended,
        }

    def filters(self) -> list[CanFilter]:
        """Commands, what ESCs say of themselves, and what nodes do."""
        return [one.filter() for one in _TYPES.values()]

    def decode(self, frame: CanFrame) -> Sequence[Reading]:
        """Readings of the transfer that this frame completes, and what is to be told of its node; else empty."""
        stream = frame.identifier & STREAM_MASK
        read = self._streams.get(stream) or self._open(stream)
        if read is None or not frame.extended or frame.error:
            return ()
        source = stream & SOURCE_MASK
        if frame.fd or source == 0:
            self.drops["CAN FD" if frame.fd else "anonymous node"] += 1
            return ()
        time_s = frame.time_s
        babbling = self._rates.take(source, time_s)
        readings = read(frame.data, time_s)
        return readings if babbling is None else [*readings, babbling]

    def decode_block(self, block: FrameBlock) -> ReadingBlock:
        """Readings of many frames: those, and drops, that `decode` gives of one after the other."""
        rows = self._wanted(block)
        sources = (block.identifier[rows] & SOURCE_MASK).astype(np.int64)
        babbling = [(int(rows[place]), one) for place, one in self._rates.take_block(sources, block.time_s[rows])]
        keys = block.identifier[rows] & MESSAGE_MASK
        status, raw, rpm = (self._receive(one, block, rows[keys == one.key]) for one in _OFTEN)
        commands, conflicts = self._commands.read_block(raw, rpm)
        reports = self._reports.read_block(status)
        seldom = rows[np.isin(keys, [one.key for one in _SELDOM])]
        told = [*conflicts, *reports.conflicts, *self._read_seldom(block.part(seldom), seldom, reports.handovers)]
        # of one frame, what it says before what is said of it
        others = sorted([*told, *babbling], key=lambda one: one[0])
        return ReadingBlock(tuple(commands), tuple(reports.columns), tuple(others))

    def _wanted(self, block: FrameBlock) -> Rows:
        """Rows of the frames that are read; counts those of them that cannot be."""
        keys = block.identifier & MESSAGE_MASK
        wanted = np.isin(keys, list(_TYPES)) & (block.kind & (EXTENDED | ERROR) == EXTENDED)
        rows = np.flatnonzero(wanted)
        flexible = block.kind[rows] & FD != 0
        anonymous = block.identifier[rows] & SOURCE_MASK == 0
        for cause, dropped in (("CAN FD", flexible), ("anonymous node", anonymous & ~flexible)):
            if number := int(np.count_nonzero(dropped)):
                self.drops[cause] += number
        readable: Rows = rows[~(flexible | anonymous)]
        return readable

    def _receive(self, data_type: DataType, block: FrameBlock, rows: Rows) -> Transfers:
        return receive(data_type, block, rows, lambda source: self._receiver(data_type.key | source))

    def _read_seldom(self, block: FrameBlock, rows: Rows, handovers: list[tuple[int, int, int]]) -> Told:
        """What comes now and then, one by one; before each, the nodes that had come to speak for a thruster by then.

        Args:
            block: these frames.
            rows: of them, in the whole block.
            handovers: (row, thruster, node), ascending.
        """
        told: Told = []
        done = 0
        for row, frame in zip(rows.tolist(), block.frames(), strict=True):
            while done < len(handovers) and handovers[done][0] < row:
                self._nodes.speaks_for(*handovers[done][1:])
                done += 1
            stream = frame.identifier & STREAM_MASK
            read = self._streams.get(stream) or self._open(stream)
            told += [(row, one) for one in (read(frame.data, frame.time_s) if read is not None else ())]
        for _, thruster, node in handovers[done:]:
            self._nodes.speaks_for(thruster, node)
        return told

    def _receiver(self, stream: int) -> TransferReceiver:
        receiver = self._receivers.get(stream)
        if receiver is None:
            receiver = self._receivers[stream] = TransferReceiver(_TYPES[stream & MESSAGE_MASK], self.drops)
        return receiver

    def _open(self, stream: int) -> Read | None:
        """What reads the frames of a data type and a node; None where nothing does."""
        key, source = stream & MESSAGE_MASK, stream & SOURCE_MASK
        if key not in _TYPES:
            return None
        if key == NODE_STATUS.key:
            read: Read = partial(self._read_node, source)
        else:
            read = self._transfers(self._receiver(stream).accept, self._readers[key], source)
        self._streams[stream] = read
        return read

    @staticmethod
    def _transfers(
        accept: Callable[[bytes, float], bytes | None],
        read: Callable[[bytes, int, float], Sequence[Reading]],
        source: int,
    ) -> Read:
        def read_frame(data: bytes, time_s: float) -> Sequence[Reading]:
            payload = accept(data, time_s)
            return () if payload is None else read(payload, source, time_s)

        return read_frame

    def _read_node(self, source: int, data: bytes, time_s: float) -> Sequence[Reading]:
        """A NodeStatus: what repeats it is of interest, so that no receiver may throw it away."""
        tail = data[-1] if data else 0
        single = tail & (_SINGLE_FRAME | TOGGLE) == _SINGLE_FRAME
        status = unpack_node_status(data[:-1]) if single else None
        if status is None:
            self.drops["wrong length"] += 1
            return ()
        readings = self._nodes.status(source, tail & TRANSFER_ID_MASK, status, time_s)
        if readings is None:
            self.drops["repeated transfer"] += 1
        return readings or ()

    def _read_extended(self, payload: bytes, source: int, time_s: float) -> Sequence[Reading]:
        status = unpack_status_extended(payload)
        thruster = None if status is None else self._thrusters.get(status.esc_index)
        if status is None or thruster is None:
            self.drops["wrong length" if status is None else "unknown ESC"] += 1
            return ()
        if self._nodes.node_of(thruster.thruster) not in (None, source):
            self.drops["duplicate source" if thruster.node_id is None else "unknown node"] += 1
            return ()
        return self._nodes.condition(thruster.thruster, status, time_s)
