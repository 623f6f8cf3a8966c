"""The folder of the recordings: names of their files, and how much of the disk they may take."""

from __future__ import annotations

import errno
import fcntl
import re
import shutil
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import BinaryIO

_NAME = re.compile(r"[a-z0-9-]+_(\d{8}_\d{6})_(\d{3,})\.mcap")
_NO_WORD = re.compile(r"[^a-z0-9]+")
_SLUG_MAX = 40
MB = 1e6


class NoRoomError(OSError):
    """There is less of the disk free than is to be left free."""


def is_full(error: OSError) -> bool:
    """Whether there is no room on the disk."""
    return isinstance(error, NoRoomError) or error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)


@dataclass(frozen=True, slots=True)
class RecordingFile:
    """A file of ours. `began`: when its run began, as in the name; `part`: of that run."""

    began: str
    part: int
    path: Path
    size: int


def file_name(vehicle: str, started_s: float, part: int) -> str:
    """Name of a part: vehicle, UTC date and time at which its run began, and number."""
    slug = _NO_WORD.sub("-", vehicle.lower())[:_SLUG_MAX].strip("-") or "vehicle"
    return f"{slug}_{datetime.fromtimestamp(started_s, UTC):%Y%m%d_%H%M%S}_{part:03}.mcap"


def recordings(folder: Path) -> list[RecordingFile]:
    """The recordings in a folder, by their names, the oldest first.

    Raises:
        OSError: the folder cannot be read.
    """
    found = []
    for path in folder.iterdir():
        match = _NAME.fullmatch(path.name)
        with suppress(FileNotFoundError):  # deleted just now
            if match and path.is_file():
                found.append(RecordingFile(match[1], int(match[2]), path, path.stat().st_size))
    return sorted(found, key=lambda one: (one.began, one.part, one.path.name))


def make_room(folder: Path, budget: float) -> list[Path]:
    """Deletes the oldest recordings until all of them together have `budget` bytes at most; returns which.

    One that is being written stays, and so does one that cannot be deleted, or may not be written.

    Raises:
        OSError: the folder cannot be read.
    """
    found = recordings(folder)
    excess = sum(one.size for one in found) - budget
    deleted = []
    for one in found:
        if excess <= 0.0:
            break
        with suppress(OSError), idle(one.path) as file:
            if file is not None:
                one.path.unlink()
                deleted.append(one.path)
                excess -= one.size
    return deleted


def check_free(folder: Path, keep_free: float) -> None:
    """Looks whether so many bytes of the disk are free.

    Raises:
        NoRoomError: they are not.
        OSError: nobody knows.
    """
    free = shutil.disk_usage(folder).free
    if free < keep_free:
        raise NoRoomError(f"{free / MB:.0f} MB of the disk are free, {keep_free / MB:.0f} MB are to be left free")


@contextmanager
def idle(path: Path) -> Iterator[BinaryIO | None]:
    """The file, to be changed by nobody else meanwhile; None where someone writes it just now.

    Raises:
        OSError: it cannot be opened.
    """
    with path.open("r+b") as file:
        yield file if lock(file) else None


def lock(file: BinaryIO) -> bool:
    """Keeps all others from `idle`, until it is closed; False where someone else does so already.

    Some file systems know no locks: there, all think that nobody else is there.
    """
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        return True
    return True
