"""Logs of one dive, each by the clock of who wrote it, on one time line."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from math import inf
from operator import add
from pathlib import Path

from gateway.config import Config
from gateway.replay.log_clocks import log_offset
from gateway.replay.log_readings import LogReadings
from gateway.replay.log_trace import LogTrace
from gateway.replay.set_back import Blocks

# of a log, what its clock is found by: long enough to see it drift
TRACE_S = 900.0


@dataclass(frozen=True, slots=True)
class TimedLog:
    """A log whose times are changed to those of another one's clock.

    Attributes:
        readings: of the log.
        time_of: a time of the log by that clock; None: they stay.
        remark: for the summary, how it was found; empty where there is nothing to say.
    """

    readings: LogReadings
    time_of: Callable[[float], float] | None = None
    remark: str = ""

    def __iter__(self) -> Blocks:
        """Link and readings."""
        for link, block in self.readings:
            yield link, block if self.time_of is None else block.moved(self.time_of)


def on_one_clock(logs: Sequence[LogReadings], config: Config, given_s: Mapping[Path, float]) -> list[TimedLog]:
    """The logs with their times as the first one's that has unix times, or else as the first one's.

    Args:
        logs: of one dive.
        config: where commands and speeds are.
        given_s: by log, seconds that are to be added to its times; these are not looked for.

    Raises:
        OSError: a log cannot be read.
        ValueError: a log counts from some start of its own, or at another time than the others, and nothing shows
            by how much it is off.
    """
    reference = next((one for one in logs if one.unix and not _given(one, given_s)), logs[0])
    beginning: _Beginning | None = None
    timed = []
    for one in logs:
        if one is not reference and not _given(one, given_s) and _comparable(one, reference, config):
            beginning = beginning or _beginning(reference)
            timed.append(_found(one, beginning))
        else:
            timed.append(_as_given(one, given_s))
    _check(timed, reference)
    return timed


def _given(log: LogReadings, given_s: Mapping[Path, float]) -> bool:
    return any(one.path in given_s for one in log.logs)


def _as_given(log: LogReadings, given_s: Mapping[Path, float]) -> TimedLog:
    for one in log.logs:
        if one.path in given_s:
            return TimedLog(log, partial(add, given_s[one.path]), f"{given_s[one.path]:+.3f} s, as given")
    return TimedLog(log)


def _comparable(log: LogReadings, reference: LogReadings, config: Config) -> bool:
    """Whether both can have commands or speeds of one thruster: where command and speed of it come over two links."""
    mixed = any(thruster.command.link != thruster.rpm.link for thruster in config.thruster)
    return mixed or not (log.unix and reference.unix)


@dataclass(frozen=True, slots=True)
class _Beginning:
    """What the first minutes of a log show.

    Attributes:
        trace: of them.
        begin_s, end_s: of the log; infinity where it goes on behind them.
    """

    trace: LogTrace
    begin_s: float
    end_s: float

    def apart(self, other: _Beginning) -> bool:
        """Whether one ends before the other begins."""
        return self.end_s < other.begin_s or other.end_s < self.begin_s


def _beginning(log: LogReadings) -> _Beginning:
    trace, begin_s, end_s = LogTrace(), inf, -inf
    for _, block in log.again():
        times_s = block.times()[1]
        begin_s, end_s = min(begin_s, float(times_s[0])), max(end_s, float(times_s[-1]))
        trace.take_block(block)
        if times_s[0] > begin_s + TRACE_S:
            return _Beginning(trace, begin_s, inf)
    return _Beginning(trace, begin_s, end_s)


def _found(log: LogReadings, reference: _Beginning) -> TimedLog:
    own = _beginning(log)
    offset = log_offset(reference.trace, own.trace)
    if offset is None:
        if log.unix and own.apart(reference):  # of others, see `_check`
            raise ValueError(
                f"{_name(log)} has no time in common with the other log, and nothing in both shows by how much its"
                f" clock is off: {_way_out(log)}"
            )
        return TimedLog(log, None, "compared, and taken as it is: nothing in both logs shows an offset")
    drift = f", {1e6 * offset.drift:+.0f} ppm" if offset.drift else ""
    return TimedLog(
        log, offset.time_s, f"{offset.offset_s:+.3f} s{drift}, by {offset.found_by} of {offset.overlap_s:.0f} s"
    )


def _check(timed: Sequence[TimedLog], reference: LogReadings) -> None:
    """A log that counts from its own start cannot be laid beside others as it is."""
    for one in timed:
        if one.time_of is None and one.readings is not reference and not (one.readings.unix and reference.unix):
            raise ValueError(
                f"{_name(one.readings)} counts from a start of its own, and nothing shows when that was:"
                f" {_way_out(one.readings)}"
            )


def _name(log: LogReadings) -> str:
    return str(log.logs[0].path)


def _way_out(log: LogReadings) -> str:
    return f"--offset {_name(log)}=SECONDS"
