"""A stretch of readings through the pipeline at once: what replay does in place of reading by reading.

It comes to the same findings, byte for byte: alignment and detectors take columns and give what they would give one
by one; and of what they say, only that goes through the supervisor of which something may come (see
`Supervisor.steady`). What was heard without a gap is told to the silence watch once, not thousands of times.
"""

from __future__ import annotations

from bisect import bisect_left
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import repeat
from math import inf
from operator import itemgetter
from typing import Any, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray

from detectors.verdict import Level
from drivers.reading_block import CommandColumns, ReportColumns
from drivers.readings import LinkState, Reading, ThrusterCommand, ThrusterReport
from gateway.channel import Aligned, Channel, Judgement, Source
from gateway.silence import SilenceWatch
from gateway.speed_channel import SpeedChannel
from gateway.stretch import RankedColumns, Stretch
from gateway.supervisor import Supervisor
from gateway.thrust import ThrustDemand, thrust
from gateway.thruster_channel import JudgedColumns, ThrusterChannel
from gateway.timeline import TICKS_PER_S, Timeline

IndexArray: TypeAlias = NDArray[np.intp]
FloatArray: TypeAlias = NDArray[np.float64]
Taken: TypeAlias = tuple[tuple[Channel[Any], Aligned], ...]
Single: TypeAlias = tuple[int, str, Reading]  # rank, link, reading
Said: TypeAlias = Iterable[Any]
Append: TypeAlias = Callable[[float, float], object]
_Judged: TypeAlias = tuple[ThrusterChannel, JudgedColumns, IndexArray]  # and the rank of each judgement
Happening: TypeAlias = tuple[int, Callable[[], Said]]  # rank of the reading, what then happens

_NOTHING: tuple[()] = ()


class Hear(Protocol):
    """Of the silence watch, for one link or signal."""

    def __call__(self, time_s: float, *, until_s: float) -> None:
        """See `SilenceWatch.hear_link`."""
        ...


@dataclass(frozen=True, slots=True)
class Parts:
    """What a stretch goes through: the pipeline's own parts.

    Attributes:
        timeline, silence, supervisor: see there.
        channels: all of them; routes: those of each source, in the same order.
        hear: takes a reading, and what it did to the channels; judged: a judgement; tick: the time of a tick.
        drops: counted here by cause.
    """

    timeline: Timeline
    silence: SilenceWatch
    supervisor: Supervisor
    channels: Sequence[Channel[Any]]
    routes: Mapping[Source, Sequence[Channel[Any]]]
    hear: Callable[[str, Reading, Taken], Said]
    judged: Callable[[Judgement], Said]
    tick: Callable[[float], Said]
    drops: Counter[str]


def judge_stretch(stretch: Stretch, parts: Parts) -> Iterator[Any]:
    """Takes a stretch whose times go on from the last one, see `Timeline.passes`.

    Returns:
        What came of it. Of judgements, only those that may be news are among it.
    """
    interval = np.floor(stretch.time_s * TICKS_PER_S).astype(np.int64)
    tracks, singles = _aligned(stretch, parts, interval)
    schedule: defaultdict[int, list[Happening]] = defaultdict(list)
    tracked = {track.subject for track in tracks}
    for rank, act in (*singles, *_hearings(stretch, parts, interval, tracked)):
        schedule[int(interval[rank])].append((rank, act))
    for track in tracks:
        track.look_ahead(parts.supervisor)
    for now, first in zip(*np.unique(interval, return_index=True), strict=True):
        for tick_s in parts.timeline.ticks(float(stretch.time_s[first])):
            yield from parts.tick(tick_s)
        for act in _in_order(schedule.pop(int(now), []), tracks, int(now), parts):
            yield from act()
        for track in tracks:
            track.look_ahead(parts.supervisor)
    for track in tracks:
        yield from track.last(parts)


def _in_order(
    happening: list[Happening], tracks: Iterable[_Track], interval: int, parts: Parts
) -> list[Callable[[], Said]]:
    """What happens in an interval between two ticks."""
    for track in tracks:
        if track.due is not None and track.due <= interval:
            happening += track.happenings(interval, parts)
    happening.sort(key=itemgetter(0))  # stable: a link is heard before its reading does something
    return [act for _, act in happening]


