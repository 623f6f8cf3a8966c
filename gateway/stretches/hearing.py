"""What the silence watch hears in a stretch: once what came without a gap, and not thousands of times."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from functools import partial
from typing import Protocol

import numpy as np

from drivers.reading_block import CommandColumns
from drivers.readings import LinkState
from gateway.silence import SilenceWatch
from gateway.stretches.parts import FloatArray, Happening, IndexArray, Parts
from gateway.stretches.stretch import RankedColumns, Stretch
from gateway.thruster_channel import ThrusterChannel


class Hear(Protocol):
    """Of the silence watch, for one link or signal."""

    def __call__(self, time_s: float, *, until_s: float) -> None:
        """See `SilenceWatch.hear_link`."""
        ...


def hearings(stretch: Stretch, parts: Parts, interval: IndexArray, tracked: Collection[str]) -> Iterator[Happening]:
    """What the silence watch hears: links, and the signals of what was taken as columns."""
    spoken = np.ones(len(stretch.time_s), dtype=bool)  # but for what the driver says of a link
    spoken[[rank for rank, _, reading in stretch.others if isinstance(reading, LinkState)]] = False
    reached_s = stretch.reached_s()
    for number, link in enumerate(stretch.links):
        hear = partial(parts.silence.hear_link, link)
        rank = np.flatnonzero((stretch.link == number) & spoken)
        newest_s = np.maximum.accumulate(stretch.time_s[rank])  # what comes late is no news
        unheard_s = _unheard_s(newest_s, reached_s[rank])
        yield from _heard(hear, rank, newest_s, interval[rank], unheard_s < parts.silence.patience_s(link))
    for one in stretch.columns:
        for channel in parts.routes.get(one.source, ()):
            if isinstance(channel, ThrusterChannel) and channel.subject in tracked:
                yield from _signals_heard(one, channel, parts.silence, interval, reached_s)


def _signals_heard(
    one: RankedColumns, channel: ThrusterChannel, silence: SilenceWatch, interval: IndexArray, reached_s: FloatArray
) -> Iterator[Happening]:
    columns, every = one.columns, np.ones(len(one.rank), dtype=bool)
    measured = every if isinstance(columns, CommandColumns) else ~np.isnan(columns.speed_rpm)
    for rows, with_speed in ((measured, True), (~measured, False)):
        signal = channel.signal_of(one.source.kind, with_speed)
        if signal is not None:
            rank, time_s = one.rank[rows], columns.time_s[rows]
            hear = partial(silence.hear_signal, signal)
            unnoticed = _unheard_s(time_s, reached_s[rank]) < silence.patience_s(one.source.link, signal)
            yield from _heard(hear, rank, time_s, interval[rank], unnoticed)


def _unheard_s(time_s: FloatArray, reached_s: FloatArray) -> float:
    """For how long nothing of it was there, at the most, as a tick may have seen it. Of (N,) times, ascending.

    Args:
        time_s: when it came.
        reached_s: the newest time of all by then.
    """
    return float((reached_s[1:] - time_s[:-1]).max(initial=0.0))


def _heard(
    hear: Hear, rank: IndexArray, time_s: FloatArray, interval: IndexArray, unnoticed: bool
) -> Iterator[Happening]:
    """From the first to the last time in each interval; where nobody would notice a gap, in all of them together."""
    if not len(rank):
        return
    changes = np.diff(interval, prepend=interval[0] - 1)
    firsts = np.zeros(1, dtype=np.intp) if unnoticed else np.flatnonzero(changes)
    lasts = np.append(firsts[1:], len(rank)) - 1
    for first, last in zip(firsts.tolist(), lasts.tolist(), strict=True):
        yield int(rank[first]), partial(_hear_from, hear, float(time_s[first]), float(time_s[last]))


def _hear_from(hear: Hear, first_s: float, last_s: float) -> tuple[()]:
    hear(first_s, until_s=last_s)
    return ()
