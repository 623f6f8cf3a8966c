"""A vendor's database with all that databases can do: frames by it, and the file itself."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory

from cantools.database.can import Database

from drivers.can.dbc import DbcDecoder, DbcThruster
from drivers.can.dbc_database import SUFFIXES
from drivers.can.decoder import CanDecoder
from drivers.can.frame import EXTENDED_MASK, CanFrame
from drivers.command import CommandScale
from hil_tests.fuzz.frame_bytes import bytes_of
from hil_tests.fuzz.target import Target

DATABASE = """VERSION ""
NS_ :
BS_:
BU_: ESC
BO_ 256 Command: 8 ESC
 SG_ Pulse : 0|16@1+ (1,0) [0|0] "us" ESC
 SG_ Percent : 23|16@0- (0.01,0) [-110|110] "%" ESC
BO_ 2147483905 Status: 6 ESC
 SG_ Speed : 0|16@1- (1,0) [-6000|6000] "rpm" ESC
 SG_ Voltage : 23|12@0+ (0.01,0) [0|30] "V" ESC
 SG_ Current : 32|13@1- (0.1,0) [0|0] "A" ESC
BO_ 258 Turns: 8 ESC
 SG_ Count : 0|12@1+ (1,0) [0|0] "" ESC
 SG_ Rate : 32|32@1- (1,0) [0|0] "1/s" ESC
BO_ 260 Several: 8 ESC
 SG_ Which M : 0|8@1+ (1,0) [0|0] "" ESC
 SG_ Speed m0 : 8|32@1- (1,0) [0|0] "rpm" ESC
 SG_ Voltage m1 : 16|16@1- (0.01,0) [0|0] "V" ESC
BO_ 2147483654 Long: 64 ESC
 SG_ Far : 300|64@1- (1e-15,0) [0|0] "rpm" ESC
 SG_ Volts : 191|64@0- (1,0) [0|0] "V" ESC
SIG_VALTYPE_ 258 Rate : 1;
SIG_VALTYPE_ 260 Speed : 1;
SIG_VALTYPE_ 2147483654 Volts : 2;
"""
THRUSTERS = [
    DbcThruster(1, "Command.Pulse", CommandScale(1100.0, 1500.0, 1900.0, dead_band=25.0), "Status.Speed"),
    DbcThruster(
        2, "Command.Percent", CommandScale(-100.0, 0.0, 100.0, reverse=True), "Turns.Count", "pulse_count", 7
    ),
    DbcThruster(3, speed="Turns.Rate", speed_unit="pulses_per_s", pole_pairs=2, voltage="Status.Voltage"),
    DbcThruster(4, speed="Several.Speed", voltage="Several.Voltage", current="Status.Current", reverse=True),
    DbcThruster(5, speed="Long.Far", speed_unit="erpm", pole_pairs=7, signed=False, voltage="Long.Volts"),
]


@cache
def _database() -> Database:
    database = Database()
    database.add_dbc_string(DATABASE)
    return database


def vendor_decoder() -> CanDecoder:
    """Reads all that is in the frames."""
    return DbcDecoder(_database(), THRUSTERS)


def vendor_frames() -> list[bytes]:
    """Frames of all messages, as `frame_bytes` packs them, behind a byte for the cut."""
    frames = [frame for number in range(5) for frame in _frames(number)]
    return [b"\0" + bytes_of(frames), b"\x0c" + bytes_of(frames[::-1]), b"\x03" + bytes_of(frames[:6])]


def _frames(number: int) -> Iterator[CanFrame]:
    for message in _database().messages:
        data = bytes((number + 37 * place) % 256 for place in range(message.length))
        data = bytes([number % 2]) + data[1:] if message.name == "Several" else data
        extended = bool(message.is_extended_frame)
        yield CanFrame(0.0, message.frame_id & EXTENDED_MASK, data, extended, fd=message.length > 8)


def database_target() -> Target:
    """Files of databases; the first byte tells which format the name claims."""
    return Target("database", "DBC, KCD, SYM and ARXML files: read, or refused in words", _read_file, _files)


def _read_file(data: bytes) -> None:
    with TemporaryDirectory() as folder:
        path = Path(folder) / f"vendor{SUFFIXES[data[0] % len(SUFFIXES) if data else 0]}"
        path.write_bytes(data[1:])
        try:
            decoder = DbcDecoder(path, THRUSTERS)
        except ValueError:
            return
        for frame in _frames(1):
            decoder.decode(frame)


def _files() -> list[bytes]:
    texts: dict[str, Callable[[], str]] = {
        ".dbc": lambda: DATABASE,
        ".kcd": partial(_written, Database.as_kcd_string),
        ".sym": partial(_written, Database.as_sym_string),
    }
    written = [bytes([SUFFIXES.index(suffix)]) + text().encode() for suffix, text in texts.items()]
    return [*written, bytes([SUFFIXES.index(".arxml")]) + written[1][1:]]


def _written(write: Callable[[Database], str]) -> str:
    return write(_database())