class _Track:
    """The judgements of one thruster in a stretch, of which those are taken that may be news.

    Attributes:
        subject: of the findings.
        due: interval of the next that may be; None: none may.
    """

    def __init__(
        self, channel: ThrusterChannel, judged: JudgedColumns, rank: IndexArray, interval: IndexArray
    ) -> None:
        self.subject, self._judged = channel.subject, judged
        if len(rank):
            channel.newest = judged.judgement(len(rank) - 1)
        self._rank, self._interval = rank.tolist(), interval.tolist()
        level = judged.verdicts.level
        self._others = {calm: np.flatnonzero(level != calm).tolist() for calm in (Level.UNKNOWN, Level.NORMAL)}
        self._next = 0
        self._looked = self._observed = -1
        self.due: int | None = None

    def look_ahead(self, supervisor: Supervisor) -> None:
        """Passes over judgements that only say again what is so."""
        if self._looked == self._next:
            return
        end = len(self._rank)
        if self._next < end:
            time_s = float(self._judged.samples.time_s[self._next])
            for calm, others in self._others.items():
                if supervisor.steady(self.subject, time_s, calm):
                    place = bisect_left(others, self._next)
                    self._next = others[place] if place < len(others) else end
        self._looked = self._next
        self.due = self._interval[self._next] if self._next < end else None

    def happenings(self, interval: int, parts: Parts) -> Iterator[Happening]:
        """What is to be observed in an interval."""
        while self._next < len(self._rank) and self._interval[self._next] <= interval:
            yield self._rank[self._next], partial(self._observe, self._next, parts)
            self._observed = self._next
            self._next += 1

    def last(self, parts: Parts) -> Said:
        """The newest of the stretch, where it was passed over: what is seen of a subject is its newest judgement."""
        newest = len(self._rank) - 1
        return self._observe(newest, parts) if newest > self._observed else _NOTHING

    def _observe(self, row: int, parts: Parts) -> Said:
        return parts.judged(self._judged.judgement(row))


# Alignment ------------------------------------------------------------------------------------------


def _aligned(stretch: Stretch, parts: Parts, interval: IndexArray) -> tuple[list[_Track], list[Happening]]:
    """All readings through alignment and detectors: thrusters' as columns, the others one by one."""
    columns = _routed(stretch, parts)
    singles = _singles(stretch, parts)
    judged: list[_Judged] = []
    taken: defaultdict[int, list[tuple[Channel[Any], Aligned]]] = defaultdict(list)
    heard: dict[int, Single] = {single[0]: single for single in stretch.others}
    for channel in parts.channels:
        several, few = columns[channel.subject], singles[channel.subject]
        whole = None if few else _judged(channel, several)
        if whole is not None:
            judged.append(whole)
            continue
        for single, aligned in _one_by_one(channel, several, few):
            taken[single[0]].append((channel, aligned))
            heard[single[0]] = single
        channel.judge()
    # only now, for it waits for the detectors, which may be in other processes
    tracks = [_Track(channel, columns, rank, interval[rank]) for channel, columns, rank in judged]
    return tracks, [
        (rank, partial(parts.hear, link, reading, tuple(taken[rank]))) for rank, link, reading in heard.values()
    ]


def _one_by_one(
    channel: Channel[Any], several: Sequence[RankedColumns], few: Sequence[Single]
) -> Iterator[tuple[Single, Aligned]]:
    """Aligns readings in their order; gives those that did something."""
    if isinstance(channel, SpeedChannel):
        yield from _with_commands(channel, several, few)
        return
    for single in sorted([*few, *(one for part in several for one in part.readings())], key=itemgetter(0)):
        aligned = channel.align(single[2])
        if aligned.samples or aligned.signal is not None:
            yield single, aligned


def _with_commands(
    channel: SpeedChannel, several: Sequence[RankedColumns], few: Sequence[Single]
) -> Iterator[tuple[Single, Aligned]]:
    """The same where commands, which are many, only have to be held until something else comes."""
    commands = sorted((command for one in several for command in _thrusts(channel.demand, one)), key=itemgetter(0))
    waiting = iter([*commands, (inf, 0.0, 0.0, None)])
    rank, time_s, value, append = next(waiting)
    for single in few:
        while append is not None and rank < single[0]:
            append(time_s, value)
            rank, time_s, value, append = next(waiting)
        yield single, channel.align(single[2])
    while append is not None:
        append(time_s, value)
        rank, time_s, value, append = next(waiting)


def _thrusts(demand: ThrustDemand, one: RankedColumns) -> Iterable[tuple[int, float, float, Append]]:
    columns = one.columns
    if not isinstance(columns, CommandColumns):
        return ()
    append = demand.held(columns.thruster).append
    values = thrust(columns.fraction).tolist()
    return zip(one.rank.tolist(), columns.time_s.tolist(), values, repeat(append), strict=False)


