"""The end of an MCAP file: what is where in it."""

from __future__ import annotations

import struct
import zlib
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    AttachmentIndex,
    Channel,
    ChunkIndex,
    DataEnd,
    Footer,
    McapRecord,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from mcap.writer import MCAP0_MAGIC

from gateway.recording.record_bytes import bytes_of

_FOOTER_BYTES = 20


@dataclass(slots=True)
class Summary:
    """What has been written to a file.

    Attributes:
        schemas, channels: by their ids.
        chunks, attachments, metadata: where each is.
        messages: by channel.
    """

    schemas: dict[int, Schema] = field(default_factory=dict)
    channels: dict[int, Channel] = field(default_factory=dict)
    chunks: list[ChunkIndex] = field(default_factory=list)
    attachments: list[AttachmentIndex] = field(default_factory=list)
    metadata: list[MetadataIndex] = field(default_factory=list)
    messages: Counter[int] = field(default_factory=Counter)

    def add_chunk(self, index: ChunkIndex, messages: Mapping[int, int]) -> None:
        """A chunk, with the number of its messages by channel."""
        self.chunks.append(index)
        self.messages.update(messages)

    def records(self, start: int) -> bytes:
        """The end of a file whose data end at `start`: end of data, summary, footer and magic."""
        builder = RecordBuilder()
        DataEnd(0).write(builder)
        summary_start = start + builder.count
        groups = [(group, self._written(builder, records)) for group, records in self._groups().items() if records]
        offset_start = start + builder.count
        for group, (begin, length) in groups:
            SummaryOffset(group, start + begin, length).write(builder)
        data = bytes_of(builder)
        opening = struct.pack("<BQQQ", Opcode.FOOTER, _FOOTER_BYTES, summary_start, offset_start)
        checksum = zlib.crc32(opening, zlib.crc32(data[summary_start - start :]))
        footer = RecordBuilder()
        Footer(summary_start, offset_start, checksum).write(footer)
        return data + bytes_of(footer) + MCAP0_MAGIC

    def _groups(self) -> dict[Opcode, Iterable[McapRecord]]:
        return {
            Opcode.SCHEMA: list(self.schemas.values()),
            Opcode.CHANNEL: list(self.channels.values()),
            Opcode.STATISTICS: [self._statistics()],
            Opcode.CHUNK_INDEX: self.chunks,
            Opcode.ATTACHMENT_INDEX: self.attachments,
            Opcode.METADATA_INDEX: self.metadata,
        }

    @staticmethod
    def _written(builder: RecordBuilder, records: Iterable[McapRecord]) -> tuple[int, int]:
        begin = builder.count
        for record in records:
            record.write(builder)
        return begin, builder.count - begin

    def _statistics(self) -> Statistics:
        return Statistics(
            attachment_count=len(self.attachments),
            channel_count=len(self.channels),
            channel_message_counts=dict(self.messages),
            chunk_count=len(self.chunks),
            message_count=self.messages.total(),
            message_end_time=max((one.message_end_time for one in self.chunks), default=0),
            message_start_time=min((one.message_start_time for one in self.chunks), default=0),
            metadata_count=len(self.metadata),
            schema_count=len(self.schemas),
        )
