"""Recordings of ours: whole files, and what is in their chunks, for which a checksum stands in a file."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from mcap.opcode import Opcode
from mcap.reader import make_reader

from drivers.can.frame import CanFrame
from drivers.can.frame_block import FrameBlock
from drivers.logs.damage import DamageReport
from drivers.readings import AutopilotConflict, BusLoad, Lateness, LinkState, OperatorAct, OperatorRequest
from gateway.recording.chunk_reading import ChunkReader
from gateway.recording.entries import About, Entry, Frames
from gateway.recording.mending import mend
from gateway.recording.part_file import PartFile
from gateway.recording.reading import read_about, read_entries
from gateway.recording.waiting import Waiting
from gateway.recording.walk import chunk_content, records
from hil_tests.fuzz.files import as_file, written
from hil_tests.fuzz.target import Target, require

START_S = 1_600_000_000.0
NAME = "rov_20200913_122640_001.mcap"
TOKENS = (b"zstd", b"lz4", b"\x89MCAP0\r\n", b"\x06", b"\x05\x16\0\0\0\0\0\0\0", b"/can/can0", b"ros2msg")


def recording_targets() -> list[Target]:
    """Of files, and of what is in a chunk."""
    return [
        Target("recording", "recordings of the gateway, and what mending makes of them", _check_file, _files, TOKENS),
        Target("recording_chunk", "what is in the chunks of recordings", _check_chunk, _contents, TOKENS),
    ]


def _check_file(data: bytes) -> None:
    with as_file(data, NAME) as path:
        before = _read(path)
        _read_about(path)
        try:
            mended = mend(path)
        except ValueError:
            return
        after = _read(path)
        if mended and before is not None and after is not None:
            require(after == before, f"{len(before)} entries before it was mended, {len(after)} after")
            _open(path)


def _read(path: Path) -> list[str] | None:
    """All entries, as text; None where it is no recording."""
    damage = DamageReport()
    try:
        batches = read_entries(path, damage)
    except ValueError as error:
        require(str(path) in str(error), f"a refusal that does not name the file: {error}")
        return None
    entries = [one for batch in batches for one in batch]
    require(all(damage.lost.values()) and damage.lost.keys() == damage.places.keys(), f"{damage}")
    _require_frames(entries)
    return [_text(one) for one in entries]


def _text(entry: Entry) -> str:
    if isinstance(entry, Frames):
        return f"{entry.bus} {entry.place.tolist()} {list(entry.frames.frames())}"
    return repr(entry)


def _require_frames(entries: list[Entry]) -> None:
    """Each is made anew, so that it is checked."""
    for entry in entries:
        if isinstance(entry, Frames):
            require(len(entry.frames) == len(entry.place) > 0, "a block without frames")
            for f in entry.frames.frames():
                CanFrame(f.time_s, f.identifier, f.data, f.extended, f.fd, f.error)


def _read_about(path: Path) -> None:
    try:
        read_about(path)
    except ValueError as error:
        require(str(path) in str(error), f"a refusal that does not name the file: {error}")


def _open(path: Path) -> None:
    """As others do."""
    with path.open("rb") as stream:
        summary = make_reader(stream).get_summary()
    require(summary is not None and summary.statistics is not None, "no summary")


def _check_chunk(data: bytes) -> None:
    damage = DamageReport()
    entries = ChunkReader(0, damage).read(data, 0)
    _require_frames(entries)
    places = [one.place[0] if isinstance(one, Frames) else one.place for one in entries]
    require(places == sorted(places), f"places {places}")
    require(all(damage.lost.values()) and damage.lost.keys() == damage.places.keys(), f"{damage}")


def _files() -> list[bytes]:
    return [written(NAME, partial(_record, end=end)) for end in (True, False)]


def _contents() -> list[bytes]:
    with as_file(_files()[0], NAME) as path:
        return [chunk_content(one) for one in records(path, DamageReport()) if one.opcode == Opcode.CHUNK]


def _record(path: Path, end: bool) -> None:
    """Two chunks with a little of all that is replayed."""
    path.unlink()
    about = About("run", 1, START_S, "rov", "0", "", {"a.dbc": b"VERSION"}, b"state", resumed=False)
    file, journal = PartFile(path, about, 0), Waiting(lambda: START_S)
    for number in range(2):
        _second(journal, START_S + number)
        batch = journal.take(1 << 20)
        file.write(() if batch is None else batch.items)
    file.finish() if end else file.abandon()


def _second(journal: Waiting, time_s: float) -> None:
    for bus, fd in (("can0", False), ("can1", True)):
        frames = [CanFrame(time_s + 0.001 * one, 0x123 + one, bytes(one), fd=fd and one > 2) for one in range(6)]
        journal.frames(bus, FrameBlock.of(frames))
    journal.heard(b"\xfd\x09heard", time_s)
    for reading in (
        LinkState(time_s, "can0", True, "up"),
        BusLoad(time_s, "can0", 0.25),
        Lateness(time_s, 0.1, 2),
        OperatorRequest(time_s, OperatorAct.MUTE, 3, 0.0, 255, 190),
        AutopilotConflict(time_s, (1, 2)),
    ):
        journal.reading("can0", reading, 3)
    journal.said(b"\xfe\x01said", time_s)
    journal.now(time_s)
