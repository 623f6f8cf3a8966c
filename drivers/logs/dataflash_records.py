"""Records of a dataflash log, found in its bytes by numpy, read up to and past damage.

There are no checksums: a record is taken where another one begins at its end, or where the log ends there. In what
was found so, records stand one behind the other; what looks like a head inside of one is passed over. Bytes between
two that are taken are damage. Of a record that was cut, or written over, the rest is not believed either: nothing
begins where it ends.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import BinaryIO, TypeAlias

import numpy as np
from numpy.typing import NDArray

from drivers.logs.damage import DamageReport
from drivers.logs.dataflash_format import (
    FORMAT_BYTES,
    FORMAT_TYPE,
    HEAD,
    HEAD_BYTES,
    IndexArray,
    Mask,
    RecordFormat,
    Records,
)

CHUNK_BYTES = 1 << 20
LENGTH_MAX = 255  # it is one byte

Formats: TypeAlias = Mapping[int, RecordFormat]
Bytes: TypeAlias = NDArray[np.uint8]


def read_formats(file: BinaryIO) -> dict[int, RecordFormat]:
    """Types of records by their numbers, from all of the log, for its beginning may be lost; the first of each."""
    head = HEAD + bytes([FORMAT_TYPE])
    formats: dict[int, RecordFormat] = {}
    rest = b""
    while chunk := file.read(CHUNK_BYTES):
        data = rest + chunk
        place = data.find(head)
        while 0 <= place <= len(data) - FORMAT_BYTES:
            described = RecordFormat.described_by(data[place : place + FORMAT_BYTES])
            if described is not None:
                formats.setdefault(described.type, described)
            place = data.find(head, place + 1)
        rest = data[-(FORMAT_BYTES - 1) :]
    return formats


def read_records(
    file: BinaryIO,
    formats: Formats,
    wanted: Collection[str],
    damage: DamageReport,
    chunk_bytes: int = CHUNK_BYTES,
) -> Iterator[list[Records]]:
    """The log's records, part by part, in its order.

    Args:
        file: read from where it stands, which is offset 0.
        formats: of the log's types.
        wanted: names of the types that are given out.
        damage: told what is no record, and how many there are in all.
        chunk_bytes: size of a part.

    Returns:
        For each part the records of each wanted type.
    """
    scanner = RecordScanner(formats, wanted, damage)
    while chunk := file.read(chunk_bytes):
        damage.bytes_read += len(chunk)
        yield scanner.feed(chunk)
    yield scanner.finish()


class RecordScanner:
    """Bytes of a log in, records out; the arguments are those of `read_records`."""

    def __init__(self, formats: Formats, wanted: Collection[str], damage: DamageReport) -> None:
        self._lengths = np.zeros(256, dtype=np.int64)  # by type; 0: not known
        for number, one in formats.items():
            self._lengths[number] = one.length
        self._lengths[FORMAT_TYPE] = FORMAT_BYTES
        self._wanted = [one for one in formats.values() if one.name in wanted]
        self._damage = damage
        self._data = b""
        self._offset = 0  # of `_data` in the log
        self._taken = 0  # where the last record ended

    def feed(self, chunk: bytes) -> list[Records]:
        """Takes the next bytes."""
        self._data += chunk
        return self._scan(last=False)

    def finish(self) -> list[Records]:
        """There are no more."""
        size = self._offset + len(self._data)
        records = self._scan(last=True)
        self._lose(size)
        return records

    def _scan(self, last: bool) -> list[Records]:
        data = np.frombuffer(self._data, dtype=np.uint8)
        # farther on, the head behind a record may not have been read yet
        limit = len(data) if last else max(len(data) - LENGTH_MAX - HEAD_BYTES, 0)
        start, end = self._candidates(data, limit, last)
        chosen = self._chain(start, end)
        records = self._records(data, start[chosen])
        self._damage.records += int(chosen.sum())
        done = max(limit, self._taken - self._offset)
        self._data, self._offset = self._data[done:], self._offset + done
        return records

    def _candidates(self, data: Bytes, limit: int, last: bool) -> tuple[IndexArray, IndexArray]:
        """Where records may begin, before `limit`, and end: with another head behind them, or the end of the log."""
        is_head: Mask = np.zeros(len(data) + 1, dtype=np.bool_)
        if len(data) >= HEAD_BYTES:
            is_head[:-HEAD_BYTES] = (data[:-2] == HEAD[0]) & (data[1:-1] == HEAD[1])
        start = np.flatnonzero(is_head[:limit])
        is_head[len(data)] = last
        length = self._lengths[data[start + 2]]
        end = start + length
        known = (length > 0) & (end <= len(data))
        start, end = start[known], end[known]
        followed = is_head[end]
        return start[followed], end[followed]

    def _chain(self, start: IndexArray, end: IndexArray) -> Mask:
        """Which candidates are records: each the first that does not begin before the end of the one before."""
        chosen: Mask = np.zeros(len(start), dtype=np.bool_)
        # the last of each row of candidates that stand one behind the other
        rows = np.append(np.flatnonzero(start[1:] != end[:-1]), len(start) - 1)
        at = int(np.searchsorted(start, self._taken - self._offset))
        while at < len(start):
            self._lose(self._offset + int(start[at]))
            row_end = int(rows[np.searchsorted(rows, at)])
            chosen[at : row_end + 1] = True
            self._taken = self._offset + int(end[row_end])
            at = int(np.searchsorted(start, end[row_end]))
        return chosen

    def _records(self, data: Bytes, start: IndexArray) -> list[Records]:
        kinds = data[start + 2]
        found = []
        for one in self._wanted:
            places = start[kinds == one.type]
            if len(places):
                raw = data[places[:, np.newaxis] + np.arange(one.length)]
                found.append(Records(one, places + self._offset, raw.view(one.dtype)[:, 0]))
        return found

    def _lose(self, offset: int) -> None:
        """What lies between the last record and `offset` is damage."""
        if offset > self._taken:
            self._damage.add("bytes that are no record", f"offset {self._taken}", offset - self._taken)
