"""Logs of CAN: candump, ASC, BLF, TRC, as their usual writers write them, plain and packed."""

from __future__ import annotations

import gzip
import re
from collections import defaultdict
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import can
from can.io import ASCWriter, BLFWriter, CanutilsLogWriter, TRCWriter

from drivers.can.frame import CanFrame
from drivers.logs import blf, text_log
from drivers.logs.asc import read_asc
from drivers.logs.blf import read_blf
from drivers.logs.can_log import Reader, open_can_log
from drivers.logs.candump import read_candump
from drivers.logs.damage import DamageReport
from drivers.logs.trc import read_trc
from hil_tests.fuzz.files import as_file, pieces_of, written
from hil_tests.fuzz.target import Target, require

SMALL_PIECE = 100
_DATE, _NAME = re.compile(rb"^date [^\r\n]*", re.M), re.compile(rb"^; [^\r\n]*seed\.trc", re.M)  # of today and here
PACKED_PIECE = 1 << 16  # a few bytes may unpack to many megabytes
_GZIP = b"\x1f\x8b"
START_S = 1_600_000_000.0
_CONSOLE = (
    b"(1600000000.000100)  can0  123   [8]  11 22 33 44 55 66 77 88   '.\"3DUfw.'\n"
    b"(1600000000.000200)  can0  RX - -  00000123  [12]  11 22 33 44 55 66 77 88 99 AA BB CC\n"
    b"(2020-09-13 12:26:41.000001)  can1  20000004   [8]  00 04 00 00 00 00 00 00   ERRORFRAME\n"
    b"DROPCOUNT: dropped 17 CAN frames on 'can0' socket (total drops 17)\n"
    b"(1600000001.000000) can0 1FFFFFFF##5112233445566778899AABBCC T\n"
)
_RELATIVE = b"".join(b" (00%d.%06d)  can0  123   [1]  11\n" % (n % 2, 10 * n) for n in range(12))
WRITERS: dict[str, Callable[..., Any]] = {
    ".log": CanutilsLogWriter,
    ".asc": ASCWriter,
    ".blf": BLFWriter,
    ".trc": TRCWriter,
}
_SIGNS = (b"#", b"##1", b"\r\n", b"\xef\xbb\xbf", b"x", b" Rx ", b"FD", b"-1", b"1e999", b"FFFFFFFF", b"99999999999")
TEXTS = (*_SIGNS, b"9" * 5000)  # Python turns no number of more than 4300 digits
BINARY = (b"LOBJ", b"LOGG", b"\x0a\0\0\0", b"\x56\0\0\0", b"\x64\0\0\0", b"\x65\0\0\0")


class _Read(NamedTuple):
    frames: dict[str, list[CanFrame]]
    damage: DamageReport


def can_log_targets() -> list[Target]:
    """One of each format, and one of all of them by what is in the file."""
    return [
        _text("candump", "logs of candump, packed or not", read_candump, _candump),
        _text("asc", "Vector's ASCII logs, packed or not", read_asc, partial(_by_python_can, ".asc")),
        _text("trc", "PEAK's trace files, packed or not", read_trc, partial(_by_python_can, ".trc")),
        Target("blf", "Vector's binary logs", partial(_check, read_blf, blf, "_PIECE_BYTES", False), _binary, BINARY),
        Target("can_log", "any of these, told by what is in it", _check_any, _any, (*TEXTS, *BINARY)),
    ]


def _text(name: str, about: str, reader: Reader, plain: Callable[[], list[bytes]]) -> Target:
    def seeds() -> list[bytes]:
        return [*plain(), *(gzip.compress(one, mtime=0) for one in plain()[:1])]

    return Target(name, about, partial(_check, reader, text_log, "CHUNK_BYTES", True), seeds, TEXTS)


