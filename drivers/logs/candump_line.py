"""One line of a candump log, read strictly: every deviation from what candump writes has its cause.

Source: can-utils, candump.c and lib.c (its library of texts). The form of files (`candump -l`, `-L`):

    (1600000000.123456) can0 123#0011         data of 0 to 8 bytes; identifier of 3 digits, or 8 if extended
    (1600000000.123456) can0 123#0011 R       with the direction (`-x`)
    (1600000000.123456) can0 123##10011       CAN FD: one digit of flags, then 0 to 64 bytes
    (1600000000.123456) can0 123#R8           remote frame
    (1600000000.123456) can0 123#00..00_E     eight bytes with a raw length code above 8
    (1600000000.123456) can0 20000004#...     error frame

and that of the console (with `-t`, for without time a line is of no use):

    (1600000000.123456)  can0  RX - -  123   [2]  00 11                       '..'
    (1600000000.123456)  can0  123  [12]  00 11 ...       length of two digits: CAN FD
"""

from __future__ import annotations

import re
from datetime import UTC, datetime

from drivers.can.frame import CLASSIC_DATA_BYTES, CanFrame
from drivers.logs.damage import DamagedRecordError
from drivers.logs.frame_text import LoggedFrame, checked_data, checked_identifier, whole_number
from drivers.logs.text_log import text_of

INTERFACE_LENGTH_MAX = 15  # IFNAMSIZ of Linux, without the final zero
ERROR_FLAG = 0x2000_0000  # CAN_ERR_FLAG of linux/can.h

_COLOUR = re.compile(rb"\x1b\[[0-9;]*m")
_LINE = re.compile(r"\((?P<stamp>[^()]*)\) +(?P<interface>[^ ]+) +(?P<frame>.+)")
_SECONDS = re.compile(r"\d{1,10}\.\d{1,9}", re.ASCII)
_EPOCH_SECONDS = re.compile(r"\d{10}\.\d{1,9}", re.ASCII)
_DATE = re.compile(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d\.\d{1,9}", re.ASCII)
_COMPACT = re.compile(r"(?P<identifier>[^ #]*)#(?P<data>[^ ]*)(?: [RT])?")
_CONSOLE = re.compile(r"(?:[RT]X [B-] [E-] +)?(?P<identifier>[^ ]+) +(?P<length>[\[{][^ ]+[\]}])(?P<data>.*)")
_REMOTE = re.compile(r"[Rr](?:[0-8](?:_[9A-Fa-f])?)?")
_RAW_LENGTH_CODE = re.compile(r"[0-9A-Fa-f]{16}_[9A-Fa-f]")
_LENGTH = re.compile(r"\[[0-8]\]|\{[0-9A-F]\}|\[\d\d\]", re.ASCII)


def read_line(line: bytes) -> LoggedFrame:
    """The frame of a whole line.

    Raises:
        DamagedRecordError: the line is none that candump writes, or its frame is none that we read.
    """
    matched = _LINE.fullmatch(text_of(_COLOUR.sub(b"", line) if b"\x1b" in line else line))
    if matched is None:
        raise DamagedRecordError("no time" if b"(" not in line else "no frame")
    stamp, interface, frame = matched.groups()
    if len(interface) > INTERFACE_LENGTH_MAX:
        raise DamagedRecordError("name of the interface too long")
    if compact := _COMPACT.fullmatch(frame):
        return LoggedFrame(interface, _compact(_time_s(stamp), *compact.groups()), relative=False)
    if console := _CONSOLE.fullmatch(frame):
        relative = not (_EPOCH_SECONDS.fullmatch(stamp) or _DATE.fullmatch(stamp))
        return LoggedFrame(interface, _console(_time_s(stamp), *console.groups()), relative)
    raise DamagedRecordError("text behind the frame" if "#" in frame.partition(" ")[0] else "no '#'")


def has_epoch(line: bytes) -> bool:
    """True if a line begins with a time that no part of another one could be."""
    stamp = line[1:].partition(b")")[0].decode("latin-1")
    return bool(_EPOCH_SECONDS.fullmatch(stamp) or _DATE.fullmatch(stamp))


def _time_s(stamp: str) -> float:
    """Seconds since 1970, or as counted. A date has no time zone: it is taken for UTC, on whatever machine we run."""
    if _SECONDS.fullmatch(stamp):
        return float(stamp)
    if _DATE.fullmatch(stamp):
        try:
            return datetime.fromisoformat(stamp).replace(tzinfo=UTC).timestamp()
        except ValueError:
            pass
    raise DamagedRecordError("no time")


def _compact(time_s: float, digits: str, data: str) -> CanFrame:
    if ":" in data:
        raise DamagedRecordError("CAN XL frame")
    identifier, extended, error = _identifier(digits)
    if _REMOTE.fullmatch(data):
        raise DamagedRecordError("remote frame")
    fd = data.startswith("#")
    if fd:
        _flags(data[1:2])
        data = data[2:]
    elif _RAW_LENGTH_CODE.fullmatch(data):
        data = data[:16]
    return CanFrame(time_s, identifier, _data(data, fd), extended, fd, error)


def _console(time_s: float, digits: str, length: str, text: str) -> CanFrame:
    identifier, extended, error = _identifier(digits)
    if _LENGTH.fullmatch(length) is None:
        raise DamagedRecordError("length of the data not understood")
    if text.strip() == "remote request":
        raise DamagedRecordError("remote frame")
    fd = len(length) == len("[08]")
    octets, _, characters = text.removesuffix("ERRORFRAME").partition("'")
    stated = int(length[1:-1], 10 if fd else 16)
    data = checked_data(octets.split(), stated if fd else min(stated, CLASSIC_DATA_BYTES), fd)
    if characters and len(characters) != len(data) + len("'"):
        raise DamagedRecordError("characters are not those of the data")
    return CanFrame(time_s, identifier, data, extended, fd, error)


def _identifier(digits: str) -> tuple[int, bool, bool]:
    """Identifier; whether it is extended; whether it is the class of an error."""
    number = whole_number(digits)
    if len(digits) not in (3, 8):
        raise DamagedRecordError("identifier not of 3 or 8 digits")
    extended = len(digits) == 8
    error = extended and bool(number & ERROR_FLAG)
    return checked_identifier(number & ~ERROR_FLAG, extended), extended and not error, error


def _flags(digit: str) -> None:
    """Bit rate and error state of a CAN FD frame: nobody asks for them, yet they must be there."""
    if not digit:
        raise DamagedRecordError("no flags of CAN FD")
    whole_number(digit)


def _data(digits: str, fd: bool) -> bytes:
    if len(digits) % 2:
        raise DamagedRecordError("odd number of digits")
    octets = [digits[place : place + 2] for place in range(0, len(digits), 2)]
    return checked_data(octets, len(octets), fd)
