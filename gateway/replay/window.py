"""A part of a dive: all before it is learnt from, and not told of; what comes after it is not read."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from math import inf

import numpy as np

from drivers.reading_block import ReadingBlock
from gateway.stretches.stretch import BlockArrival

_SINCE = re.compile(r"(?:(?:(\d{1,9}):)?(\d{1,9}):)?(\d{1,9}(?:\.\d{1,9})?)", re.ASCII)
_CLOCK = re.compile(r"(?:(\d{4}-\d\d-\d\d)[T ])?([01]\d|2[0-3]):([0-5]\d)(?::([0-5]\d(?:\.\d+)?))?Z", re.ASCII)
WANTED = "want the time since the beginning, as 90, 5:00 or 1:02:03, or the clock's, as 14:05:00Z"


@dataclass(frozen=True, slots=True)
class Instant:
    """A time of a dive, as a user says it.

    Attributes:
        since_s: since the beginning; or, where there is a clock, of the day.
        clock: it is by UTC; day: of a certain day (unix seconds of its beginning), else of that of the beginning, or
            the day after.
    """

    since_s: float
    clock: bool = False
    day: float | None = None

    @staticmethod
    def of(text: str) -> Instant:
        """What a user wrote.

        Raises:
            ValueError: it is neither.
        """
        since, clock = _SINCE.fullmatch(text), _CLOCK.fullmatch(text)
        if since is not None:
            return Instant(_seconds(*since.groups()))
        if clock is None:
            raise ValueError(f"{text!r}: {WANTED}")
        day, *time = clock.groups()
        try:
            begin_s = None if day is None else datetime.fromisoformat(day).replace(tzinfo=UTC).timestamp()
        except ValueError as error:
            raise ValueError(f"{text!r}: {error}; {WANTED}") from error
        return Instant(_seconds(*time), True, begin_s)

    def after(self, begin_s: float) -> float:
        """When that is in a dive that begins then."""
        if not self.clock:
            return begin_s + self.since_s
        if self.day is not None:
            return self.day + self.since_s
        midnight_s = begin_s - begin_s % 86_400.0
        time_s = midnight_s + self.since_s
        return time_s if time_s >= begin_s else time_s + 86_400.0


def _utc(time_s: float) -> str:
    try:
        return f"{datetime.fromtimestamp(time_s, UTC):%Y-%m-%dT%H:%M:%SZ}"
    except (ValueError, OverflowError, OSError):  # by a clock that was never set
        return f"second {time_s:g} of its clock"


def _seconds(hours: str | None, minutes: str | None, seconds: str | None) -> float:
    return 3600.0 * float(hours or 0) + 60.0 * float(minutes or 0) + float(seconds or 0)


@dataclass(frozen=True, slots=True)
class Window:
    """From when to when is told; None: from the beginning, to the end."""

    begin: Instant | None = None
    end: Instant | None = None

    @property
    def whole(self) -> bool:
        """Whether it is all."""
        return self.begin is None and self.end is None

    def of(self, begin_s: float) -> Span:
        """Of a dive that begins then.

        Raises:
            ValueError: the end is not after the beginning, of the part or of the dive.
        """
        from_s = -inf if self.begin is None else self.begin.after(begin_s)
        to_s = inf if self.end is None else self.end.after(begin_s)
        if not begin_s < to_s:
            raise ValueError(f"--to: want it to be after {_utc(begin_s)}, when the dive begins")
        if not from_s < to_s:
            raise ValueError(f"--from lies {from_s - to_s:.1f} s behind --to: want it to be before")
        return Span(from_s, to_s)


@dataclass(frozen=True, slots=True)
class Span:
    """From a time on until another."""

    from_s: float
    to_s: float

    def parts(
        self, arrivals: Sequence[BlockArrival]
    ) -> tuple[list[BlockArrival], list[BlockArrival], list[BlockArrival]]:
        """What of a stretch is before it, in it and after it."""
        before, rest = cut(arrivals, self.from_s)
        inside, after = cut(rest, self.to_s)
        return before, inside, after


def cut(arrivals: Sequence[BlockArrival], time_s: float) -> tuple[list[BlockArrival], list[BlockArrival]]:
    """A stretch in two, from the first reading of that time or later on."""
    place = _first_place(arrivals, time_s)
    halves = [(one, one.readings.split(_row(one, time_s, place))) for one in arrivals]
    before, after = (
        [BlockArrival(one.link, half[number], one.place) for one, half in halves if half[number]] for number in (0, 1)
    )
    return before, after


def _first_place(arrivals: Sequence[BlockArrival], time_s: float) -> float:
    """Of the readings of that time or later, where they have places."""
    first = inf
    for one in arrivals:
        if one.place is not None:
            rows, times_s = one.readings.times()
            first = min(first, float(one.place[rows[times_s >= time_s]].min(initial=inf)))
    return first


def _row(arrival: BlockArrival, time_s: float, place: float) -> int:
    block: ReadingBlock = arrival.readings
    if arrival.place is not None:
        return int(np.searchsorted(arrival.place, place))
    rows, times_s = block.times()
    first = int(np.searchsorted(np.fmax.accumulate(times_s), time_s)) if len(rows) else 0
    return int(rows[first]) if first < len(rows) else block.rows
