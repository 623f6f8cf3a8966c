"""The records of an MCAP file one by one, as far as they are there: what is damaged is passed over."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from struct import Struct, error
from typing import BinaryIO, TypeVar
from zlib import crc32

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError, UnsupportedCompressionError
from mcap.opcode import Opcode
from mcap.records import Chunk
from mcap.stream_reader import get_chunk_data_stream
from mcap.writer import MCAP0_MAGIC

from drivers.logs.damage import DamageReport

RecordT = TypeVar("RecordT")

_CRC = Struct("<I")
HEAD = Struct("<BQ")  # opcode, and the length of what follows
_OPCODES = frozenset(int(one) for one in Opcode)
# of a chunk: first and last time, size and checksum of what is in it, and the name of its compression
_CHUNK_HEAD = Struct("<QQQII")
_COMPRESSIONS = tuple(len(name).to_bytes(4, "little") + name for name in (b"lz4", b"zstd"))
_NAME_AT = HEAD.size + _CHUNK_HEAD.size - 4
_WINDOW_BYTES = 1 << 20
_END_BYTES = HEAD.size + 20 + len(MCAP0_MAGIC)  # of a footer, and what stands behind it
# what a record raises when it is read whose bytes are damaged
DAMAGED = (McapError, ValueError, OverflowError, MemoryError, error)


class RecordError(Exception):
    """A record is damaged."""


class ChunkError(RecordError):
    """A chunk is damaged. The text is the cause, as it is counted."""


@dataclass(frozen=True, slots=True)
class Record:
    """A record. `offset`: of its first byte in the file; `content`: without opcode and length."""

    opcode: int
    offset: int
    content: bytes

    @property
    def end(self) -> int:
        """Offset of what comes behind it."""
        return self.offset + HEAD.size + len(self.content)

    def parsed(self, read: Callable[[ReadDataStream], RecordT]) -> RecordT:
        """What is in it.

        Args:
            read: of a class in `mcap.records`.

        Raises:
            RecordError: it is damaged.
        """
        if (
            self.opcode == Opcode.ATTACHMENT
            and crc32(self.content[: -_CRC.size]) != _CRC.unpack(self.content[-4:])[0]
        ):
            raise RecordError("damaged attachment")
        try:
            return read(ReadDataStream(BytesIO(self.content)))
        except (McapError, ValueError, OverflowError, MemoryError, error) as wrong:  # lengths may say anything
            raise RecordError("damaged record") from wrong


def has_end(file: BinaryIO) -> bool:
    """Whether an MCAP file is finished, by its last bytes."""
    size = file.seek(0, 2)
    if size < _END_BYTES + len(MCAP0_MAGIC):
        return False
    file.seek(size - _END_BYTES)
    tail = file.read(_END_BYTES)
    return tail.endswith(MCAP0_MAGIC) and HEAD.unpack_from(tail) == (Opcode.FOOTER, 20)


def records(path: Path, damage: DamageReport) -> Iterator[Record]:
    """The records of the data section.

    Args:
        path: an MCAP file.
        damage: told what is passed over, by its offset.

    Raises:
        OSError: the file cannot be read.
    """
    with path.open("rb") as file:
        size = file.seek(0, 2)
        offset: int | None = len(MCAP0_MAGIC)
        while offset is not None:
            record = _record_at(file, offset, size)
            if record is not None and record.opcode == Opcode.DATA_END:
                return
            if record is None or not (_is_chunk(file, offset, size) or _is_followed(file, record, size)):
                offset = _passed_over(file, offset, size, damage)
            else:
                yield record
                offset = record.end


def chunk_content(record: Record) -> bytes:
    """The records within a chunk.

    Raises:
        ChunkError: they are damaged.
    """
    chunk = record.parsed(Chunk.read)
    try:
        stream, length = get_chunk_data_stream(chunk, validate_crc=True)
        content = stream.read(length)
    except UnsupportedCompressionError as wrong:
        raise ChunkError(f"chunk of {wrong}") from wrong
    except Exception as wrong:  # each compression has errors of its own
        raise ChunkError("damaged chunk") from wrong
    if len(content) != chunk.uncompressed_size:
        raise ChunkError("damaged chunk")
    return content


def _head_at(file: BinaryIO, offset: int, size: int) -> tuple[int, int] | None:
    """Opcode and length of a record that can be one."""
    file.seek(offset)
    head = file.read(HEAD.size)
    if len(head) < HEAD.size:
        return None
    opcode, length = HEAD.unpack(head)
    return (opcode, length) if opcode in _OPCODES and length <= size - offset - HEAD.size else None


def _record_at(file: BinaryIO, offset: int, size: int) -> Record | None:
    head = _head_at(file, offset, size)
    if head is None:
        return None
    opcode, length = head
    return Record(opcode, offset, file.read(length))


def _is_followed(file: BinaryIO, record: Record, size: int) -> bool:
    """Whether another record stands behind it, or the end of the file: else its length is wrong."""
    return record.end == size or size - record.end < HEAD.size or _head_at(file, record.end, size) is not None


def _passed_over(file: BinaryIO, offset: int, size: int, damage: DamageReport) -> int | None:
    """Where the next chunk begins; None: there is none. What lies before it is noted."""
    following = _next_chunk(file, offset + 1, size)
    if following is not None:
        damage.add("damaged bytes", f"offset {offset}", following - offset)
    elif offset < size:
        damage.add("cut off", f"offset {offset}", size - offset)
    return following


def _next_chunk(file: BinaryIO, begin: int, size: int) -> int | None:
    """By the name of its compression, and lengths that agree with each other."""
    overlap = _NAME_AT + 16
    for window in range(begin, size, _WINDOW_BYTES):
        file.seek(window)
        data = file.read(_WINDOW_BYTES + overlap)
        for place in sorted(_places(data)):
            if place < _WINDOW_BYTES and _is_chunk(file, window + place, size):
                return window + place
    return None


def _places(data: bytes) -> Iterator[int]:
    for name in _COMPRESSIONS:
        found = data.find(name, _NAME_AT)
        while found >= 0:
            yield found - _NAME_AT
            found = data.find(name, found + 1)


def _is_chunk(file: BinaryIO, offset: int, size: int) -> bool:
    head = _head_at(file, offset, size)
    if head is None or head[0] != Opcode.CHUNK:
        return False
    content = file.read(_CHUNK_HEAD.size + 16)
    *_, name_bytes = _CHUNK_HEAD.unpack_from(content)
    before = _CHUNK_HEAD.size + int(name_bytes)
    packed = int.from_bytes(content[before : before + 8], "little")
    return head[1] == before + 8 + packed


def inner_records(content: bytes) -> Iterator[tuple[int, int, bytes]]:
    """Opcode, offset and content of each record within a chunk."""
    offset = 0
    while len(content) - offset >= HEAD.size:
        opcode, length = HEAD.unpack_from(content, offset)
        begin = offset + HEAD.size
        yield opcode, offset, content[begin : begin + length]
        offset = begin + length
