"""A chunk of an MCAP file, with the indexes of its messages."""

from __future__ import annotations

import struct
import zlib
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import Chunk, ChunkIndex
from numpy.typing import NDArray

from gateway.recording.message_block import MessageBlock
from gateway.recording.record_bytes import bytes_of
from gateway.recording.walk import HEAD

# half the size of LZ4 for half a percent of a core, at two full buses
COMPRESSION, LEVEL = "zstd", 1
INDEX_HEAD = struct.Struct("<HI")  # of a message index: channel, and bytes of its entries
ENTRY_BYTES = 16  # log time and offset


@dataclass(frozen=True, slots=True)
class WrittenChunk:
    """Bytes of a chunk with its message indexes, where they begin in the file, and how many messages of which channel
    it has."""

    data: bytes
    index: ChunkIndex
    messages: Counter[int]


def chunk_of(preamble: bytes, blocks: Sequence[MessageBlock], start: int) -> WrittenChunk:
    """A chunk of these messages.

    Args:
        preamble: records of schemas and channels.
        blocks: of messages, one at least.
        start: where in the file it will begin.
    """
    inner = b"".join([preamble, *(block.data for block in blocks)])
    packed = zstandard.ZstdCompressor(level=LEVEL).compress(inner)
    earliest = min(int(block.log_time.min()) for block in blocks)
    latest = max(int(block.log_time.max()) for block in blocks)
    builder = RecordBuilder()
    Chunk(COMPRESSION, packed, latest, earliest, zlib.crc32(inner), len(inner)).write(builder)
    length = builder.count
    offsets = write_indexes(builder, _entries(len(preamble), blocks), start)
    index = ChunkIndex(
        chunk_length=length,
        chunk_start_offset=start,
        compression=COMPRESSION,
        compressed_size=len(packed),
        message_end_time=latest,
        message_index_length=builder.count - length,
        message_index_offsets=offsets,
        message_start_time=earliest,
        uncompressed_size=len(inner),
    )
    counts: Counter[int] = Counter()
    for block in blocks:
        counts[block.channel] += len(block.log_time)
    return WrittenChunk(bytes_of(builder), index, counts)


def _entries(first: int, blocks: Sequence[MessageBlock]) -> dict[int, NDArray[np.int64]]:
    """By channel, (N, 2) log time and offset of each of its messages, in the order of time."""
    parts: defaultdict[int, list[NDArray[np.int64]]] = defaultdict(list)
    for block in blocks:
        parts[block.channel].append(np.stack([block.log_time, block.offset + first], axis=1))
        first += len(block.data)
    return {channel: _in_time_order(np.concatenate(several)) for channel, several in parts.items()}


def _in_time_order(entries: NDArray[np.int64]) -> NDArray[np.int64]:
    times = entries[:, 0]
    if (times[1:] < times[:-1]).any():
        entries = entries[np.argsort(times, kind="stable")]
    return entries


def write_indexes(builder: RecordBuilder, entries: Mapping[int, NDArray[np.int64]], start: int) -> dict[int, int]:
    """Writes a message index for each channel; returns where in the file each begins.

    Args:
        builder: behind whose records they stand.
        entries: by channel, (N, 2) log time and offset in the chunk, in the order of time.
        start: where in the file those records begin.
    """
    offsets = {}
    for channel, rows in entries.items():
        offsets[channel] = start + builder.count
        size = ENTRY_BYTES * len(rows)
        builder.write(HEAD.pack(Opcode.MESSAGE_INDEX, INDEX_HEAD.size + size))
        builder.write(INDEX_HEAD.pack(channel, size))
        builder.write(rows.astype("<u8").tobytes())
    return offsets
