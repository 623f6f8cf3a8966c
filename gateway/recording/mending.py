"""Gives recordings without an end the end that they lack, so that every viewer opens them."""

from __future__ import annotations

import logging
import os
from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

import numpy as np
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Attachment, AttachmentIndex, Channel, Chunk, ChunkIndex, Metadata, MetadataIndex, Schema
from mcap.writer import MCAP0_MAGIC
from numpy.typing import NDArray

from drivers.logs.damage import DamageReport
from gateway.recording.chunk import ENTRY_BYTES, INDEX_HEAD, write_indexes
from gateway.recording.folder import idle, recordings
from gateway.recording.message_block import HEAD as MESSAGE_HEAD
from gateway.recording.record_bytes import bytes_of
from gateway.recording.summary import Summary
from gateway.recording.walk import Record, RecordError, chunk_content, has_end, inner_records, records

log = logging.getLogger("gateway")


def mend(path: Path) -> bool:
    """Writes the end of a recording that has none, behind its last whole chunk.

    Returns:
        Whether it had none. One that is being written is left alone.

    Raises:
        OSError: it cannot be read or written.
        ValueError: it is no MCAP file.
    """
    with idle(path) as file:
        if file is None or has_end(file):
            return False
        file.seek(0)
        if file.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
            raise ValueError(f"{path}: want an MCAP file")
        _write_end(file, _survey(path))
        return True


def mend_all(folder: Path) -> None:
    """Mends all recordings in a folder; what cannot be mended is logged."""
    try:
        found = recordings(folder)
    except OSError:
        return  # not there yet, or told when it is written to
    for one in found:
        try:
            if mend(one.path):
                log.info("recording %s had no end (power lost?): mended", one.path.name)
        except Exception as error:  # whatever is in it: the others are to be mended all the same
            log.warning("recording %s cannot be mended: %s", one.path.name, error)


@dataclass(slots=True)
class _Survey:
    """What a file without an end has.

    Attributes:
        summary: of it.
        end: where its last whole record ends.
        newest: the last chunk's content; empty: that is damaged, and message indexes behind it are of nothing.
        counted: messages of the last chunk by channel, as its indexes say.
    """

    summary: Summary = field(default_factory=Summary)
    end: int = len(MCAP0_MAGIC)
    newest: bytes = b""
    counted: dict[int, int] = field(default_factory=dict)

    def take(self, record: Record) -> None:
        """Notes a record.

        Raises:
            RecordError: it is damaged, and not noted.
        """
        match record.opcode:
            case Opcode.METADATA:
                name = record.parsed(Metadata.read).name
                self.summary.metadata.append(MetadataIndex(record.offset, record.end - record.offset, name))
            case Opcode.ATTACHMENT:
                self.summary.attachments.append(_attachment_index(record))
            case Opcode.CHUNK:
                self._take_chunk(record)
            case Opcode.MESSAGE_INDEX if self.newest:
                self._take_index(record)
        self.end = record.end

    def _take_chunk(self, record: Record) -> None:
        self.summary.messages.update(self.counted)
        self.newest, self.counted = b"", {}
        content = chunk_content(record)
        for opcode, _, inner in inner_records(content):
            inside = Record(opcode, 0, inner)
            match opcode:
                case Opcode.SCHEMA:
                    schema = inside.parsed(Schema.read)
                    self.summary.schemas[schema.id] = schema
                case Opcode.CHANNEL:
                    channel = inside.parsed(Channel.read)
                    self.summary.channels[channel.id] = channel
                case Opcode.MESSAGE:
                    break  # the recorder writes them last
        self.summary.chunks.append(_chunk_index(record))
        self.newest = content

    def _take_index(self, record: Record) -> None:
        """One of the last chunk's: how many messages of which channel it has."""
        channel, size = INDEX_HEAD.unpack_from(record.content.ljust(INDEX_HEAD.size, b"\0"))
        if channel not in self.summary.channels or size != len(record.content) - INDEX_HEAD.size:
            raise RecordError("damaged index")
        index = self.summary.chunks[-1]
        index.message_index_offsets[channel] = record.offset
        index.message_index_length += record.end - record.offset
        self.counted[channel] = size // ENTRY_BYTES


def _survey(path: Path) -> _Survey:
    survey = _Survey()
    for record in records(path, DamageReport()):
        try:
            survey.take(record)
        except RecordError:
            continue  # readers of the end do not come to it
    for channel in survey.summary.channels.values():
        survey.summary.schemas.setdefault(channel.schema_id, _lost(channel.schema_id))
    return survey


def _lost(schema: int) -> Schema:
    """Stands where a schema was in a damaged chunk: readers of the end ask for one of every channel."""
    return Schema(schema, b"", "", "lost")


def _attachment_index(record: Record) -> AttachmentIndex:
    one = record.parsed(Attachment.read)
    length = record.end - record.offset
    return AttachmentIndex(
        record.offset, length, one.log_time, one.create_time, len(one.data), one.name, one.media_type
    )


def _chunk_index(record: Record) -> ChunkIndex:
    chunk = record.parsed(Chunk.read)
    return ChunkIndex(
        chunk_length=record.end - record.offset,
        chunk_start_offset=record.offset,
        compression=chunk.compression,
        compressed_size=len(chunk.data),
        message_end_time=chunk.message_end_time,
        message_index_length=0,
        message_index_offsets={},
        message_start_time=chunk.message_start_time,
        uncompressed_size=chunk.uncompressed_size,
    )


def _write_end(file: BinaryIO, survey: _Survey) -> None:
    indexes = _missing_indexes(survey)
    file.truncate(survey.end)
    file.seek(survey.end)
    file.write(indexes + survey.summary.records(survey.end + len(indexes)))
    file.flush()
    os.fsync(file.fileno())


def _missing_indexes(survey: _Survey) -> bytes:
    """Message indexes of the last chunk, where they are not all there; the file then ends with that chunk."""
    if not survey.newest:
        return b""
    index, entries = survey.summary.chunks[-1], _entries(survey.newest)
    counted = {one: len(rows) for one, rows in entries.items()}
    survey.summary.messages.update(counted)
    if counted == survey.counted:
        return b""
    survey.end = index.chunk_start_offset + index.chunk_length
    builder = RecordBuilder()
    index.message_index_offsets = write_indexes(builder, entries, survey.end)
    index.message_index_length = builder.count
    return bytes_of(builder)


def _entries(content: bytes) -> dict[int, NDArray[np.int64]]:
    """By channel, (N, 2) log time and offset of each message of a chunk, in the order of time."""
    found: defaultdict[int, list[tuple[int, int]]] = defaultdict(list)
    for opcode, offset, _ in inner_records(content):
        if opcode == Opcode.MESSAGE:
            _, _, channel, _, time_ns, _ = MESSAGE_HEAD.unpack_from(content, offset)
            found[channel].append((time_ns, offset))
    return {channel: np.array(sorted(rows), dtype=np.int64) for channel, rows in found.items()}
