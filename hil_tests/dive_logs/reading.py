"""Logs of one dive, of any kind that `gateway replay` reads, as one stream of pieces in the order of their times.

Which log is of which link, in which order logs follow each other, and how the clock of one runs beside that of
another is found out as a replay finds it. A clock that was set back while a log was written goes on, as there.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from heapq import merge
from math import inf
from operator import attrgetter
from pathlib import Path
from types import MappingProxyType

from drivers.can.frame_block import FrameBlock
from drivers.logs.can_log import open_can_log
from drivers.logs.damage import DamageReport
from drivers.logs.tlog import read_packets
from gateway.config import Config
from gateway.replay.clocks import TimedLog, on_one_clock
from gateway.replay.grouping import grouped
from gateway.replay.log_input import LogInput, LogKind, log_input
from gateway.replay.set_back import BACK_S
from hil_tests.dive_logs.autopilot_log import autopilot_pieces
from hil_tests.dive_logs.pieces import OnBus, OnLink, Piece

NO_OFFSETS: Mapping[Path, float] = MappingProxyType({})


class LoggedDive:
    """The logs of a dive; each iteration reads them anew, piece by piece.

    Args:
        logs: each `[LINK=]PATH`, as `gateway replay` takes them.
        config: whose links they are of.
        folder: what relative paths are relative to.
        offsets_s: by log, what is to be added to its times; those of others are found.

    Attributes:
        damage: of each log, what was lost of it when it was last read.

    Raises:
        OSError: a log cannot be read.
        ValueError: a log is not of its kind, or no link of the configuration could be in it, or logs do not go
            together.
    """

    def __init__(
        self,
        logs: Sequence[str],
        config: Config,
        folder: Path = Path(),
        offsets_s: Mapping[Path, float] = NO_OFFSETS,
    ) -> None:
        inputs = [located(log, config, folder) for log in logs]
        self._config = config
        self._logs = on_one_clock(grouped(inputs, config, offsets_s), config, offsets_s)
        self._has_frames = any(log.kind is LogKind.CAN for log in inputs)
        self.damage: dict[Path, DamageReport] = {}

    def __iter__(self) -> Iterator[Piece]:
        """All pieces, with the times of the logs' clock.

        Raises:
            OSError: a log cannot be read.
            ValueError: it is not of its kind.
        """
        yield from merge(*map(self._pieces, self._logs), key=attrgetter("time_s"))

    def _pieces(self, timed: TimedLog) -> Iterator[Piece]:
        """Of logs that follow each other."""
        clock = _Clock(timed)
        for log in timed.readings.logs:
            self.damage[log.path] = DamageReport()
            for piece in self._read(log, timed):
                yield clock.going_on(piece)

    def _read(self, log: LogInput, timed: TimedLog) -> Iterator[Piece]:
        damage = self.damage[log.path]
        match log.kind:
            case LogKind.CAN:
                return _frames(log, timed, damage)
            case LogKind.TLOG:
                batches = read_packets(log.path, damage)
                return (OnLink(time_s, packet) for batch in batches for time_s, packet in batch)
            case _:
                return autopilot_pieces(log, self._config, damage, buses=not self._has_frames)


class _Clock:
    """From the times of logs that follow each other to those of the dive, which never go back."""

    def __init__(self, timed: TimedLog) -> None:
        self._time_of = timed.time_of
        self._newest_s = -inf
        self._later_s = 0.0

    def going_on(self, piece: Piece) -> Piece:
        time_s = piece.time_s if self._time_of is None else self._time_of(piece.time_s)
        if time_s + self._later_s < self._newest_s - BACK_S:
            self._later_s = self._newest_s - time_s
        self._newest_s = max(self._newest_s, time_s + self._later_s)
        if isinstance(piece, OnLink):
            return OnLink(self._newest_s, piece.packet)
        return OnBus(self._newest_s, piece.frame, piece.bus)


def located(log: str, config: Config, folder: Path) -> LogInput:
    """A log that the user named.

    Args:
        log: `[LINK=]PATH`.
        config: whose links they are.
        folder: what a relative path is relative to.

    Raises:
        OSError: it cannot be read.
        ValueError: a link that there is none of.
    """
    link, equals, path = log.partition("=")
    links, whole = config.links(), folder / log
    if equals and (link in links or ((folder / path).exists() and not whole.exists())):
        return log_input(f"{link}={folder / path}", links)
    return log_input(str(whole), links)


def _frames(log: LogInput, timed: TimedLog, damage: DamageReport) -> Iterator[Piece]:
    """Frames of all interfaces that are buses of the configuration, part by part of the log."""
    part: dict[str, FrameBlock] = {}
    for interface, block in open_can_log(log.path, damage):
        bus = timed.readings.bus_of(interface, log)
        if bus is None:
            continue
        if bus.name in part:  # readers give a part of the log bus by bus
            yield from _in_order(part)
            part = {}
        part[bus.name] = block
    yield from _in_order(part)


def _in_order(part: Mapping[str, FrameBlock]) -> Iterator[Piece]:
    """The frames of several buses by their times; those of each bus stay in their order."""
    return merge(*(_on_bus(bus, block) for bus, block in part.items()), key=attrgetter("time_s"))


def _on_bus(bus: str, block: FrameBlock) -> Iterator[OnBus]:
    return (OnBus(frame.time_s, frame, bus) for frame in block.frames())