def _routed(stretch: Stretch, parts: Parts) -> defaultdict[str, list[RankedColumns]]:
    """Columns by the subjects of the channels that they are for."""
    routed: defaultdict[str, list[RankedColumns]] = defaultdict(list)
    for one in stretch.columns:
        channels = parts.routes.get(one.source, ())
        if not channels:
            parts.drops["not the configured source"] += len(one.rank)
        for channel in channels:
            routed[channel.subject].append(one)
    return routed


def _singles(stretch: Stretch, parts: Parts) -> defaultdict[str, list[Single]]:
    """The other readings, likewise."""
    routed: defaultdict[str, list[Single]] = defaultdict(list)
    for rank, link, reading in stretch.others:
        thruster = reading.thruster if isinstance(reading, ThrusterCommand | ThrusterReport) else None
        channels = parts.routes.get(Source(link, type(reading), thruster), ())
        if thruster is not None and not channels:
            parts.drops["not the configured source"] += 1
        for channel in channels:
            routed[channel.subject].append((rank, link, reading))
    return routed


def _judged(channel: Channel[Any], several: Sequence[RankedColumns]) -> _Judged | None:
    """A thruster's judgements, and the ranks of their readings, where those may be taken as columns."""
    if not (several and isinstance(channel, ThrusterChannel)):
        return None
    empty = np.empty(0)
    none = np.empty(0, dtype=np.intp)
    commands, command_rank = CommandColumns(0, none, empty, empty), none
    reports, report_rank = ReportColumns(0, none, *[empty] * 6), none
    for one in several:
        if isinstance(one.columns, CommandColumns):
            commands, command_rank = one.columns, one.rank
        else:
            reports, report_rank = one.columns, one.rank
    judged = channel.judge_columns(commands, reports, np.searchsorted(command_rank, report_rank))
    return None if judged is None else (channel, judged, report_rank[judged.samples.report])


# Hearing --------------------------------------------------------------------------------------------


def _hearings(stretch: Stretch, parts: Parts, interval: IndexArray, tracked: Collection[str]) -> Iterator[Happening]:
    """What the silence watch hears: links, and the signals of what was taken as columns."""
    spoken = np.ones(len(stretch.time_s), dtype=bool)  # but for what the driver says of a link
    spoken[[rank for rank, _, reading in stretch.others if isinstance(reading, LinkState)]] = False
    for number, link in enumerate(stretch.links):
        hear = partial(parts.silence.hear_link, link)
        rank = np.flatnonzero((stretch.link == number) & spoken)
        yield from _heard(hear, rank, stretch.time_s[rank], interval[rank], parts.silence.patience_s(link))
    for one in stretch.columns:
        for channel in parts.routes.get(one.source, ()):
            if isinstance(channel, ThrusterChannel) and channel.subject in tracked:
                yield from _signals_heard(one, channel, parts.silence, interval)


def _signals_heard(
    one: RankedColumns, channel: ThrusterChannel, silence: SilenceWatch, interval: IndexArray
) -> Iterator[Happening]:
    columns, every = one.columns, np.ones(len(one.rank), dtype=bool)
    measured = every if isinstance(columns, CommandColumns) else ~np.isnan(columns.speed_rpm)
    for rows, with_speed in ((measured, True), (~measured, False)):
        signal = channel.signal_of(one.source.kind, with_speed)
        if signal is not None:
            rank = one.rank[rows]
            hear = partial(silence.hear_signal, signal)
            patience_s = silence.patience_s(one.source.link, signal)
            yield from _heard(hear, rank, columns.time_s[rows], interval[rank], patience_s)


def _heard(
    hear: Hear, rank: IndexArray, time_s: FloatArray, interval: IndexArray, patience_s: float
) -> Iterator[Happening]:
    """From the first to the last time in each interval; where nobody would notice a gap, in all of them together."""
    if not len(rank):
        return
    if len(rank) == 1 or float(np.diff(time_s).max()) < patience_s:
        firsts = np.zeros(1, dtype=np.intp)
    else:
        firsts = np.flatnonzero(np.diff(interval, prepend=interval[0] - 1))
    lasts = np.append(firsts[1:], len(rank)) - 1
    for first, last in zip(firsts.tolist(), lasts.tolist(), strict=True):
        yield int(rank[first]), partial(_hear_from, hear, float(time_s[first]), float(time_s[last]))


def _hear_from(hear: Hear, first_s: float, last_s: float) -> tuple[()]:
    hear(first_s, until_s=last_s)
    return _NOTHING
