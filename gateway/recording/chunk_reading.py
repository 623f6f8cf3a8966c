"""What is in the chunks of a recording."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias, get_args

import numpy as np
from mcap.opcode import Opcode
from mcap.records import Channel, Schema
from numpy.typing import NDArray

from drivers.logs.damage import DamageReport
from drivers.readings import Reading
from gateway.findings import Finding
from gateway.recording import topics
from gateway.recording.encoding import event_layout
from gateway.recording.entries import Entry, Found, Heard, Spoken, Tick, Told
from gateway.recording.frame_rows import FrameRows
from gateway.recording.layout import Layout, LayoutError
from gateway.recording.layouts import GAP, NOW, PACKET, can_layout, layout_of
from gateway.recording.message_block import HEAD, record_row
from gateway.recording.placing import Single, in_order
from gateway.recording.walk import HEAD as RECORD_HEAD
from gateway.recording.walk import Record, RecordError

_READINGS: dict[str, type[Reading]] = {kind.__name__: kind for kind in get_args(Reading)}
_RUN_FIRST = 64  # rows that are looked at together, and more where all of them belong together
_SEQUENCES = 1 << 32

# Place and values of a message in, what it was out; None: nothing that is replayed
_Make: TypeAlias = Callable[[int, list[Any]], Single | None]


@dataclass(frozen=True, slots=True)
class _Messages:
    """What the messages of a channel are, one by one."""

    layout: Layout
    make: _Make


@dataclass(frozen=True, slots=True)
class _FrameChannel:
    """Frames of a bus."""

    bus: str
    fd: bool
    layout: Layout


class ChunkReader:
    """Reads chunk after chunk of one file.

    Args:
        place: of what was recorded last before it.
        damage: told what is lost.
    """

    def __init__(self, place: int, damage: DamageReport) -> None:
        self._place, self._damage = place, damage
        self._schemas: dict[int, Schema] = {}
        self._kinds: dict[int, _Messages | _FrameChannel | None] = {}
        self._offset = 0

    def read(self, content: bytes, offset: int) -> list[Entry]:
        """What a chunk holds, in the order of the places.

        Args:
            content: its records.
            offset: of the chunk, for the places of damage.
        """
        self._offset = offset
        frames, singles = FrameRows(), list[Single]()
        position = 0
        while len(content) - position >= RECORD_HEAD.size:
            opcode, length = RECORD_HEAD.unpack_from(content, position)
            end = position + RECORD_HEAD.size + length
            if end > len(content):
                self._lose("damaged chunk")
                break
            if opcode == Opcode.MESSAGE and length >= HEAD.size - RECORD_HEAD.size:
                end = self._message(content, position, end, frames, singles)
            elif opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                self._define(Record(opcode, position, content[position + RECORD_HEAD.size : end]))
            position = end
        entries = in_order(frames.placed(), singles)
        self._damage.records += len(singles)
        self._place = max([self._place, *(one.place for one in singles)])
        return entries

    def _message(self, content: bytes, position: int, end: int, frames: FrameRows, singles: list[Single]) -> int:
        """Reads the message that stands there, and those of its kind behind it; returns where they end."""
        _, _, channel, sequence, _, _ = HEAD.unpack_from(content, position)
        match self._kinds.get(channel):
            case _FrameChannel() as kind:
                return self._frames(kind, content, position, end, frames)
            case _Messages(layout, make):
                try:
                    made = make(self._placed(sequence), layout.decode(content[position + HEAD.size : end]))
                except (LayoutError, ValueError, OverflowError):
                    self._lose("damaged message")
                else:
                    singles += [] if made is None else [made]
        return end

    def _frames(self, kind: _FrameChannel, content: bytes, position: int, end: int, frames: FrameRows) -> int:
        row = record_row(kind.layout)
        if end - position != row.itemsize:
            self._lose("frame of another form")
            return end
        rows = _run(content, position, row)
        place = self._placed(rows["sequence"].astype(np.int64))
        self._damage.records += len(rows)
        bad = frames.add(kind.bus, kind.fd, rows, place)
        if bad:
            self._lose("no CAN frame", bad)
        self._place = max(self._place, int(place.max()))
        return position + rows.nbytes

    def _placed(self, sequence: Any) -> Any:
        """Whole places of these numbers, which are their last 32 bits: the nearest to where we are."""
        ahead = (sequence - self._place + _SEQUENCES // 2) % _SEQUENCES - _SEQUENCES // 2
        return self._place + ahead

    def _define(self, record: Record) -> None:
        """Takes a schema or a channel."""
        try:
            if record.opcode == Opcode.SCHEMA:
                schema = record.parsed(Schema.read)
                self._schemas[schema.id] = schema
                return
            channel = record.parsed(Channel.read)
        except RecordError:
            self._lose("damaged channel")
            return
        if channel.id not in self._kinds:
            self._kinds[channel.id] = self._kind(channel)

    def _kind(self, channel: Channel) -> _Messages | _FrameChannel | None:
        """What is known of a channel; None: it is not replayed, or of another version."""
        kind = self._known(channel.topic)
        schema = self._schemas.get(channel.schema_id)
        if kind is None or schema is None or schema.data.decode(errors="replace") == kind.layout.text:
            return kind
        self._lose(f"{channel.topic} of another version")
        return None

    def _known(self, topic: str) -> _Messages | _FrameChannel | None:
        if topic.startswith(topics.CAN):
            bus, fd = topics.bus_of(topic)
            return _FrameChannel(bus, fd, can_layout(bus, fd))
        if topic.startswith(topics.EVENTS):
            return _event(topic)
        findings = layout_of(Finding)
        return {
            topics.HEARD: _Messages(PACKET, lambda place, values: Heard(place, *values)),
            topics.SAID: _Messages(PACKET, lambda place, values: Spoken(place, *values)),
            topics.NOW: _Messages(NOW, lambda place, values: Tick(place, *values)),
            topics.GAPS: _Messages(GAP, self._gap),
            topics.FINDINGS: _Messages(findings.layout, lambda place, values: Found(place, findings.value(values))),
        }.get(topic)

    def _gap(self, place: int, values: list[Any]) -> None:
        _, count, cause = values
        self._damage.add(f"not recorded, no room: {cause}", f"before place {place}", count)

    def _lose(self, cause: str, count: int = 1) -> None:
        self._damage.add(cause, f"chunk at offset {self._offset}", count)


def _event(topic: str) -> _Messages | None:
    link, _, name = topic.removeprefix(topics.EVENTS).rpartition("/")
    kind = _READINGS.get(name)
    if kind is None:
        return None
    values, layout = event_layout(kind)

    def make(place: int, written: list[Any]) -> Told:
        before, *rest = written
        return Told(place, link, values.value(rest), before or None)

    return _Messages(layout, make)


def _run(content: bytes, position: int, row: np.dtype[np.void]) -> NDArray[Any]:
    """The rows from here on that are of the same channel, one at least."""
    possible = (len(content) - position) // row.itemsize
    wanted = _RUN_FIRST
    while True:
        rows = np.frombuffer(content, row, min(wanted, possible), position)
        first = rows[0]
        alike = (
            (rows["opcode"] == first["opcode"])
            & (rows["size"] == first["size"])
            & (rows["channel"] == first["channel"])
        )
        if not alike.all():
            return rows[: int(np.argmin(alike))]
        if wanted >= possible:
            return rows
        wanted *= 8
