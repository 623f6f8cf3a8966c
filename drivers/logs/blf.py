"""Binary logs of Vector's tools (CANalyzer, CANoe, CANape), and of those that write the like (python-can).

Containers carry a checksum: one that is damaged is not read, for what of it is right nobody can tell, and reading
goes on in the next. One that was cut off, by power loss, is read as far as it goes.

Interfaces have the number of the channel as name, from 1, as Vector's tools show it (python-can counts from 0). Times
count from the start in the header, which is taken for UTC, as python-can writes it; without one they start at 0.
Error frames have no error class of SocketCAN in this format: their identifier is 0.
"""

from __future__ import annotations

import struct
from collections import defaultdict
from collections.abc import Iterator
from datetime import UTC, datetime
from io import BufferedReader
from itertools import chain, islice
from pathlib import Path
from struct import Struct

from drivers.can.frame import CLASSIC_DATA_BYTES, FD_DATA_BYTES, CanFrame
from drivers.can.frame_block import FrameBlock
from drivers.logs.blf_objects import CONTAINER, LogObject, ObjectScanner, unpacked
from drivers.logs.damage import DamagedRecordError, DamageReport
from drivers.logs.frame_text import LoggedFrame, checked_identifier
from drivers.logs.text_log import not_a_log

BLOCK_OBJECTS = 50_000
_PIECE_BYTES = 1 << 20
_HEADER_BYTES_MAX = 1 << 16

_MAGIC = b"LOGG"
_FILE_HEADER = Struct("<4sL32x8H")  # magic, size, start as SYSTEMTIME: year, month, day of the week, day, ...

_STAMPS = {1: Struct("<L4xQ"), 2: Struct("<L4xQ8x")}  # by version of the header: unit, ticks
_STAMP_AT = 16
_TICKS_PER_S = {1: 1e5}  # by unit; all others:
_NANOSECONDS_PER_S = 1e9

_CAN = Struct("<HBBL8s")  # channel, flags, length code, identifier, data
_CAN_FD = Struct("<HBxL5xBB5x64s")  # channel, flags, identifier, flags of CAN FD, bytes of data, data
_CAN_FD_64 = Struct("<BxBxL4xL19xB4x")  # channel, bytes of data, identifier, flags, where the data end
_ERROR_FRAME = Struct("<H")  # channel
_EXTENDED = 0x8000_0000
_REMOTE, _REMOTE_64 = 0x80, 0x10
_FLEXIBLE, _FLEXIBLE_64 = 0x1, 0x1000


def is_blf(head: bytes) -> bool:
    """True if a file that begins so is a binary log."""
    return head.startswith(_MAGIC)


def read_blf(path: Path, damage: DamageReport) -> Iterator[tuple[str, FrameBlock]]:
    """Number of a channel and some of its frames, again and again, each channel's in the order of the file.

    Args:
        path: the file.
        damage: told what is lost: damaged objects and containers, and remote frames.

    Raises:
        OSError: the file cannot be read.
        ValueError: it is no binary log of Vector's.
    """
    with path.open("rb") as stream:
        if not is_blf(stream.read(len(_MAGIC))):
            raise not_a_log(path, "Vector BLF log")
    return _blocks(path, damage)


def _blocks(path: Path, damage: DamageReport) -> Iterator[tuple[str, FrameBlock]]:
    with path.open("rb") as stream:
        header_size, start_s = _header(stream, damage)
        objects = _objects(stream, header_size, damage)
        while batch := list(islice(objects, BLOCK_OBJECTS)):
            for interface, frames in _by_interface(batch, start_s, damage).items():
                damage.records += len(frames)
                yield interface, FrameBlock.of(frames)


def _by_interface(batch: list[LogObject], start_s: float, damage: DamageReport) -> dict[str, list[CanFrame]]:
    frames: defaultdict[str, list[CanFrame]] = defaultdict(list)
    for one in batch:
        try:
            logged = _logged_frame(one, start_s)
        except DamagedRecordError as error:
            damage.add(str(error), one.place)
        else:
            if logged is not None:
                frames[logged.interface].append(logged.frame)
    return frames


def _objects(stream: BufferedReader, offset: int, damage: DamageReport) -> Iterator[LogObject]:
    """All objects of a file, from here on, that are no containers."""
    outer, inner = ObjectScanner(damage, offset), ObjectScanner(damage)
    for one in chain(_scanned(stream, outer, damage), outer.finish()):
        if not one.whole:
            damage.add("last object cut off", one.place)
        if one.kind == CONTAINER:
            yield from _contents(one, inner, damage)
        elif one.whole:
            yield one
    yield from _finished(inner)


