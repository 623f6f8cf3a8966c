"""Parts of a frame that logs write as text, read strictly, and the loop that reads such a log line by line."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from drivers.can.frame import CLASSIC_DATA_BYTES, EXTENDED_MASK, FD_DATA_BYTES, STANDARD_MASK, CanFrame
from drivers.can.frame_block import FrameBlock
from drivers.logs.damage import DamagedRecordError, DamageReport
from drivers.logs.line_frames import LineFrames
from drivers.logs.text_log import text_chunks

# Bytes of a CAN FD frame by its data length code (ISO 11898-1).
FD_LENGTHS = (0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64)

DIGITS_MAX = 20  # more than any number here has; of more than 4300 Python makes none
_DIGITS = {10: re.compile(r"[0-9]+"), 16: re.compile(r"[0-9A-Fa-f]+")}
_DIGIT_NAMES = {10: "decimal", 16: "hexadecimal"}


class LoggedFrame(NamedTuple):
    """A frame as the log has it. (A tuple, for it is made for each line.)

    Attributes:
        interface: name of the bus in the log.
        frame: with the log's time.
        relative: the time may count from the frame before: only the course of the times tells.
    """

    interface: str
    frame: CanFrame
    relative: bool = False


def read_lines(
    path: Path, read_line: Callable[[bytes], LoggedFrame | None], damage: DamageReport
) -> Iterator[tuple[str, FrameBlock]]:
    """The frames of a log, each interface's in the order of its lines.

    Args:
        path: of the log.
        read_line: gives the frame of a line, None for one that has none; raises DamagedRecordError.
        damage: gets what that error says.
    """
    for chunk in text_chunks(path, damage):
        frames = LineFrames(len(chunk.ends))
        for number, line in chunk.lines():
            try:
                logged = read_line(line)
            except DamagedRecordError as error:
                damage.add(str(error), f"line {number}")
            else:
                if logged is not None:
                    frames.put(number - chunk.first_line, logged.interface, logged.frame)
        for interface, block in frames.blocks():
            damage.records += len(block)
            yield interface, block


def whole_number(digits: str, radix: int = 16) -> int:
    """What the digits say.

    Raises:
        DamagedRecordError: something else is among them, or there are too many.
    """
    if len(digits) > DIGITS_MAX:
        raise DamagedRecordError("number too long")
    if _DIGITS[radix].fullmatch(digits) is None:
        raise DamagedRecordError(f"not a {_DIGIT_NAMES[radix]} digit")
    return int(digits, radix)


def checked_identifier(number: int, extended: bool) -> int:
    """The number.

    Raises:
        DamagedRecordError: it is no identifier.
    """
    if number > (EXTENDED_MASK if extended else STANDARD_MASK):
        raise DamagedRecordError("identifier out of range")
    return number


def checked_data(octets: Sequence[str], length: int, fd: bool, radix: int = 16) -> bytes:
    """Data of a frame from its bytes, each a text.

    Raises:
        DamagedRecordError: not as many as stated, too many for a frame, or no bytes.
    """
    if length > (FD_DATA_BYTES if fd else CLASSIC_DATA_BYTES):
        raise DamagedRecordError("data too long")
    if len(octets) != length:
        raise DamagedRecordError("data of another length than stated")
    if radix == 16:
        return _hexadecimal(octets)
    numbers = [whole_number(octet, radix) for octet in octets]
    if any(number > 0xFF for number in numbers):
        raise DamagedRecordError("byte out of range")
    return bytes(numbers)


def _hexadecimal(octets: Sequence[str]) -> bytes:
    try:
        data = bytes.fromhex(" ".join(octets))
    except ValueError:
        data = b""
    if len(data) == len(octets):
        return data
    for octet in octets:
        whole_number(octet)
    raise DamagedRecordError("data not in bytes of two digits")


def length_of_code(code: int, fd: bool) -> int:
    """Bytes of data for a data length code: codes above 8 mean 8 in a classic frame.

    Raises:
        DamagedRecordError: there is no such code.
    """
    if code >= len(FD_LENGTHS):
        raise DamagedRecordError("length of the data not understood")
    return FD_LENGTHS[code] if fd else min(code, CLASSIC_DATA_BYTES)
