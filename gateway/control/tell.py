"""The operator's end of the control socket, and what he reads."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from pathlib import Path

from gateway.control.protocol import Answer, Request, Said
from gateway.control.unix_address import unix_address
from gateway.severity import Severity

# a gateway that is busy answers within ten seconds
PATIENCE_S = 15.0


class NoAnswerError(Exception):
    """There is no gateway, or it does not answer. The text says why, and what to do."""


def ask(path: Path, request: Request) -> Answer:
    """Asks the gateway whose control socket this is.

    Raises:
        NoAnswerError: see there.
    """
    try:
        line = _exchanged(path, request.line())
    except (FileNotFoundError, ConnectionRefusedError) as error:
        raise NoAnswerError(f"no gateway runs with this configuration (nobody listens at {path})") from error
    except PermissionError as error:
        owner = _owner(path)
        raise NoAnswerError(f"{path} is its owner's alone: ask as that user (sudo -u {owner} ...)") from error
    except TimeoutError as error:
        raise NoAnswerError(f"the gateway at {path} does not answer: see its log") from error
    except OSError as error:
        raise NoAnswerError(f"the gateway at {path} cannot be asked: {error}") from error
    if not line.endswith(b"\n"):
        raise NoAnswerError(f"the gateway at {path} has stopped before it answered")
    try:
        return Answer.parse(line)
    except ValueError as error:
        raise NoAnswerError(f"what listens at {path} is another version: {error}") from error


def _exchanged(path: Path, line: bytes) -> bytes:
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as channel:
        channel.settimeout(PATIENCE_S)
        with unix_address(path) as address:
            channel.connect(address)
        channel.sendall(line)
        with channel.makefile("rb") as answers:
            return answers.readline()


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
