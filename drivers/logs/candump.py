"""Logs of can-utils' candump: its files (`candump -l`), and what it prints with times (`-ta`, `-tA`, `-tz`, `-td`).

Lines in the form of the files are read many at once, all others one by one. A damaged line is noted with its number
and the cause; the lines after it are read as if it were not there, and so is one that begins within it, where a line
end or a whole page of the disk was lost.

Times of `-tz` and `-td` have no epoch: they start at 0. A date (`-tA`) has no time zone and is taken for UTC.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from drivers.can.frame_block import FloatArray, FrameBlock
from drivers.logs.candump_columns import read_regular
from drivers.logs.candump_line import has_epoch, read_line
from drivers.logs.damage import DamagedRecordError, DamageReport
from drivers.logs.frame_text import LoggedFrame
from drivers.logs.line_frames import LineFrames
from drivers.logs.text_log import TextChunk, check_kind, text_chunks

_MICROSECONDS = 1e6
_BEGINS = re.compile(rb"\((\d{1,10}\.\d{1,9}|\d{4}-\d\d-\d\d [\d:]{8}\.\d{1,9})\)[ \x1b]")
_DROPPED = re.compile(rb"DROPCOUNT: dropped (\d{1,10}) CAN frames? on ")


def is_candump(head: bytes) -> bool:
    """True if a line of a candump log is in the beginning of a file."""
    return _BEGINS.search(head) is not None


def read_candump(path: Path, damage: DamageReport) -> Iterator[tuple[str, FrameBlock]]:
    """Name of an interface and some of its frames, again and again, each interface's in the order of the log.

    Args:
        path: the log, gzip or not.
        damage: told what is lost: damaged lines, remote and CAN XL frames, and those that candump itself missed.

    Raises:
        OSError: the file cannot be read.
        ValueError: it is no candump log; an empty one, or one of zeros, has no frames.
    """
    check_kind(path, "candump log", is_candump)
    return _blocks(path, damage)


def _blocks(path: Path, damage: DamageReport) -> Iterator[tuple[str, FrameBlock]]:
    clock = _RelativeClock()
    for chunk in text_chunks(path, damage):
        for interface, block in _read_chunk(chunk, clock, damage):
            damage.records += len(block)
            yield interface, block


def _read_chunk(chunk: TextChunk, clock: _RelativeClock, damage: DamageReport) -> Iterator[tuple[str, FrameBlock]]:
    frames = LineFrames(len(chunk.ends))
    relative = []
    for row in read_regular(chunk, frames).tolist():
        logged = _read_irregular(chunk.line(row), chunk.first_line + row, damage)
        if logged is not None:
            frames.put(row, logged.interface, logged.frame)
            if logged.relative:
                relative.append(row)
    if relative:
        frames.time_s[relative] = clock.since_start(frames.time_s[relative])
    return frames.blocks()


def _read_irregular(line: bytes, number: int, damage: DamageReport) -> LoggedFrame | None:
    """The frame of a line, if it has one; what is lost is noted."""
    if not line.strip() or line.startswith(b"\t"):  # `-e` explains an error frame on lines of its own
        return None
    if dropped := _DROPPED.match(line):
        damage.add("dropped before they were logged", f"line {number}", int(dropped[1]))
        return None
    try:
        return read_line(line)
    except DamagedRecordError as error:
        damage.add(str(error), f"line {number}")
        return _begun_within(line)


def _begun_within(line: bytes) -> LoggedFrame | None:
    """The frame of a whole line at the end of a damaged one."""
    begin = line.rfind(b"(")
    if begin < 1 or not has_epoch(line[begin:]):
        return None
    try:
        return read_line(line[begin:])
    except DamagedRecordError:
        return None


class _RelativeClock:
    """Times of `-tz` and `-td` to times since the first frame.

    Both are written alike. Those since the first frame hardly ever fall; of those since the frame before, about every
    second is less than its forerunner. The first lines decide for the whole log.
    """

    def __init__(self) -> None:
        self._since_previous: bool | None = None
        self._last_ticks = 0

    def since_start(self, time_s: FloatArray) -> FloatArray:
        """(N,) seconds since the first frame."""
        if self._since_previous is None:
            self._since_previous = 10 * int((np.diff(time_s) < 0.0).sum()) > len(time_s)
        if not self._since_previous:
            return time_s
        ticks = self._last_ticks + np.cumsum(np.rint(time_s * _MICROSECONDS).astype(np.int64))
        self._last_ticks = int(ticks[-1])
        seconds: FloatArray = ticks / _MICROSECONDS
        return seconds
