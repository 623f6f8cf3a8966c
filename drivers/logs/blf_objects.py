"""The framing of Vector's binary logs: objects one behind the other, found again after damage.

Source: the format has no public specification; this is how python-can writes and Vector's tools and Vector_BLF lay it
out. Each object begins with "LOBJ", its header size, header version, size and type, and up to 3 bytes of padding
follow. Containers are such objects in the file; unpacked and joined, they hold objects again, which may begin in one
container and end in the next.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterator
from struct import Struct
from typing import NamedTuple

from drivers.logs.damage import DamagedRecordError, DamageReport

SIGNATURE = b"LOBJ"
CONTAINER = 10
OBJECT_BYTES_MAX = 8 << 20  # containers are 128 KiB unpacked, unless somebody chose otherwise
_PADDING_MAX = 3
_HEADER = Struct("<4sHHLL")
_CONTAINER = Struct("<H6xL4x")  # compression, unpacked size
_STORED, _DEFLATED = 0, 2


class LogObject(NamedTuple):
    """One object. (A tuple, for there are many.)

    Attributes:
        place: where it is, in words.
        kind: its type.
        header_version: of the part of the header that depends on the type.
        data: all bytes of the object, from its signature on.
        whole: False if its end is missing.
    """

    place: str
    kind: int
    header_version: int
    data: bytes
    whole: bool = True


class ObjectScanner:
    """Cuts a stream of bytes into objects.

    Args:
        damage: told what lies between objects.
        offset: of the first byte in the file.
    """

    def __init__(self, damage: DamageReport, offset: int = 0) -> None:
        self._damage = damage
        self._rest = b""
        self._offset = offset

    def feed(self, data: bytes, within: str = "") -> Iterator[LogObject]:
        """The objects that these bytes complete.

        Args:
            data: the next bytes of the stream.
            within: what part of the file they come from, if not from the file itself.
        """
        buffer = self._rest + data
        begin = 0
        while (found := buffer.find(SIGNATURE, begin)) >= 0 and found + _HEADER.size <= len(buffer):
            self._skipped(found - begin, begin, within)
            _, header_size, version, size, kind = _HEADER.unpack_from(buffer, found)
            end = found + size
            if not _HEADER.size <= header_size <= size <= OBJECT_BYTES_MAX or _takes_in_others(buffer, found, end):
                self._damage.add("header of an object damaged", self._place(found, within))
                begin = found + len(SIGNATURE)
                continue
            begin = found
            if end > len(buffer):
                break
            begin = end
            yield LogObject(self._place(found, within), kind, version, buffer[found:end])
        self._keep(buffer, begin, within)

    def finish(self) -> Iterator[LogObject]:
        """The objects in what is left, now that nothing more belongs to it; the last may have no end."""
        while self._rest.startswith(SIGNATURE) and len(self._rest) >= _HEADER.size:
            rest, self._rest = self._rest, b""
            following = rest.find(SIGNATURE, len(SIGNATURE))
            if following < 0:
                _, _, version, _, kind = _HEADER.unpack_from(rest)
                yield LogObject(self._place(0, ""), kind, version, rest, whole=False)
                return
            self._damage.add("header of an object damaged", self._place(0, ""))
            self._offset += following
            yield from self.feed(rest[following:])

    def _keep(self, buffer: bytes, begin: int, within: str) -> None:
        """Keeps what may be the beginning of an object."""
        found = buffer.find(SIGNATURE, begin)
        keep = found if found >= 0 else max(begin, len(buffer) - len(SIGNATURE) + 1)
        self._skipped(keep - begin, begin, within)
        self._rest = buffer[keep:]
        self._offset += keep

    def _skipped(self, count: int, begin: int, within: str) -> None:
        if count > _PADDING_MAX:
            self._damage.add("bytes that are no object", self._place(begin, within))

    def _place(self, index: int, within: str) -> str:
        return within or f"offset {self._offset + index}"


def _takes_in_others(buffer: bytes, begin: int, end: int) -> bool:
    """True if an object would reach to where no other begins, over some that do: its size is not to be believed."""
    followed = buffer.find(SIGNATURE, end, end + _PADDING_MAX + len(SIGNATURE)) >= 0
    known = end + _PADDING_MAX + len(SIGNATURE) <= len(buffer)
    return known and not followed and buffer.find(SIGNATURE, begin + len(SIGNATURE), end) >= 0


def unpacked(container: LogObject) -> bytes:
    """Content of a container; of one without end, as much of it as there is.

    Raises:
        DamagedRecordError: it cannot be unpacked, or is not what was packed.
    """
    if len(container.data) < _HEADER.size + _CONTAINER.size:
        raise DamagedRecordError("container too short")
    method, size = _CONTAINER.unpack_from(container.data, _HEADER.size)
    packed = container.data[_HEADER.size + _CONTAINER.size :]
    if method == _STORED:
        return packed
    if method != _DEFLATED or size > OBJECT_BYTES_MAX:
        raise DamagedRecordError("header of a container damaged")
    inflater = zlib.decompressobj()
    try:
        content = inflater.decompress(packed, OBJECT_BYTES_MAX)
    except zlib.error as error:
        raise DamagedRecordError("container damaged") from error
    if container.whole and not inflater.eof:
        raise DamagedRecordError("container damaged")
    return content
