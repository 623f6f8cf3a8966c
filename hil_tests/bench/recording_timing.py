"""Frames onto the disk: by the recorder, and by others who write them one by one."""

from __future__ import annotations

import shutil
import weakref
from collections.abc import Callable
from itertools import count
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import can
from mcap.reader import make_reader
from mcap.writer import Writer

from drivers.can.frame import CanFrame
from drivers.can.frame_block import FrameBlock
from drivers.logs.blf import read_blf
from drivers.logs.damage import DamageReport
from gateway.config_sections import Recording
from gateway.recording.entries import About, Frames
from gateway.recording.layouts import can_layout
from gateway.recording.reading import read_entries
from gateway.recording.scribe import Scribe
from gateway.recording.times import nanosecond
from gateway.recording.waiting import Waiting
from hil_tests.bench.recorded_traffic import BUSES, traffic
from hil_tests.bench.timing import Comparison

START_S = 1_700_000_000.0
SECONDS = 2.0
CHUNK_BYTES = 1 << 30
Write = Callable[[Path, list[CanFrame]], None]
# time in nanoseconds, identifier and data
Numbers = list[tuple[int, int, bytes]]


def beside_mcap(seconds: float = SECONDS) -> Comparison:
    """The mcap package's own writer, with the same messages in the same layout."""
    return _comparison("mcap Writer", ".mcap", _by_mcap, _mcap_frames, seconds)


def beside_blf(seconds: float = SECONDS) -> Comparison:
    """python-can's logger of Vector's format, which is packed, too."""
    return _comparison("python-can BLFWriter", ".blf", _by_python_can, _blf_frames, seconds)


def about() -> About:
    """A recording of nothing in particular."""
    return About("benchmark", 1, START_S, "benchmark", "0", "", {}, b"", resumed=False)


def settings(folder: Path) -> Recording:
    """Into this folder, and nothing is deleted."""
    return Recording.model_validate({"folder": folder, "keep_free_mb": 0.0})


def _by_mcap(path: Path, frames: list[CanFrame]) -> None:
    layout = can_layout(BUSES[0], fd=False)
    name = BUSES[0].encode() + b"\0"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema(layout.name, "ros2msg", layout.text.encode())
        channel = writer.register_channel("/can/can0", "cdr", schema)
        for number, one in enumerate(frames, 1):
            time_ns = nanosecond(one.time_s)
            stamp = divmod(time_ns, 10**9)
            flags = (False, one.extended, one.error, len(one.data))
            data = layout.encode([*stamp, len(name), name, one.identifier, *flags, one.data.ljust(8, b"\0")])
            writer.add_message(channel, time_ns, data, time_ns, number)
        writer.finish()  # type: ignore[no-untyped-call]


def _mcap_frames(path: Path) -> Numbers:
    with path.open("rb") as file:
        layout = can_layout(BUSES[0], fd=False)
        found = []
        for _, _, message in make_reader(file).iter_messages():
            *_, identifier, _, _, _, length, data = layout.decode(message.data)
            found.append((message.log_time, identifier, bytes(data[:length])))
        return found


def _by_python_can(path: Path, frames: list[CanFrame]) -> None:
    with can.BLFWriter(path, channel=1) as writer:
        for one in frames:
            writer.on_message_received(
                can.Message(
                    timestamp=one.time_s, arbitration_id=one.identifier, is_extended_id=one.extended, data=one.data
                )
            )


def _blf_frames(path: Path) -> Numbers:
    return [_numbers(one) for _, block in read_blf(path, DamageReport()) for one in block.frames()]


def _numbers(frame: CanFrame) -> tuple[int, int, bytes]:
    return nanosecond(frame.time_s), frame.identifier, frame.data


def _comparison(peer: str, suffix: str, write: Write, read: Callable[[Path], Numbers], seconds: float) -> Comparison:
    folder = Path(mkdtemp())
    blocks = [moment.frames[0] for moment in traffic(seconds, START_S)]
    frames = [one for block in blocks for one in block.frames()]
    numbers = count()

    def ours() -> Path:
        return _recorded(folder / f"ours{next(numbers)}", blocks)

    def theirs() -> Path:
        path = folder / f"theirs{next(numbers)}{suffix}"
        write(path, frames)
        return path

    def agree(recorded: Path, other: Path) -> bool:
        kept = [_numbers(one) for entry in _entries(recorded) for one in entry.frames.frames()]
        return len(kept) == len(frames) and _same(kept, read(other))

    weakref.finalize(ours, shutil.rmtree, folder)
    return Comparison("recording CAN frames", peer, "frame", len(frames), ours, theirs, agree)


def _recorded(folder: Path, blocks: list[FrameBlock]) -> Path:
    journal = Waiting(lambda: START_S)
    for block in blocks:
        journal.frames(BUSES[0], block)
    scribe = Scribe(settings(folder), about(), lambda: START_S)
    batch = journal.take(CHUNK_BYTES)
    scribe.write(() if batch is None else batch.items)
    scribe.close()
    return scribe.path or folder


def _entries(path: Path) -> list[Any]:
    return [one for entries in read_entries(path, DamageReport()) for one in entries if isinstance(one, Frames)]


def _same(ours: Numbers, theirs: Numbers) -> bool:
    """Identifiers and data, and times to the microsecond: that is what some formats have."""
    near = all(abs(one[0] - other[0]) < 2000 for one, other in zip(ours, theirs, strict=False))
    return near and [one[1:] for one in ours] == [one[1:] for one in theirs]
