"""Items as messages, channel by channel."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from drivers.can.frame_block import ERROR, EXTENDED, FD, FrameBlock
from drivers.mavlink.messages import StatusText
from drivers.readings import Reading
from gateway.channel import NavigationJudgement, SpeedJudgement, ThrusterJudgement
from gateway.findings import Finding
from gateway.pipeline import Outcome
from gateway.recording import topics
from gateway.recording.channel_table import ChannelTable
from gateway.recording.entries import Found, Heard, Spoken, Tick, Told
from gateway.recording.items import Came, Decoded, Gap, Item, Received
from gateway.recording.layout import Field, Layout
from gateway.recording.layouts import GAP, LOG, NOW, PACKET, ValueLayout, can_layout, layout_of
from gateway.recording.message_block import MessageBlock, message_block, row_block
from gateway.recording.times import NS, nanosecond, nanoseconds
from gateway.recording.verdict_rows import NavigationRow, SpeedRow, ThrusterRow
from gateway.severity import Severity

BEFORE = Field("before", "int64")
# of rcl_interfaces/msg/Log
_LOG_LEVELS = {
    Severity.EMERGENCY: 50,
    Severity.ALERT: 50,
    Severity.CRITICAL: 50,
    Severity.ERROR: 40,
    Severity.WARNING: 30,
    Severity.DEBUG: 10,
}
_INFO = 20
_LATEST_S = 2**31 - 1  # of its stamp, the year 2038
# sequence, time in seconds, values in the order of the layout
_Message: TypeAlias = tuple[int, float, Sequence[Any]]
_Numbered: TypeAlias = tuple[str, type[Reading], int | None]


def event_layout(kind: type[Reading]) -> tuple[ValueLayout[Reading], Layout]:
    """How a reading that no decoder has made is written: `before` first (0: None), then its own attributes."""
    values: ValueLayout[Reading] = layout_of(kind)
    return values, replace(values.layout, name=f"{values.layout.name}Event", fields=(BEFORE, *values.layout.fields))


def encode(items: Iterable[Item], table: ChannelTable) -> list[MessageBlock]:
    """The messages of these items.

    Args:
        items: in their order.
        table: of the file that they are for.
    """
    sheaf = _Sheaf()
    for item in items:
        sheaf.add(item)
    return list(sheaf.blocks(table))


class _Sheaf:
    """Items, sorted by channel."""

    def __init__(self) -> None:
        self._frames: defaultdict[str, list[Received]] = defaultdict(list)
        self._readings: defaultdict[_Numbered, list[Reading]] = defaultdict(list)
        self._messages: dict[str, tuple[Layout, list[_Message]]] = {}

    def add(self, item: Item) -> None:
        match item:
            case Received(bus):
                self._frames[bus].append(item)
            case Decoded():
                self._add_readings(item)
            case Heard(place, time_s, data):
                self._add_message(topics.HEARD, PACKET, (place, time_s, (time_s, data)))
            case Spoken(place, time_s, data):
                self._add_message(topics.SAID, PACKET, (place, time_s, (time_s, data)))
            case Tick(place, time_s):
                self._add_message(topics.NOW, NOW, (place, time_s, (time_s,)))
            case Told():
                self._add_event(item)
            case Found(place, finding):
                self._add_finding(finding, place)
            case Came():
                for outcome in item.outcomes:
                    self._add_outcome(outcome, item)
            case Gap(place, time_s, cause, count):
                self._add_message(topics.GAPS, GAP, (place, time_s, (time_s, count, cause)))

    def blocks(self, table: ChannelTable) -> Iterator[MessageBlock]:
        for bus, several in self._frames.items():
            yield from _frame_blocks(bus, several, table)
        for (link, kind, number), readings in self._readings.items():
            values = layout_of(kind)
            topic = topics.decoded_topic(kind, link, number)
            yield _value_block(topic, values, readings, table)
        for topic, (layout, messages) in self._messages.items():
            encoded = [(sequence, time_s, layout.encode(values)) for sequence, time_s, values in messages]
            yield message_block(table.channel(topic, layout), encoded)

    def _add_readings(self, item: Decoded) -> None:
        link, readings = item.link, self._readings
        for reading in item.readings:
            number = getattr(reading, "thruster", None)
            if number is None:
                number = getattr(reading, "instance", None)
            readings[link, type(reading), number].append(reading)

    def _add_event(self, item: Told) -> None:
        reading = item.reading
        values, layout = event_layout(type(reading))
        written = [item.before or 0, *values.values(reading)]
        topic = topics.event_topic(item.link, type(reading))
        self._add_message(topic, layout, (item.place, reading.time_s, written))

    def _add_outcome(self, outcome: Outcome, item: Came) -> None:
        match outcome:
            case ThrusterJudgement(thruster=thruster):
                self._add_value(topics.verdict_topic(thruster), ThrusterRow.of(outcome), item.place)
            case SpeedJudgement():
                self._add_value(topics.SPEED, SpeedRow.of(outcome), item.place)
            case NavigationJudgement():
                self._add_value(topics.NAVIGATION, NavigationRow.of(outcome), item.place)
            case Finding():
                self._add_finding(outcome, item.place)
            case StatusText(severity, text):
                self._add_log(item.time_s, Severity(severity), "statustext", text, item.place)

    def _add_finding(self, finding: Finding, place: int) -> None:
        self._add_value(topics.FINDINGS, finding, place)
        self._add_log(finding.time_s, finding.severity, finding.subject, finding.text, place)

    def _add_value(self, topic: str, value: ThrusterRow | SpeedRow | NavigationRow | Finding, place: int) -> None:
        values: ValueLayout[Any] = layout_of(type(value))
        self._add_message(topic, values.layout, (place, value.time_s, values.values(value)))

    def _add_log(self, time_s: float, severity: Severity, name: str, text: str, place: int) -> None:
        sec, nanosec = divmod(nanosecond(time_s), NS)
        line = (min(sec, _LATEST_S), nanosec, _LOG_LEVELS.get(severity, _INFO), name, text, "", "", 0)
        self._add_message(topics.LOG, LOG, (place, time_s, line))

    def _add_message(self, topic: str, layout: Layout, message: _Message) -> None:
        known = self._messages.get(topic)
        if known is None:
            known = self._messages[topic] = (layout, [])
        known[1].append(message)


def _value_block(
    topic: str, values: ValueLayout[Any], readings: Sequence[Reading], table: ChannelTable
) -> MessageBlock:
    channel = table.channel(topic, values.layout)
    if values.layout.fixed:
        columns = values.columns(readings)
        return row_block(channel, values.layout, nanoseconds(columns["time_s"]), 0, columns)
    return message_block(channel, [(0, one.time_s, values.layout.encode(values.values(one))) for one in readings])


def _frame_blocks(bus: str, several: Sequence[Received], table: ChannelTable) -> Iterator[MessageBlock]:
    """The frames of a bus; those of CAN FD apart, for they are longer."""
    for block, place in _by_width(several):
        fd = block.kind & FD != 0
        for rows, wide in ((~fd, False), (fd, True)):
            if rows.all():
                yield _frame_block(bus, block, place, wide, table)
            elif rows.any():
                yield _frame_block(bus, block.part(rows), place[rows], wide, table)


def _by_width(several: Sequence[Received]) -> Iterator[tuple[FrameBlock, NDArray[np.int64]]]:
    """All of them in one block for each width of their data."""
    for width in sorted({one.frames.data.shape[1] for one in several}):
        alike = [one for one in several if one.frames.data.shape[1] == width]
        blocks = [one.frames for one in alike]
        joined = FrameBlock(
            np.concatenate([one.time_s for one in blocks]),
            np.concatenate([one.identifier for one in blocks]),
            np.concatenate([one.kind for one in blocks]),
            np.concatenate([one.length for one in blocks]),
            np.concatenate([one.data for one in blocks]),
        )
        yield joined, _places(alike)


def _places(several: Sequence[Received]) -> NDArray[np.int64]:
    """Of each frame: from the first on, of each item."""
    lengths = np.array([len(one.frames) for one in several])
    before = np.cumsum(lengths) - lengths
    firsts = np.array([one.first for one in several])
    places: NDArray[np.int64] = np.arange(lengths.sum()) + np.repeat(firsts - before, lengths)
    return places


def _frame_block(
    bus: str, block: FrameBlock, place: NDArray[np.int64], fd: bool, table: ChannelTable
) -> MessageBlock:
    layout = can_layout(bus, fd)
    time_ns = nanoseconds(block.time_s)
    name = bus.encode() + b"\0"
    columns = {
        "sec": time_ns // NS,
        "nanosec": time_ns % NS,
        "frame_id_size": len(name),
        "frame_id": np.frombuffer(name, np.uint8),
        "id": block.identifier,
        "is_rtr": False,
        "is_extended": block.kind & EXTENDED != 0,
        "is_error": block.kind & ERROR != 0,
        "length": block.length,
        "data": block.data if fd else block.data[:, :8],
    }
    return row_block(table.channel(topics.can_topic(bus, fd), layout), layout, time_ns, place, columns)
