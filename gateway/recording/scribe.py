"""Writes a recording file after file. Whatever the disk says against it is raised as OSError."""

from __future__ import annotations

import errno
import logging
from collections.abc import Callable, Sequence
from dataclasses import replace
from math import ceil
from pathlib import Path

from gateway.config_sections import Recording
from gateway.recording.entries import About
from gateway.recording.folder import MB, check_free, file_name, make_room
from gateway.recording.items import Item, first_place
from gateway.recording.part_file import PartFile

log = logging.getLogger("gateway")

# where the budget is small, it holds several files all the same: of one alone nothing would be left when it is full
FILES_MIN = 4
# of a file, for what had been learnt before: more would leave little room for the rest
STATE_SHARE = 0.5


class Scribe:
    """See the module's text.

    Args:
        settings: where to, and how much.
        about: of the first file.
        now: the time, unix seconds.

    Attributes:
        path: of the newest file; None before the first.
    """

    def __init__(self, settings: Recording, about: About, now: Callable[[], float]) -> None:
        self._settings, self._about, self._now = settings, about, now
        self._file_max = min(settings.file_max_mb, settings.budget_mb / FILES_MIN) * MB
        self._file: PartFile | None = None
        self._begun_s = 0.0
        self._largest = self._bytes_before = 0
        self._parts = self._number = about.part - 1
        self._told_large = False
        self.path: Path | None = None

    @property
    def bytes_written(self) -> int:
        """In all files so far."""
        return self._bytes_before + (0 if self._file is None else self._file.size)

    def begin(self, state: bytes, resumed: bool) -> None:
        """What an earlier run has left, see `About`; before anything is written."""
        self._about = replace(self._about, state=self._fitting(state), resumed=resumed)

    def remember(self, state: bytes) -> None:
        """What has been learnt by now: the next file begins with it, and goes on from there."""
        self._about = replace(self._about, state=self._fitting(state), resumed=True)

    def write(self, items: Sequence[Item]) -> None:
        """Writes items down, and comes back when they are on the disk.

        Raises:
            OSError: they are not; what was written before is.
        """
        try:
            check_free(self._folder, self._settings.keep_free_mb * MB)
            file = self._file_for(items)
            before = file.size
            file.write(items)
            self._largest = max(self._largest, file.size - before)
        except OSError:
            self._abandon()
            raise

    def close(self) -> None:
        """Ends the newest file.

        Raises:
            OSError: it has no end now.
        """
        file, self._file = self._file, None
        if file is not None:
            self._bytes_before += file.size
            file.finish()

    def _fitting(self, state: bytes) -> bytes:
        """Nothing where it is too large for the files: one would follow the other, with nothing else in them."""
        wanted = len(state) / STATE_SHARE
        if wanted <= self._file_max:
            return state
        if not self._told_large:
            self._told_large = True
            least_mb = ceil(wanted / MB)
            log.warning(
                "recordings are too small for what has been learnt (%.1f MB), so that a replay learns anew: set "
                "recording.file_max_mb = %d and recording.budget_mb = %d, or more",
                len(state) / MB,
                least_mb,
                FILES_MIN * least_mb,
            )
        return b""

    @property
    def _folder(self) -> Path:
        """It is made where it is not there."""
        self._settings.folder.mkdir(exist_ok=True)
        return self._settings.folder

    def _file_for(self, items: Sequence[Item]) -> PartFile:
        if self._file is not None and not _is_there(self._file):
            raise FileNotFoundError(errno.ENOENT, "it was deleted or moved away", str(self._file.path))
        if self._file is not None and self._is_full(self._file):
            self.close()
        if self._file is None:
            self._file = self._begun(items)
        return self._file

    def _is_full(self, file: PartFile) -> bool:
        old_s = self._now() - self._begun_s
        return file.size + self._largest > self._file_max or old_s >= 60.0 * self._settings.file_max_minutes

    def _begun(self, items: Sequence[Item]) -> PartFile:
        for path in make_room(self._folder, self._settings.budget_mb * MB - self._file_max):
            log.info("recording %s is deleted: all may take %g MB", path.name, self._settings.budget_mb)
        number = self._number + 1
        while (path := self._path(number)).exists():  # of another run that began in the same second
            number += 1
        part = self._parts + 1
        file = PartFile(path, replace(self._about, part=part), first_place(items) - 1)
        self.path, self._parts, self._number, self._begun_s = path, part, number, self._now()
        return file

    def _path(self, number: int) -> Path:
        return self._folder / file_name(self._about.vehicle, self._about.started_s, number)

    def _abandon(self) -> None:
        file, self._file = self._file, None
        if file is not None:
            self._bytes_before += file.size
            file.abandon()


def _is_there(file: PartFile) -> bool:
    try:
        return file.path.stat().st_ino == file.inode
    except OSError:
        return False
