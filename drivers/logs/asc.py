"""ASCII logs of Vector's tools (CANalyzer, CANoe), and of those that write the like (python-can, can-utils' log2asc).

Each line is read strictly; what is wrong with one is noted with its number, and reading goes on with the next. Lines
that tell of something else than frames, as far as they are known, are passed over.

Interfaces have the number of the channel as name, as in the file. Times count from the date of the header, or of the
block of a trigger: it has no time zone and is taken for UTC; without one they start at 0. Error frames have no error
class of SocketCAN in this format: their identifier is 0.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from datetime import UTC, datetime
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

_BEGINS = re.compile(
    rb"^[ \t]*(date[ \t]+\w{2,3}[ \t]|base[ \t]+(hex|dec)|begin triggerblock|\d+\.\d{3,9}[ \t]+(\d{1,3}|CANFD)[ \t])",
    re.M | re.I,
)
_BASE = re.compile(r"base\s+(hex|dec)(?:\s+timestamps\s+(absolute|relative))?", re.I)
_DATE = re.compile(r"(?:date|begin triggerblock)\s+(.*)", re.I)
_OTHER_HEADER = re.compile(r"//.*|(?:no\s+)?internal\s+events\s+logged|end triggerblock|begin triggerblock", re.I)
_RECORD = re.compile(r"(\d{1,10}\.\d{1,9})\s+(.*)", re.ASCII)
_EVENT = re.compile(
    r"start of measurement|(?:CAN\s+)?\d+\s+(?:statistic|status|J1939TP|\S+\s+TxRq\s)|(?:SV|log|LIN|ETH|FR)\b", re.I
)
_ERROR = re.compile(r"(?:CANFD\s+)?(\d{1,3})\s+(?:[RT]x\s+)?ErrorFrame\b", re.I)
_CLASSIC = re.compile(r"(\d{1,3})\s+([^\s]+?)(x?)\s+[RT]x\s+([dr])(?:\s+([^\s]+))?(.*)", re.I)
# A name may stand before the flags for bit rate and error state.
_FLEXIBLE = re.compile(
    r"CANFD\s+(\d{1,3})\s+[RT]x\s+([^\s]+?)(x?)\s+(?:[^\s]+\s+)??[01]\s+[01]\s+([^\s]+)\s+(\d+)(.*)", re.I
)
_FD_FLAG, _REMOTE_FLAG = 0x1000, 0x10  # of the third number behind the data

_WHEN = re.compile(
    r"\w+\s+([^\W\d]+)\s+(\d{1,2})\s+(\d{1,2}):(\d\d):(\d\d)(?:\.(\d{1,6}))?(?:\s+([ap]m))?\s+(\d{4})", re.I
)
_MONTHS = {
    **{"jan": 1, "feb": 2, "mar": 3, "apr": 4, "may": 5, "jun": 6},
    **{"jul": 7, "aug": 8, "sep": 9, "oct": 10, "nov": 11, "dec": 12},
    **{"mär": 3, "mrz": 3, "mai": 5, "okt": 10, "dez": 12},
}


def is_asc(head: bytes) -> bool:
    """True if a line of an ASCII log is in the beginning of a file."""
    return _BEGINS.search(head) is not None


def read_asc(path: Path, damage: DamageReport) -> Iterator[tuple[str, FrameBlock]]:
    """Number of a channel and some of its frames, again and again, each channel's in the order of the file.

    Args:
        path: the file, gzip or not.
        damage: told what is lost: damaged lines and remote frames.

    Raises:
        OSError: the file cannot be read.
        ValueError: it is no ASCII log; an empty one has no frames.
    """
    check_kind(path, "Vector ASC log", is_asc)
    return read_lines(path, _AscLines().read, damage)


class _AscLines:
    """Line after line: those of the header say how the others are to be read."""

    def __init__(self) -> None:
        self._radix = 16
        self._relative = False  # each time counts from the line before
        self._start_s = 0.0
        self._last_s = 0.0

    def read(self, line: bytes) -> LoggedFrame | None:
        """The frame of a line, None if it has none."""
        begun = line.lstrip()
        if not begun[:1].isdigit():
            self._header(line.decode("latin-1").strip())
            return None
        record = _RECORD.fullmatch(text_of(begun))
        if record is None:
            raise DamagedRecordError("no time")
        return self._event(self._time_s(record[1]), record[2])

    def _header(self, text: str) -> None:
        """A line without time takes effect on those that follow, or has none."""
        if base := _BASE.fullmatch(text):
            self._radix = 16 if base[1].lower() == "hex" else 10
            self._relative = (base[2] or "").lower() == "relative"
        elif date := _DATE.fullmatch(text):
            self._last_s = 0.0
            self._start_s = _seconds_of_date(date[1])
        elif text and not _OTHER_HEADER.fullmatch(text):
            raise DamagedRecordError("no time")

    def _time_s(self, text: str) -> float:
        time_s = float(text)
        if self._relative:
            time_s += self._last_s
        self._last_s = time_s
        return time_s + self._start_s

    def _event(self, time_s: float, text: str) -> LoggedFrame | None:
        if classic := _CLASSIC.fullmatch(text):
            return self._classic(time_s, *classic.groups(default=""))
        if flexible := _FLEXIBLE.fullmatch(text):
            return self._flexible(time_s, *flexible.groups())
        if error := _ERROR.match(text):
            return LoggedFrame(error[1], CanFrame(time_s, 0, b"", extended=False, error=True))
        if _EVENT.match(text):
            return None
        raise DamagedRecordError("no CAN frame")

    def _classic(
        self, time_s: float, channel: str, digits: str, x: str, kind: str, code: str, rest: str
    ) -> LoggedFrame:
        if kind.lower() == "r":
            raise DamagedRecordError("remote frame")
        length = length_of_code(whole_number(code, self._radix), fd=False)
        data = checked_data(rest.split()[:length], length, fd=False, radix=self._radix)
        return LoggedFrame(channel, CanFrame(time_s, self._identifier(digits, x), data, extended=bool(x)))

    def _flexible(
        self, time_s: float, channel: str, digits: str, x: str, code: str, size: str, rest: str
    ) -> LoggedFrame:
        length = whole_number(size, 10)
        octets, behind = rest.split()[:length], rest.split()[length:]
        flags = whole_number(behind[2]) if len(behind) > 2 else _FD_FLAG
        if flags & _REMOTE_FLAG:
            raise DamagedRecordError("remote frame")
        fd = bool(flags & _FD_FLAG)
        if length != length_of_code(whole_number(code), fd):
            raise DamagedRecordError("data length and its code disagree")
        data = checked_data(octets, length, fd, self._radix)
        return LoggedFrame(channel, CanFrame(time_s, self._identifier(digits, x), data, bool(x), fd))

    def _identifier(self, digits: str, x: str) -> int:
        return checked_identifier(whole_number(digits, self._radix), extended=bool(x))


def _seconds_of_date(text: str) -> float:
    """Seconds since 1970 of a date such as "Sun Sep 13 12:26:40.123 2020", in English or German."""
    matched = _WHEN.fullmatch(text)
    month = _MONTHS.get(matched[1].lower()) if matched else None
    if matched is None or month is None:
        raise DamagedRecordError("date not understood")
    _, day, hour, minute, second, fraction, half, year = matched.groups()
    hours = int(hour) % 12 + 12 * (half.lower() == "pm") if half else int(hour)
    try:
        when = datetime(int(year), month, int(day), hours, int(minute), int(second), tzinfo=UTC)
    except ValueError as error:
        raise DamagedRecordError("date not understood") from error
    return when.timestamp() + _fraction_s(fraction or "0")


def _fraction_s(digits: str) -> float:
    """Up to three digits are milliseconds, for python-can writes them without leading zeros."""
    return int(digits) / (1_000.0 if len(digits) <= 3 else 10.0 ** len(digits))