def _check(reader: Reader, module: ModuleType, piece: str, exact: bool, data: bytes) -> None:
    """Whole or in small pieces, the same frames come, and the same is lost.

    Args:
        reader: of the format.
        module: where its constant is.
        piece: name of the constant that says how much is read at once.
        exact: False where a damaged object is judged by what follows, so that it may look better at a piece's end.
        data: the log.
    """
    with as_file(data, "damaged.log") as path:
        whole = _read(reader, path)
        with pieces_of(module, piece, PACKED_PIECE if data.startswith(_GZIP) else SMALL_PIECE):
            parts = _read(reader, path)
    if whole is None or parts is None:
        require(whole is parts, "it is a log, or it is none")
        return
    if whole.damage.lost and not exact:
        return
    lost = parts.damage.lost, whole.damage.lost
    require(lost[0] == lost[1], f"in pieces {lost[0]} are lost, whole {lost[1]}")
    require(_without_times(parts) == _without_times(whole), f"in pieces {parts.frames}, whole {whole.frames}")


def _check_any(data: bytes) -> None:
    with as_file(data, "damaged") as path:
        _read(open_can_log, path)


def _read(reader: Reader, path: Path) -> _Read | None:
    """All frames, each made anew, so that it is checked; None where the reader says that it is no such log."""
    damage = DamageReport()
    try:
        blocks = reader(path, damage)
    except ValueError as error:
        require(str(path) in str(error), f"a refusal that does not name the file: {error}")
        return None
    frames: defaultdict[str, list[CanFrame]] = defaultdict(list)
    for interface, block in blocks:
        require(bool(interface) and len(block) > 0, "a block without name or frames")
        frames[interface] += [
            CanFrame(f.time_s, f.identifier, f.data, f.extended, f.fd, f.error) for f in block.frames()
        ]
    require(damage.records == sum(map(len, frames.values())), f"{damage.records} records")
    require(all(damage.lost.values()) and damage.lost.keys() == damage.places.keys(), f"{damage}")
    return _Read(frames, damage)


def _without_times(read: _Read) -> dict[str, list[CanFrame]]:
    """Whether times count from the line before is decided by the first piece."""
    return {name: [replace(one, time_s=0.0) for one in several] for name, several in read.frames.items()}


def _candump() -> list[bytes]:
    return [*_by_python_can(".log"), _CONSOLE, _RELATIVE]


def _binary() -> list[bytes]:
    """Containers packed and as they are: where nothing is packed, damage gets as far as the objects."""
    return [*_by_python_can(".blf", compression_level=0), *_by_python_can(".blf")]


def _any() -> list[bytes]:
    return [data for suffix in WRITERS for data in _by_python_can(suffix)]


def _by_python_can(suffix: str, **options: Any) -> list[bytes]:
    """A log of classic frames and one of all kinds, as python-can writes them."""

    def write(path: Path, flexible: bool) -> None:
        with WRITERS[suffix](path, **options) as writer:
            for message in (_message(number, flexible) for number in range(8)):
                if suffix != ".trc" or _plain(message):
                    writer(message)

    logs = [written(f"seed{suffix}", partial(write, flexible=flexible)) for flexible in (False, True)]
    return [_NAME.sub(b"; seed.trc", _DATE.sub(b"date Sun Sep 13 12:26:40.000 2020", log)) for log in logs]


def _plain(message: can.Message) -> bool:
    """python-can's writer of trace files knows no others."""
    return not (message.is_fd or message.is_remote_frame or message.is_error_frame)


def _message(number: int, flexible: bool) -> can.Message:
    flexible = flexible and number % 2 == 0
    return can.Message(
        timestamp=START_S + 0.001 * number,
        arbitration_id=0x1234567 if number % 3 else 0x123,
        is_extended_id=bool(number % 3),
        is_fd=flexible,
        is_remote_frame=number == 5,
        is_error_frame=number == 7,
        data=b"" if number in {5, 7} else bytes(range(12 if flexible else number)),
        channel=number % 2,
    )