def _scanned(stream: BufferedReader, scanner: ObjectScanner, damage: DamageReport) -> Iterator[LogObject]:
    while piece := stream.read(_PIECE_BYTES):
        damage.bytes_read = stream.tell()
        yield from scanner.feed(piece)


def _contents(container: LogObject, inner: ObjectScanner, damage: DamageReport) -> Iterator[LogObject]:
    try:
        content = unpacked(container)
    except DamagedRecordError as error:
        damage.add(str(error), container.place)
        yield from _finished(inner)  # an object that was to end in here never will
    else:
        yield from inner.feed(content, container.place)


def _finished(scanner: ObjectScanner) -> Iterator[LogObject]:
    return (one for one in scanner.finish() if one.whole)


def _header(stream: BufferedReader, damage: DamageReport) -> tuple[int, float]:
    """Size of the header, behind which the stream then stands, and the start in seconds since 1970, 0 if unknown."""
    data = stream.read(_FILE_HEADER.size)
    if len(data) < _FILE_HEADER.size:
        damage.add("header of the file cut off", "offset 0")
        return len(data), 0.0
    _, size, *start = _FILE_HEADER.unpack(data)
    if not _FILE_HEADER.size <= size <= _HEADER_BYTES_MAX:
        damage.add("header of the file damaged", "offset 4")
        size = _FILE_HEADER.size
    stream.seek(size)
    return size, _seconds(start)


def _seconds(start: list[int]) -> float:
    year, month, _, day, hour, minute, second, millisecond = start
    try:
        return datetime(year, month, day, hour, minute, second, 1000 * millisecond, tzinfo=UTC).timestamp()
    except ValueError:  # all zeros: no start is known
        return 0.0


def _logged_frame(one: LogObject, start_s: float) -> LoggedFrame | None:
    """The frame of an object, None if it is of another kind."""
    reader = _READERS.get(one.kind)
    stamp = _STAMPS.get(one.header_version)
    if reader is None:
        return None
    if stamp is None:
        raise DamagedRecordError("version of an object not known")
    try:
        flags, ticks = stamp.unpack_from(one.data, _STAMP_AT)
        time_s = start_s + ticks / _TICKS_PER_S.get(flags, _NANOSECONDS_PER_S)
        return reader(one.data, _STAMP_AT + stamp.size, time_s)
    except struct.error as error:
        raise DamagedRecordError("object too short") from error


def _classic(data: bytes, at: int, time_s: float) -> LoggedFrame:
    channel, flags, code, number, octets = _CAN.unpack_from(data, at)
    return _frame(channel, time_s, number, octets[: min(code, CLASSIC_DATA_BYTES)], bool(flags & _REMOTE), fd=False)


def _flexible(data: bytes, at: int, time_s: float) -> LoggedFrame:
    channel, flags, number, fd_flags, count, octets = _CAN_FD.unpack_from(data, at)
    return _frame(channel, time_s, number, octets[:count], bool(flags & _REMOTE), bool(fd_flags & _FLEXIBLE))


def _flexible_64(data: bytes, at: int, time_s: float) -> LoggedFrame:
    channel, count, number, flags, behind = _CAN_FD_64.unpack_from(data, at)
    octets = data[at + _CAN_FD_64.size : behind or len(data)][:count]
    return _frame(  # what is missing of the data are zeros, in Vector's library too
        channel, time_s, number, octets.ljust(count, b"\0"), bool(flags & _REMOTE_64), bool(flags & _FLEXIBLE_64)
    )


def _error(data: bytes, at: int, time_s: float) -> LoggedFrame:
    (channel,) = _ERROR_FRAME.unpack_from(data, at)
    return LoggedFrame(str(channel), CanFrame(time_s, 0, b"", extended=False, error=True))


def _frame(channel: int, time_s: float, number: int, data: bytes, remote: bool, fd: bool) -> LoggedFrame:
    if remote:
        raise DamagedRecordError("remote frame")
    if len(data) > (FD_DATA_BYTES if fd else CLASSIC_DATA_BYTES):
        raise DamagedRecordError("data too long")
    extended = bool(number & _EXTENDED)
    identifier = checked_identifier(number & ~_EXTENDED, extended)
    return LoggedFrame(str(channel), CanFrame(time_s, identifier, data, extended, fd))


# By the type of an object. All others tell of something else than frames on a CAN bus.
_READERS = {1: _classic, 86: _classic, 100: _flexible, 101: _flexible_64, 2: _error, 73: _error}
