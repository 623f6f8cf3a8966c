"""The control socket: this machine's operator asks how it is, and says what he wants.

Whoever may open it may speak: it is its owner's alone from its first moment on.
"""

from __future__ import annotations

import asyncio
import logging
import os
import socket
import stat
from collections import Counter
from collections.abc import Awaitable, Callable
from contextlib import suppress
from pathlib import Path

from gateway.control.protocol import LINE_MAX, Answer, Request
from gateway.control.unix_address import unix_address

log = logging.getLogger("gateway")

# one that asks nothing for so long is gone
IDLE_S = 10.0
PROBE_S = 1.0


class SocketTakenError(OSError):
    """Another gateway answers at this socket, or something else lies in its place."""


class ControlSocket:
    """Takes requests, and gives the answers back.

    Args:
        path: where the socket is made.
        answer: what the gateway answers to a request.

    Attributes:
        drops: what was no request, by cause.
    """

    def __init__(self, path: Path, answer: Callable[[Request], Awaitable[Answer]]) -> None:
        self._path, self._answer = path, answer
        self._socket: socket.socket | None = None
        self._server: asyncio.Server | None = None
        self._identity: tuple[int, int] | None = None
        self._writers: set[asyncio.StreamWriter] = set()
        self.drops: Counter[str] = Counter()

    def open(self) -> None:
        """Makes the socket; without one, where it cannot be made, there is a watch all the same.

        Raises:
            SocketTakenError: another gateway has it.
        """
        try:
            self._socket = _bound(self._path)
            found = self._path.lstat()
        except SocketTakenError:
            raise
        except OSError as error:
            log.warning("no control socket at %s, `gateway tell` does not work: %s", self._path, error)
        else:
            self._identity = found.st_dev, found.st_ino

    async def serve(self) -> None:
        """Answers until it is cancelled."""
        if self._socket is None:
            return
        async with asyncio.TaskGroup() as talks:

            def talk(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
                self._writers.add(writer)
                talks.create_task(self._talk(reader, writer), name="control talk")

            # known before it serves: from its first moment on, `close` may come at any time
            self._server = await asyncio.start_unix_server(
                talk, sock=self._socket, limit=LINE_MAX, start_serving=False
            )
            try:
                await self._server.serve_forever()
            finally:
                self._server.close()
                for writer in tuple(self._writers):  # a talk that is cancelled before it begins closes nothing
                    writer.close()

    def close(self) -> None:
        """Removes the socket, if it is still ours."""
        listening, self._socket = self._socket, None
        if listening is None:
            return
        if self._server is None:
            listening.close()
        else:
            self._server.close()
        with suppress(OSError):
            found = self._path.lstat()
            if (found.st_dev, found.st_ino) == self._identity:
                self._path.unlink()

    async def _talk(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            while line := await self._line(reader):
                answer = await self._answered(line)
                writer.write(answer.line())
                await writer.drain()
        except ConnectionError:
            self.drops["connection lost"] += 1
        finally:
            self._writers.discard(writer)
            writer.close()
            with suppress(OSError, asyncio.CancelledError):
                await writer.wait_closed()

    async def _line(self, reader: asyncio.StreamReader) -> bytes:
        """What is asked next; empty where nothing comes any more, or no end of it."""
        try:
            async with asyncio.timeout(IDLE_S):
                return await reader.readline()
        except TimeoutError:
            self.drops["silent"] += 1
        except ValueError:
            self.drops["line too long"] += 1
        return b""

    async def _answered(self, line: bytes) -> Answer:
        try:
            request = Request.parse(line)
        except ValueError as error:
            self.drops["no request"] += 1
            return Answer(False, (str(error),))
        return await self._answer(request)


def _bound(path: Path) -> socket.socket:
    """A socket that listens there.

    Raises:
        SocketTakenError, OSError: see `ControlSocket.open`.
    """
    listening = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    try:
        os.fchmod(listening.fileno(), stat.S_IRUSR | stat.S_IWUSR)  # Linux makes the file with these rights
        with unix_address(path) as address:
            _remove_stale(path, address)
            listening.bind(address)
        listening.listen()
    except BaseException:
        listening.close()
        raise
    return listening


def _remove_stale(path: Path, address: str) -> None:
    """Clears the place of what a gateway has left that ended in no order."""
    try:
        mode = path.lstat().st_mode
    except FileNotFoundError:
        return
    if not stat.S_ISSOCK(mode):
        raise SocketTakenError(f"{path} is no socket: name another place as files.control")
    if _listened_at(address):
        raise SocketTakenError(f"another gateway runs with this configuration, and listens at {path}: stop it first")
    path.unlink()


def _listened_at(address: str) -> bool:
    """Whether a living process is on the other end of a socket that is there."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as probe:
        probe.settimeout(PROBE_S)
        try:
            probe.connect(address)
        except ConnectionRefusedError:
            return False
        except TimeoutError:
            return True
        return True


def is_running(path: Path) -> bool:
    """Whether a gateway listens at a control socket; False, too, where this user may not ask."""
    try:
        with unix_address(path) as address:
            return stat.S_ISSOCK(path.lstat().st_mode) and _listened_at(address)
    except OSError:
        return False
