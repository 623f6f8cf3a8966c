"""A PX4 log cut into short logs that are whole: what is damaged left out, what is not wanted too.

Each is a ULog file of its own, with the formats and announcements that its data need, for pyulog reads files as a
whole and takes what it sees in damaged ones for granted. A message is taken where another one begins at its end, or
where the log ends there, or where what is appended to it begins.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from typing import BinaryIO

from drivers.logs.damage import DamageReport
from drivers.logs.ulog_format import (
    ADD,
    DATA,
    FILE_HEADER_BYTES,
    FLAGS,
    FORMAT,
    HEAD,
    KINDS,
    MAGIC,
    NUMBER_BYTES,
    TIME_BYTES,
    VERSION,
    Topics,
    is_message,
    message,
)

CHUNK_BYTES = 1 << 20
MESSAGE_MAX = HEAD.size + 0xFFFF
APPENDED = 0x01  # the incompatible flag that is known
_KIND = re.compile(b"[" + re.escape(KINDS) + b"]")


class UnreadableLogError(ValueError):
    """The log itself says that one must know more to read it."""


class SegmentReader:
    """A log in parts.

    Args:
        wanted: names of the topics that are given out.
        damage: told what is no message, and how many there are in all.
        chunk_bytes: of the log, that each part is made of.

    """

    def __init__(self, wanted: Collection[str], damage: DamageReport, chunk_bytes: int = CHUNK_BYTES) -> None:
        self._numbers: set[int] = set()
        self._wanted = wanted
        self._damage = damage
        self._chunk_bytes = chunk_bytes
        self._topics = Topics()
        self._announced: dict[int, bytes] = {}  # messages A of wanted topics
        self._appended: tuple[int, ...] = ()
        self._header = b""
        self._data = b""
        self._offset = FILE_HEADER_BYTES  # of `_data` in the log
        self._taken = self._offset  # where the last message ended

    def segments(self, file: BinaryIO) -> Iterator[bytes]:
        """Reads a log from its beginning.

        Returns:
            A ULog file for each part; parts without anything wanted are left out.

        Raises:
            UnreadableLogError: see there.
        """
        header = file.read(FILE_HEADER_BYTES)
        # flags tell what is new in a log, and not its version, which pyulog prints a warning of
        self._header = MAGIC + bytes([VERSION]) + header[len(MAGIC) + 1 :].ljust(TIME_BYTES, b"\0")
        while chunk := file.read(self._chunk_bytes):
            yield from self._feed(chunk, last=False)
        yield from self._feed(b"", last=True)

    def names(self) -> set[str]:
        """Of the topics that had data so far, wanted or not."""
        return {name for number, name in self._topics.names.items() if number in self._numbers}

    def _feed(self, chunk: bytes, last: bool) -> Iterator[bytes]:
        self._data += chunk
        # farther on, messages may not be there with all of them, and of the next one
        limit = len(self._data) if last else max(len(self._data) - 2 * MESSAGE_MAX, 0)
        body = b"".join(self._whole(limit, last))
        done = max(self._taken - self._offset, limit)
        self._data, self._offset = self._data[done:], self._offset + done
        if last:
            self._lose(self._offset)
        if body:
            yield self._preamble() + body

    def _whole(self, limit: int, last: bool) -> Iterator[bytes]:
        """Messages with wanted data that begin before `limit`."""
        # the beginning of long damage may be gone already
        begin = max(self._taken - self._offset, 0)
        at: int | None = begin
        end = self._end(begin)
        while at is not None and at < limit:
            following = None if end is None else self._end(end)
            if end is None or (following is None and not self._may_end(end, last)):
                at = self._next_kind(at)
                end = None if at is None else self._end(at)
                continue
            self._lose(self._offset + at)
            self._taken = self._offset + end
            self._damage.records += 1
            kind = self._data[at + 2]
            if kind == DATA:
                if self._is_wanted(at):
                    yield self._data[at:end]
            else:
                self._take(kind, self._data[at + HEAD.size : end], first=self._offset + at == FILE_HEADER_BYTES)
                following = self._end(end)  # what was announced is known more exactly now
            at, end = end, following

    def _end(self, at: int) -> int | None:
        """Where the message ends that begins here; None: it cannot be one."""
        data = self._data
        if at + HEAD.size > len(data):
            return None
        size, kind = HEAD.unpack_from(data, at)
        end: int = at + HEAD.size + size
        if end > len(data):
            return None
        if kind == DATA and size >= NUMBER_BYTES:
            return end if self._topics.fits_data(_number(data, at + HEAD.size), size) else None
        return end if is_message(kind, data[at + HEAD.size : end]) else None

    def _may_end(self, at: int, last: bool) -> bool:
        """Whether nothing need follow here."""
        return (last and at == len(self._data)) or self._offset + at in self._appended

    def _next_kind(self, at: int) -> int | None:
        """The next place where a letter of a kind stands where it belongs."""
        found = _KIND.search(self._data, at + HEAD.size)
        return None if found is None else found.start() - HEAD.size + 1

    def _is_wanted(self, at: int) -> bool:
        number = _number(self._data, at + HEAD.size)
        self._numbers.add(number)
        return number in self._announced

    def _take(self, kind: int, body: bytes, first: bool) -> None:
        if kind == FLAGS and first:  # anywhere else it is none
            self._flags(body)
        elif kind == FORMAT:
            self._topics.describe(body)
        elif kind == ADD:
            number = self._topics.announce(body)
            if number is not None and self._topics.names[number] in self._wanted:
                self._announced[number] = message(ADD, body)

    def _flags(self, body: bytes) -> None:
        if body[8] & ~APPENDED or any(body[9:16]):
            flags = body[8:16].hex()
            raise UnreadableLogError(f"this log must be read as nobody here knows how: incompatible flags {flags}")
        self._appended = tuple(int.from_bytes(body[at : at + 8], "little") for at in (16, 24, 32))

    def _preamble(self) -> bytes:
        names = [self._topics.names[number] for number in self._announced]
        formats = dict.fromkeys(inner for name in names for inner in self._topics.nested(name))
        described = [message(FORMAT, self._topics.formats[name]) for name in formats]
        return b"".join((self._header, *described, *self._announced.values()))

    def _lose(self, offset: int) -> None:
        """What lies between the last message and `offset` is damage."""
        if offset > self._taken:
            self._damage.add("bytes that are no message", f"offset {self._taken}", offset - self._taken)


def _number(data: bytes, at: int) -> int:
    return data[at] | data[at + 1] << 8
