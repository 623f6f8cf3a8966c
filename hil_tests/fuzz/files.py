"""Inputs as files: readers of logs take a path."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from types import ModuleType

MEMORY = Path("/dev/shm")  # noqa: S108 - thousands of small files: a disk would be slower than what is tested
RECORDINGS = Path(__file__).parents[3] / "shared" / "data" / "ardusub_logs"
HEAD_BYTES = 6000


@contextmanager
def as_file(data: bytes, name: str) -> Iterator[Path]:
    """A file of these bytes, for as long as it is read."""
    with TemporaryDirectory(dir=MEMORY if os.access(MEMORY, os.W_OK) else None) as folder:
        path = Path(folder) / name
        path.write_bytes(data)
        yield path


def written(name: str, write: Callable[[Path], None]) -> bytes:
    """What somebody writes into a file of that name."""
    with as_file(b"", name) as path:
        write(path)
        return path.read_bytes()


@contextmanager
def pieces_of(module: ModuleType, name: str, size: int) -> Iterator[None]:
    """A reader takes pieces of this size, not of the megabyte that no input here fills.

    Args:
        module: of the reader.
        name: of its constant.
        size: in bytes.
    """
    usual = getattr(module, name)
    setattr(module, name, size)
    try:
        yield
    finally:
        setattr(module, name, usual)


def recorded(name: str) -> list[bytes]:
    """The head of a recording that may lie beside the project; nothing where it does not."""
    path = RECORDINGS / name
    if not path.exists():
        return []
    with path.open("rb") as stream:
        return [stream.read(HEAD_BYTES)]
