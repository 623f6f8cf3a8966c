"""Reads recordings of ours: what they say of themselves, and what came in and went out, in its order."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from pathlib import Path

from mcap.opcode import Opcode
from mcap.records import Attachment, Metadata
from mcap.writer import MCAP0_MAGIC

from drivers.logs.damage import DamageReport
from drivers.logs.kinds import HEAD_BYTES, looks_like
from gateway.recording.about import PROGRAM, AboutError, read_about_from
from gateway.recording.chunk_reading import ChunkReader
from gateway.recording.entries import About, Entry
from gateway.recording.walk import Record, RecordError, chunk_content, has_end, records

_HEADER = struct.Struct("<BQI")  # opcode, length, and length of the profile


def is_mcap(head: bytes) -> bool:
    """Whether a file begins as MCAP does."""
    return head.startswith(MCAP0_MAGIC)


def is_recording(head: bytes) -> bool:
    """Whether a file begins as a recording of ours.

    Args:
        head: its first 256 bytes.
    """
    start = len(MCAP0_MAGIC)
    if not is_mcap(head) or len(head) < start + _HEADER.size:
        return False
    opcode, _, profile_bytes = _HEADER.unpack_from(head, start)
    library = start + _HEADER.size + profile_bytes + 4
    return opcode == Opcode.HEADER and head[library:].startswith(PROGRAM.encode())


def read_about(path: Path) -> About:
    """What a file of a recording says of itself.

    Raises:
        OSError: it cannot be read.
        ValueError: it is no recording of ours, or that is damaged.
    """
    _check(path)
    try:
        return _about(path)[0]
    except AboutError as error:
        raise ValueError(f"{path}: {error}; what it holds can still be had by `gateway export`") from error


def read_entries(path: Path, damage: DamageReport) -> Iterator[list[Entry]]:
    """What came in and went out, chunk by chunk, in the order of the places.

    A finding may come in the chunk behind that of its place.

    Args:
        path: a file of a recording.
        damage: told what is lost: what the recorder had no room for by its place, the rest by its offset.

    Raises:
        OSError: it cannot be read.
        ValueError: it is no recording of ours.
    """
    _check(path)
    try:
        _, place = _about(path)
    except AboutError as error:
        damage.add(str(error), "its beginning")
        place = 0
    return _entries(path, place, damage)


def _entries(path: Path, place: int, damage: DamageReport) -> Iterator[list[Entry]]:
    reader = ChunkReader(place, damage)
    for record in records(path, damage):
        damage.bytes_read = record.end
        if record.opcode == Opcode.CHUNK:
            try:
                entries = reader.read(chunk_content(record), record.offset)
            except RecordError as error:
                damage.add(str(error), f"offset {record.offset}")
            else:
                yield entries
    with path.open("rb") as file:
        if not has_end(file):
            damage.add("no end: it was written until the power went, or still is", f"offset {file.seek(0, 2)}")


def _check(path: Path) -> None:
    """Whether it is a recording of ours.

    Raises:
        OSError, ValueError: see `read_about`.
    """
    with path.open("rb") as file:
        head = file.read(HEAD_BYTES)
    if not is_recording(head):
        found = "an MCAP file of another program" if is_mcap(head) else looks_like(head)
        raise ValueError(f"{path}: want a recording of the gateway (.mcap), this is {found}")


def _about(path: Path) -> tuple[About, int]:
    """With the place of what was recorded last before the file.

    Raises:
        AboutError: it is damaged.
    """
    try:
        values, files = _said(path)
    except RecordError as error:
        raise AboutError(f"what it says of itself is damaged ({error})") from error
    return read_about_from(values, files, path)


def _said(path: Path) -> tuple[dict[str, str], list[Attachment]]:
    """Metadata and attachments.

    Raises:
        RecordError: one is damaged.
    """
    values: dict[str, str] = {}
    files: list[Attachment] = []
    for record in _first_records(path):
        match record.opcode:
            case Opcode.METADATA:
                said = record.parsed(Metadata.read)
                values = said.metadata if said.name == PROGRAM else values
            case Opcode.ATTACHMENT:
                files.append(record.parsed(Attachment.read))
    return values, files


def _first_records(path: Path) -> Iterator[Record]:
    """Those before the first chunk."""
    for record in records(path, DamageReport()):
        if record.opcode == Opcode.CHUNK:
            return
        yield record
