"""Entries of a recording in stretches, in the order in which they were judged.

What a run told its pipeline of itself (how late it is, say) was judged in front of what had waited longest by then,
but was written down behind it. So a stretch is given out only when what follows for a while was read, too.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from math import inf

from gateway.recording.entries import Entry, Found, Frames, Told

# a run that is later than this with its judging is not told apart from one that is just as late
AHEAD_S = 10.0


@dataclass(frozen=True, slots=True)
class _Chunk:
    """Entries, the first place of them, and the newest time by their end."""

    entries: list[Entry]
    first: float
    newest_s: float


def in_stretches(
    chunks: Iterable[Sequence[Entry]], length_s: float, ahead_s: float = AHEAD_S
) -> Iterator[list[Entry]]:
    """The same entries in stretches of about so many seconds.

    Args:
        chunks: each behind the one before by the places, but for what was judged in front.
        length_s: of a stretch, by the times of the recording.
        ahead_s: so much is read before a stretch is given out; what belongs into it and comes later still is at the
            beginning of a later one.
    """
    waiting: list[_Chunk] = []
    begin_s, newest_s = inf, -inf
    for entries in chunks:
        times_s = [_newest_s(entry) for entry in entries]
        begin_s, newest_s = min([begin_s, *times_s]), max([newest_s, *(one for one in times_s if one < inf)])
        waiting.append(_Chunk([], min(map(_first, entries), default=inf), newest_s))
        for entry in entries:
            _chunk_of(entry, waiting).entries.append(entry)
        ready = sum(chunk.newest_s <= newest_s - ahead_s for chunk in waiting)
        if ready and waiting[ready - 1].newest_s - begin_s >= length_s:
            begin_s = waiting[ready - 1].newest_s
            yield [entry for chunk in waiting[:ready] for entry in chunk.entries]
            del waiting[:ready]
    yield [entry for chunk in waiting for entry in chunk.entries]


def _chunk_of(entry: Entry, waiting: Sequence[_Chunk]) -> _Chunk:
    """The one that it was judged with: the newest, unless it was judged in front."""
    if not isinstance(entry, Told) or entry.before is None:
        return waiting[-1]
    return next((chunk for chunk in reversed(waiting) if chunk.first <= entry.before), waiting[0])


def _first(entry: Entry) -> float:
    if isinstance(entry, Frames):
        return float(entry.place[0]) if len(entry.place) else inf
    return entry.place


def _newest_s(entry: Entry) -> float:
    """Infinity: it has no time of its own."""
    match entry:
        case Frames(frames=frames):
            return float(frames.time_s.max()) if len(frames) else inf
        case Told() | Found():
            return inf
    return entry.time_s
