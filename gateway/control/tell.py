"""The operator's end of the control socket, and what he reads."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import TracebackType
from typing import Self

from gateway.control.protocol import ANSWER_MAX, Answer, Request
from gateway.control.unix_address import unix_address
from gateway.severity import Severity
from gateway.telemetry import Said

# a gateway that is busy answers within ten seconds
PATIENCE_S = 15.0


class NoAnswerError(Exception):
    """There is no gateway, or it does not answer. The text says why, and what to do."""


class GoneError(NoAnswerError):
    """It has ended while it was asked, or has closed the connection before."""


class Conversation:
    """A connection to a running gateway: as many questions as are wanted, one after the other.

    Args:
        path: of its control socket.

    Raises:
        NoAnswerError: see there; `ask` raises it as well, and is of no use after that.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._answers = self._socket.makefile("rb")
        self._socket.settimeout(PATIENCE_S)
        try:
            with _explained(path), unix_address(path) as address:
                self._socket.connect(address)
        except NoAnswerError:
            self.close()
            raise

    def ask(self, request: Request) -> Answer:
        """Asks, and waits for the answer."""
        with _explained(self._path):
            self._socket.sendall(request.line())
            line = self._answers.readline(ANSWER_MAX)
        if len(line) == ANSWER_MAX:
            raise NoAnswerError(f"what listens at {self._path} is no gateway: its answer does not end")
        if not line.endswith(b"\n"):
            raise GoneError(f"the gateway at {self._path} has stopped before it answered")
        try:
            return Answer.parse(line)
        except ValueError as error:
            raise NoAnswerError(f"what listens at {self._path} is another version: {error}") from error

    def close(self) -> None:
        """Ends it."""
        self._answers.close()
        self._socket.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def ask(path: Path, request: Request) -> Answer:
    """Asks the gateway whose control socket this is.

    Raises:
        NoAnswerError: see there.
    """
    with Conversation(path) as conversation:
        return conversation.ask(request)


@contextmanager
def _explained(path: Path) -> Iterator[None]:
    """Says of what goes wrong with a socket what it means."""
    try:
        yield
    except (FileNotFoundError, ConnectionRefusedError) as error:
        raise NoAnswerError(f"no gateway runs with this configuration (nobody listens at {path})") from error
    except PermissionError as error:
        owner = _owner(path)
        raise NoAnswerError(f"{path} is its owner's alone: ask as that user (sudo -u {owner} ...)") from error
    except (BrokenPipeError, ConnectionResetError) as error:
        raise GoneError(f"the gateway at {path} has stopped before it answered") from error
    except TimeoutError as error:
        raise NoAnswerError(f"the gateway at {path} does not answer: see its log") from error
    except OSError as error:
        raise NoAnswerError(f"the gateway at {path} cannot be asked: {error}") from error


def _owner(path: Path) -> str:
    try:
        return path.owner()
    except (OSError, KeyError):
        return "its owner"


def lines(answer: Answer) -> Iterator[str]:
    """What the operator reads."""
    yield from answer.lines
    width = max(map(len, answer.levels), default=0)
    for subject, level in sorted(answer.levels.items(), key=lambda one: _rank(one[1]), reverse=True):
        yield f"{subject:{width}}  {level}"
    for said in answer.texts:
        yield f"{_ago(said)}  {_severity(said)}: {said.text}"


def _rank(level: str) -> int:
    ranks = ("UNKNOWN", "NORMAL", "SUSPECT", "FAULT")
    return ranks.index(level) if level in ranks else len(ranks)


def _ago(said: Said) -> str:
    return f"{said.age_s:.0f} s ago" if said.age_s < 120.0 else f"{said.age_s / 60.0:.0f} min ago"


def _severity(said: Said) -> str:
    try:
        return Severity(said.severity).name
    except ValueError:
        return str(said.severity)
