"""One file of a recording, while it is written: chunk after chunk, each on the disk before the next."""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from mcap.data_stream import RecordBuilder
from mcap.records import AttachmentIndex, Header, MetadataIndex
from mcap.writer import MCAP0_MAGIC

from gateway.recording.about import attachments, library, metadata
from gateway.recording.channel_table import ChannelTable
from gateway.recording.chunk import chunk_of
from gateway.recording.encoding import encode
from gateway.recording.entries import About
from gateway.recording.folder import lock
from gateway.recording.items import Item
from gateway.recording.record_bytes import bytes_of
from gateway.recording.summary import Summary

# after so many chunks, schemas are written again: what is lost of a file takes little else with it
AGAIN_CHUNKS = 20


class PartFile:
    """Makes a new file, and writes down what the recording says of itself.

    Args:
        path: not there yet.
        about: of this part of the recording.
        place: of what was recorded last before it.

    Attributes:
        path: its own.
        size: bytes so far, all of them whole records.
        inode: by which it is known, wherever it is moved to.

    Raises:
        OSError: it cannot be written.
    """

    def __init__(self, path: Path, about: About, place: int) -> None:
        self.path, self.size = path, 0
        self._table = ChannelTable()
        self._summary = Summary(self._table.schemas, self._table.channels)
        self._file = path.open("xb", buffering=0)
        try:
            lock(self._file)  # nobody deletes or mends it meanwhile
            self.inode = os.fstat(self._file.fileno()).st_ino
            self._begin(about, place)
            _keep_name(path)
        except OSError:
            self.abandon()
            with suppress(OSError):
                path.unlink()  # the next try makes another
            raise

    def write(self, items: Sequence[Item]) -> None:
        """Writes a chunk, and comes back when it is on the disk.

        Raises:
            OSError: it is not. The file then ends with the chunk before.
        """
        blocks = encode(items, self._table)
        if not blocks:
            return
        again = len(self._summary.chunks) % AGAIN_CHUNKS == 0
        preamble = self._table.records({block.channel for block in blocks}, again=again)
        chunk = chunk_of(preamble, blocks, self.size)
        self._append(chunk.data)
        self._summary.add_chunk(chunk.index, chunk.messages)

    def finish(self) -> None:
        """Writes the end, and closes the file.

        Raises:
            OSError: the end cannot be written; the file is closed without it.
        """
        try:
            self._append(self._summary.records(self.size))
        finally:
            self._file.close()

    def abandon(self) -> None:
        """Closes the file without an end."""
        with suppress(OSError):
            self._file.close()

    def _begin(self, about: About, place: int) -> None:
        builder = RecordBuilder()
        builder.write(MCAP0_MAGIC)
        Header("", library(about)).write(builder)
        said = metadata(about, place)
        begin = builder.count
        said.write(builder)
        self._summary.metadata.append(MetadataIndex(begin, builder.count - begin, said.name))
        for one in attachments(about):
            begin = builder.count
            one.write(builder)
            self._summary.attachments.append(
                AttachmentIndex(
                    begin,
                    builder.count - begin,
                    one.log_time,
                    one.create_time,
                    len(one.data),
                    one.name,
                    one.media_type,
                )
            )
        self._append(bytes_of(builder))

    def _append(self, data: bytes) -> None:
        """All of it, or nothing."""
        rest = memoryview(data)
        try:
            while rest:
                rest = rest[self._file.write(rest) :]
            os.fdatasync(self._file.fileno())
        except OSError:
            with suppress(OSError):
                os.ftruncate(self._file.fileno(), self.size)
                os.lseek(self._file.fileno(), self.size, os.SEEK_SET)
            raise
        self.size += len(data)


def _keep_name(path: Path) -> None:
    """Has the name of a new file on the disk, too, where the file system does that for folders."""
    folder = os.open(path.parent, os.O_RDONLY | os.O_DIRECTORY)
    try:
        with suppress(OSError):
            os.fsync(folder)
    finally:
        os.close(folder)
