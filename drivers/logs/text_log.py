"""Logs that are text, in chunks of whole lines: bounded memory, gzip or not, whatever else has got into the file.

A log ends each line that it writes. What follows the last line end was cut off, by power loss or by a full disk, and
where is not to be seen: it is not read, for a frame that lost its last bytes looks like a shorter frame.
"""

from __future__ import annotations

import gzip
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from io import BufferedReader
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from drivers.logs.damage import DamagedRecordError, DamageReport
from drivers.logs.kinds import HEAD_BYTES, looks_like

CHUNK_BYTES = 1 << 20  # about 20,000 lines: what is made of them stays in the processor's cache
LINE_BYTES_MAX = 64 << 10  # no format has longer ones; zeros after power loss may be many megabytes
HEAD_TEXT_BYTES = 64 << 10
_HEAD_SEARCH_BYTES = 1 << 20  # a log may begin with the zeros of a disk that lost power
_GZIP = b"\x1f\x8b"
_BYTE_ORDER_MARK = b"\xef\xbb\xbf"
_UTF16 = (b"\xff\xfe", b"\xfe\xff")


@dataclass(frozen=True, slots=True)
class TextChunk:
    """Whole lines of a text.

    Attributes:
        first_line: number of the first of them in the file, from 1.
        text: behind the last of them there may be the beginning of the next.
        starts, ends: (lines,) where each line begins in the text, and where its line end is.
    """

    first_line: int
    text: bytes
    starts: NDArray[np.intp]
    ends: NDArray[np.intp]

    def line(self, row: int) -> bytes:
        """A line without its end."""
        return self.text[self.starts[row] : self.ends[row]]

    def lines(self) -> Iterator[tuple[int, bytes]]:
        """Each line with its number."""
        return enumerate(self.text[: self.ends[-1]].split(b"\n"), self.first_line)


def head_of_text(path: Path) -> bytes:
    """The beginning of a log, unpacked, without byte order mark and leading zeros; empty if there is nothing else.

    Raises:
        OSError: the file cannot be read.
    """
    with _opened(path) as stream:
        head = next(_pieces(stream, _HEAD_SEARCH_BYTES, DamageReport()), b"")
    return head.lstrip(b"\0")[:HEAD_TEXT_BYTES]


def check_kind(path: Path, wanted: str, is_wanted: Callable[[bytes], bool]) -> None:
    """Refuses a file whose beginning is of another kind; one that is empty, or of zeros, is of any.

    Raises:
        OSError: the file cannot be read.
        ValueError: it is of another kind.
    """
    head = head_of_text(path)
    if head.strip() and not is_wanted(head):
        raise not_a_log(path, wanted)


def not_a_log(path: Path, wanted: str) -> ValueError:
    """What to raise for a file that is of another kind."""
    with path.open("rb") as stream:
        head = stream.read(HEAD_BYTES)
    seen = "text in UTF-16: save it as UTF-8" if head.startswith(_UTF16) else looks_like(head)
    return ValueError(f"{path} is no {wanted}: it looks like {seen}")


def text_chunks(path: Path, damage: DamageReport) -> Iterator[TextChunk]:
    """The file's lines; a last one without end is noted, and so is where a broken compression ends.

    Raises:
        OSError: the file cannot be read.
    """
    line = 1
    rest = b""
    with _opened(path) as stream:
        for piece in _pieces(stream, CHUNK_BYTES, damage):
            text = rest + piece
            ends = np.flatnonzero(np.frombuffer(text, dtype=np.uint8) == ord("\n"))
            if len(ends):
                yield TextChunk(line, text, np.concatenate(([0], ends[:-1] + 1)), ends)
                line += len(ends)
                text = text[ends[-1] + 1 :]
            # Of a line beyond all bounds the end is enough: it is damaged, but another may have begun within it.
            rest = text[-LINE_BYTES_MAX:]
    if rest:
        damage.add("last line cut off" if rest.strip(b"\0") else "zero bytes", f"line {line}")


def text_of(line: bytes) -> str:
    """A line as printable ASCII, blanks around it removed.

    Raises:
        DamagedRecordError: zeros or other bytes that are no text.
    """
    text = line.strip().decode("latin-1").replace("\t", " ")
    if text.isascii() and text.isprintable():
        return text
    raise DamagedRecordError("zero bytes" if "\0" in text else "bytes that are no text")


def _opened(path: Path) -> BufferedReader | gzip.GzipFile:
    with path.open("rb") as stream:
        packed = stream.read(len(_GZIP)) == _GZIP
    return gzip.open(path, "rb") if packed else path.open("rb")


def _packed(stream: BufferedReader | gzip.GzipFile) -> BinaryIO:
    """The file itself."""
    file: BinaryIO = stream.fileobj if isinstance(stream, gzip.GzipFile) else stream  # type: ignore[assignment]
    return file


def _pieces(stream: BufferedReader | gzip.GzipFile, size: int, damage: DamageReport) -> Iterator[bytes]:
    """The file in pieces of this size or a little more, to its end or to where its compression is broken."""
    parts: list[bytes] = []
    missing = size
    for part in _parts(stream, size, damage):
        parts.append(part)
        missing -= len(part)
        if missing <= 0:
            yield b"".join(parts)
            parts, missing = [], size
    yield b"".join(parts)


def _parts(stream: BufferedReader | gzip.GzipFile, size: int, damage: DamageReport) -> Iterator[bytes]:
    """What comes at once, without byte order mark: what was unpacked before an error is not lost with it."""
    try:
        yield stream.read(len(_BYTE_ORDER_MARK)).removeprefix(_BYTE_ORDER_MARK)
        while part := stream.read1(size):
            damage.bytes_read = _packed(stream).tell()
            yield part
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        damage.add("compressed data damaged from here on", f"unpacked offset {stream.tell()} ({error})")
