"""A candump log on disk to what a vendor's thrusters said in it: by our reader and decoder, block by block, beside
python-can with cantools, and beside hilspy, whose reader and DBC codec are compiled (Rust).

The log is that of a bus with the two thrusters of the example's DBC file, commands and status in turns. All read
every frame of it into columns; ours go on to fractions of the range and revolutions a minute, the peers stop at the
signals. Databases are loaded before, but by hilspy: it does so when it opens a log, in less than a millisecond.
"""

from __future__ import annotations

import shutil
import weakref
from collections.abc import Callable, Iterable, Iterator
from importlib.resources import files
from importlib.util import find_spec
from itertools import cycle, islice
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import cantools
import numpy as np
from can.io import CanutilsLogReader
from numpy.typing import NDArray

from drivers.can.dbc import DbcDecoder, DbcThruster
from drivers.command import CommandScale
from drivers.logs.candump import read_candump
from drivers.logs.damage import DamageReport
from drivers.reading_block import ReadingBlock
from hil_tests.bench.timing import Comparison

FRAMES = 40_000
START_S = 1_600_000_000
PERIOD_US = 500
DISTINCT = 400  # frames, after which the data are the same again
WORK = "candump log to thruster samples (DBC)"
POLE_PAIRS = 7
THRUSTERS = [
    DbcThruster(
        thruster=1,
        command="PortCommand.Pulse",
        command_scale=CommandScale(1100.0, 1500.0, 1900.0),
        speed="PortStatus.PulseRate",
        speed_unit="pulses_per_s",
        pole_pairs=POLE_PAIRS,
        signed=False,
        voltage="PortStatus.Voltage",
        current="PortStatus.Current",
    ),
    DbcThruster(
        thruster=2,
        command="StarboardCommand.Percent",
        command_scale=CommandScale(-100.0, 0.0, 100.0),
        speed="StarboardStatus.Speed",
        voltage="StarboardStatus.Voltage",
        current="StarboardStatus.Current",
    ),
]

TIME = "time"
SIGNALS = {
    "PortCommand": ["Pulse"],
    "StarboardCommand": ["Percent"],
    "PortStatus": ["PulseRate", "Voltage", "Current"],
    "StarboardStatus": ["Speed", "Voltage", "Current"],
}
Columns = dict[str, dict[str, list[float]]]  # of each message: times, and values of each signal


def has_hilspy() -> bool:
    """True if that peer is installed."""
    return find_spec("hilspy") is not None


def candump_python_can() -> Comparison:
    """Beside python-can's reader and cantools."""

    def reader(log: Path, database: Path) -> Callable[[], Columns]:
        codec: Any = cantools.database.load_file(database)
        messages = {message.frame_id: message for message in codec.messages}

        def read() -> Columns:
            with CanutilsLogReader(log) as frames:
                pairs = ((frame, messages[frame.arbitration_id]) for frame in frames)
                return _columns(
                    (message.name, frame.timestamp, message.decode(frame.data)) for frame, message in pairs
                )

        return read

    return _comparison("python-can, cantools", reader)


def candump_hilspy() -> Comparison:
    """Beside hilspy with the same DBC file; without hilspy, see `has_hilspy`, it cannot be built."""
    import hilspy

    def reader(log: Path, database: Path) -> Callable[[], Columns]:
        def read() -> Columns:
            with hilspy.open(f"file://{log}?format=candump", f"dbc:{database}") as channel:
                return _columns((message.name, message.timestamp, message.fields) for message in channel)

        return read

    return _comparison("hilspy (Rust)", reader)


def _columns(messages: Iterable[tuple[str, float, dict[str, Any]]]) -> Columns:
    columns: Columns = {name: {column: [] for column in (TIME, *signals)} for name, signals in SIGNALS.items()}
    for name, time_s, values in messages:
        message = columns[name]
        message[TIME].append(time_s)
        for signal in SIGNALS[name]:
            message[signal].append(values[signal])
    return columns


def _comparison(peer: str, reader: Callable[[Path, Path], Callable[[], Columns]]) -> Comparison:
    folder = Path(mkdtemp())
    log, database = folder / "dive.log", folder / "vendor.dbc"
    database.write_bytes((files("gateway") / "examples" / "vendor_thruster.dbc").read_bytes())
    log.write_text("".join(_lines(database)))
    decoder = DbcDecoder(database, THRUSTERS)

    def ours() -> list[ReadingBlock]:
        return [decoder.decode_block(block) for _, block in read_candump(log, DamageReport())]

    weakref.finalize(ours, shutil.rmtree, folder)
    return Comparison(WORK, peer, "frame", FRAMES, ours, reader(log, database), _agree)


def _lines(database: Path) -> Iterator[str]:
    codec: Any = cantools.database.load_file(database)
    frames = islice(cycle(list(_frames(codec))), FRAMES)
    for number, (identifier, data) in enumerate(frames):
        seconds, microseconds = divmod(number * PERIOD_US, 1_000_000)
        yield f"({START_S + seconds}.{microseconds:06}) can0 {identifier:03X}#{data.hex().upper()}\n"


def _frames(codec: Any) -> Iterator[tuple[int, bytes]]:
    """Identifier and data of each."""
    for number in range(DISTINCT // 4):
        supply = {"Voltage": 15.5 + 0.01 * (number % 50), "Current": 0.25 * (number % 64)}
        for name, values in {
            "PortCommand": {"Pulse": 1100 + 8 * number},
            "StarboardCommand": {"Percent": 2.0 * number - 100.0},
            "PortStatus": {"PulseRate": 5.0 * number, **supply},
            "StarboardStatus": {"Speed": 37 * number - 1850, **supply},
        }.items():
            message = codec.get_message_by_name(name)
            yield message.frame_id, message.encode(values)


def _agree(blocks: list[ReadingBlock], columns: Columns) -> bool:
    """Times and values of speed, voltage and current, and of the commands."""
    reports = {"PortStatus": ("PulseRate", 60.0 / POLE_PAIRS), "StarboardStatus": ("Speed", 1.0)}
    commands = {"PortCommand": ("Pulse", -1500.0, 400.0), "StarboardCommand": ("Percent", 0.0, 100.0)}
    pairs = []
    for thruster, (message, (signal, factor)) in enumerate(reports.items(), 1):
        theirs = columns[message]
        wanted = [theirs[TIME], np.array(theirs[signal]) * factor, theirs["Voltage"], theirs["Current"]]
        pairs.append((_reported(blocks, thruster), wanted))
    for thruster, (message, (signal, offset, span)) in enumerate(commands.items(), 1):
        theirs = columns[message]
        pairs.append((_commanded(blocks, thruster), [theirs[TIME], (np.array(theirs[signal]) + offset) / span]))
    return all(np.allclose(ours, np.array(wanted), rtol=1e-12, atol=1e-12) for ours, wanted in pairs)


def _reported(blocks: list[ReadingBlock], thruster: int) -> NDArray[np.float64]:
    """(4, N) times, speeds, voltages and currents."""
    parts = [one for block in blocks for one in block.reports if one.thruster == thruster]
    return np.concatenate([[one.time_s, one.speed_rpm, one.voltage_v, one.current_a] for one in parts], axis=1)


def _commanded(blocks: list[ReadingBlock], thruster: int) -> NDArray[np.float64]:
    """(2, N) times and fractions."""
    parts = [one for block in blocks for one in block.commands if one.thruster == thruster]
    return np.concatenate([[one.time_s, one.fraction] for one in parts], axis=1)
