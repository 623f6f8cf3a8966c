"""The address of a socket in the file system, however long its path is."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

# sockaddr_un.sun_path holds 108 bytes, of which the last is 0
PATH_MAX = 107


@contextmanager
def unix_address(path: Path) -> Iterator[str]:
    """An address to bind or connect to; a long path goes by way of its folder.

    Raises:
        OSError: there is no such folder.
    """
    if len(os.fsencode(path)) <= PATH_MAX:
        yield str(path)
        return
    folder = os.open(path.parent, os.O_PATH | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        yield f"/proc/self/fd/{folder}/{path.name}"
    finally:
        os.close(folder)
