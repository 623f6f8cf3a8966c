"""Trace files of PEAK's programs (PCAN-View, PCAN-Explorer), versions 1.0 to 2.1, and of those that write the like.

Each line is read strictly; what is wrong with one is noted with its number, and reading goes on with the next.

Interfaces have the number of the bus as name, "1" where the file has none. Times count from the header's start, which
has no time zone and is taken for UTC; without one (always in version 1.0) they start at 0. Error frames have no error
class of SocketCAN in this format: their identifier is 0.

Source: PEAK CAN TRC file format (PEAK_CAN_TRC_File_Format.pdf).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from datetime import UTC, datetime, timedelta
from pathlib import Path

from drivers.can.frame import CanFrame
from drivers.can.frame_block import FrameBlock
from drivers.logs.damage import DamagedRecordError, DamageReport
from drivers.logs.frame_text import (
    LoggedFrame,
    checked_data,
    checked_identifier,
    length_of_code,
    read_lines,
    whole_number,
)
from drivers.logs.text_log import check_kind, text_of

# Letters as in $COLUMNS: N number, O offset of time, B bus, T type, I identifier, R reserved, d direction,
# L data length code, l data length, D data.
_COLUMNS = {"1.0": "NOILD", "1.1": "NOTILD", "1.2": "NOBTILD", "1.3": "NOBTIRLD"}
_NEEDED = frozenset("OID")
_EPOCH = datetime(1899, 12, 30, tzinfo=UTC)  # day 0 of $STARTTIME
_DAYS_MAX = 200_000

_BEGINS = re.compile(rb"\A;(\$FILEVERSION=|#{20}|[^\n]*\bPCAN)|^[ \t]*1\)[ \t]+\d+(\.\d+)?[ \t]", re.MULTILINE)
_MILLISECONDS = re.compile(r"\d{1,12}(\.\d{1,6})?", re.ASCII)
_DATA_TYPES = frozenset({"Rx", "Tx", "DT", "FD", "FB", "FE", "BI"})
_FD_TYPES = frozenset({"FD", "FB", "FE", "BI"})
_ERROR_TYPES = frozenset({"Error", "ER"})
_EVENT_TYPES = frozenset({"Warng", "ST", "EC", "EV"})  # state of the bus, counters, what the user noted
_STATUS_IDENTIFIER = "FFFFFFFF"  # of version 1.0, which has no types
_STANDARD_DIGITS = 4


def is_trc(head: bytes) -> bool:
    """True if a file that begins so is a trace file."""
    return _BEGINS.search(head) is not None


def read_trc(path: Path, damage: DamageReport) -> Iterator[tuple[str, FrameBlock]]:
    """Number of a bus and some of its frames, again and again, each bus's in the order of the file.

    Args:
        path: the file, gzip or not.
        damage: told what is lost: damaged lines and remote frames.

    Raises:
        OSError: the file cannot be read.
        ValueError: it is no trace file; an empty one has no frames.
    """
    check_kind(path, "PEAK TRC log", is_trc)
    return read_lines(path, _TrcLines().read, damage)


class _TrcLines:
    """Line after line: those of the header say how the others are to be read."""

    def __init__(self) -> None:
        self._columns = _COLUMNS["1.0"]
        self._start_s = 0.0

    def read(self, line: bytes) -> LoggedFrame | None:
        """The frame of a line, None if it has none."""
        if line.startswith(b";"):
            self._header(line.decode("latin-1").strip())
            return None
        text = text_of(line)
        return self._record(text) if text else None

    def _header(self, text: str) -> None:
        name, _, value = text.partition("=")
        value = value.rstrip("; ")
        if name == ";$FILEVERSION":
            self._columns = _COLUMNS.get(value, self._columns)
        elif name == ";$STARTTIME":
            self._start_s = _start_s(value)
        elif name == ";$COLUMNS":
            self._columns = _columns(value)

    def _record(self, text: str) -> LoggedFrame | None:
        fields = text.split(maxsplit=len(self._columns) - 1)
        field = dict(zip(self._columns, fields, strict=False))
        kind = field.get("T", "DT")
        if kind in _EVENT_TYPES or ("T" not in field and field.get("I") == _STATUS_IDENTIFIER):
            return None
        interface = field.get("B", "1")
        time_s = self._start_s + _milliseconds(field.get("O", "")) / 1000.0
        if kind in _ERROR_TYPES or field.get("D", "").startswith("ERROR "):
            return LoggedFrame(interface, CanFrame(time_s, 0, b"", extended=False, error=True))
        if kind == "RR" or field.get("D") == "RTR":
            raise DamagedRecordError("remote frame")
        if kind not in _DATA_TYPES:
            raise DamagedRecordError("type of the line not known")
        return LoggedFrame(interface, _frame(time_s, field, kind in _FD_TYPES))


def _frame(time_s: float, field: dict[str, str], fd: bool) -> CanFrame:
    digits = field.get("I", "")
    extended = len(digits) > _STANDARD_DIGITS
    identifier = checked_identifier(whole_number(digits), extended)
    if "l" in field:
        length = whole_number(field["l"], 10)
    else:
        length = length_of_code(whole_number(field.get("L", ""), 10), fd)
    return CanFrame(time_s, identifier, checked_data(field.get("D", "").split(), length, fd), extended, fd)


def _milliseconds(text: str) -> float:
    if _MILLISECONDS.fullmatch(text) is None:
        raise DamagedRecordError("no time")
    return float(text)


def _start_s(text: str) -> float:
    """Seconds since 1970 of a number of days."""
    try:
        days = float(text)
    except ValueError:
        days = -1.0
    if not 0.0 <= days <= _DAYS_MAX:
        raise DamagedRecordError("start time not understood")
    return (_EPOCH + timedelta(days=days)).timestamp()


def _columns(text: str) -> str:
    columns = "".join(text.split(","))
    if not _NEEDED.issubset(columns) or not {"L", "l"}.intersection(columns):
        raise DamagedRecordError("columns not understood")
    return columns
