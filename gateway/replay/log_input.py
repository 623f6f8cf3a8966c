"""Which log is of which kind, and which link of the configuration it speaks for."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path

from drivers.logs.kinds import HEAD_BYTES

DATAFLASH_MAGIC, ULOG_MAGIC, MCAP_MAGIC = b"\xa3\x95", b"ULog", b"\x89MCAP0\r\n"
MAVLINK_MAGICS = (0xFE, 0xFD)
STAMP_BYTES = 8
SUFFIXES = {".bin": "dataflash", ".ulg": "ulog", ".tlog": "tlog", ".mcap": "recording"}


class LogKind(StrEnum):
    """What a log is a log of."""

    CAN = "CAN"
    TLOG = "tlog"
    DATAFLASH = "dataflash"
    ULOG = "ulog"
    RECORDING = "recording"


@dataclass(frozen=True, slots=True)
class LogInput:
    """A log to replay.

    Attributes:
        path: the file.
        kind: what it is.
        link: the link that all of it is for, where the user said so.
    """

    path: Path
    kind: LogKind
    link: str | None = None


def log_input(text: str, links: Collection[str]) -> LogInput:
    """What the user named: a path, or `LINK=PATH`.

    Raises:
        OSError: the file cannot be read.
        ValueError: a link that there is none of.
    """
    name, equals, rest = text.partition("=")
    if equals and name not in links and Path(rest).exists() and not Path(text).exists():
        raise ValueError(f"{text}: want one of the links {', '.join(links)}, not {name!r}")
    link, path = (name, Path(rest)) if equals and name in links else (None, Path(text))
    return LogInput(path, _kind(path), link)


def _kind(path: Path) -> LogKind:
    """By its first bytes; of one whose beginning is damaged, by its name. What is nothing else is a log of CAN."""
    with path.open("rb") as file:
        head = file.read(HEAD_BYTES)
    if head.startswith(DATAFLASH_MAGIC):
        return LogKind.DATAFLASH
    if head.startswith(ULOG_MAGIC):
        return LogKind.ULOG
    if head.startswith(MCAP_MAGIC):
        return LogKind.RECORDING
    if head[STAMP_BYTES : STAMP_BYTES + 1] and head[STAMP_BYTES] in MAVLINK_MAGICS and not head.isascii():
        return LogKind.TLOG
    return LogKind(SUFFIXES.get(path.suffix.lower(), LogKind.CAN))
