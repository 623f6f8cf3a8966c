"""A stretch of readings through the pipeline at once.

It comes to the same findings, byte for byte, as reading by reading: of what detectors say, only that goes through the
supervisor of which something may come (see `Supervisor.steady`).
"""

from __future__ import annotations

from bisect import bisect_left
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from operator import itemgetter
from typing import Any

import numpy as np

from detectors.verdict import Level
from gateway.stretches.alignment import aligned_stretch
from gateway.stretches.hearing import hearings
from gateway.stretches.parts import Happening, IndexArray, Parts, Said
from gateway.stretches.stretch import Stretch
from gateway.supervisor import Supervisor
from gateway.thruster_channel import JudgedColumns, ThrusterChannel
from gateway.timeline import TICKS_PER_S


def judge_stretch(stretch: Stretch, parts: Parts) -> Iterator[Any]:
    """Takes a stretch whose times go on from the last one, see `Timeline.passes`.

    Returns:
        What came of it. Of judgements, only those that may be news are among it.
    """
    reached_s = stretch.reached_s()  # a tick is due with the first reading behind it
    interval = np.floor(reached_s * TICKS_PER_S).astype(np.int64)
    judged, singles = aligned_stretch(stretch, parts)
    # it waits for the detectors, which may be in other processes
    tracks = [_Track(channel, columns, rank, interval[rank]) for channel, columns, rank in judged]
    for _, columns, _ in judged:
        parts.seen(columns)
    schedule: defaultdict[int, list[Happening]] = defaultdict(list)
    tracked = {track.subject for track in tracks}
    for rank, act in (*singles, *hearings(stretch, parts, interval, tracked)):
        schedule[int(interval[rank])].append((rank, act))
    for track in tracks:
        track.look_ahead(parts.supervisor)
    for now, first in zip(*np.unique(interval, return_index=True), strict=True):
        for tick_s in parts.timeline.ticks(float(reached_s[first])):
            yield from parts.tick(tick_s)
        for act in _in_order(schedule.pop(int(now), []), tracks, int(now), parts):
            yield from act()
        for track in tracks:
            track.look_ahead(parts.supervisor)
    if len(reached_s):
        parts.timeline.reach(float(reached_s[-1]))
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
        return self._observe(newest, parts) if newest > self._observed else ()

    def _observe(self, row: int, parts: Parts) -> Said:
        return parts.judged(self._judged.judgement(row))
