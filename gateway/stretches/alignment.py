"""A stretch through alignment and detectors, which give of columns what they would give of readings one by one."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from functools import partial
from itertools import repeat
from math import inf
from operator import itemgetter
from typing import Any, TypeAlias

import numpy as np

from drivers.reading_block import CommandColumns, ReportColumns
from drivers.readings import Reading, ThrusterCommand, ThrusterReport
from gateway.channel import Aligned, Channel, Source
from gateway.speed_channel import SpeedChannel
from gateway.stretches.parts import Happening, IndexArray, Parts
from gateway.stretches.stretch import RankedColumns, Stretch
from gateway.thrust import ThrustDemand, thrust
from gateway.thruster_channel import JudgedColumns, ThrusterChannel

Judged: TypeAlias = tuple[ThrusterChannel, JudgedColumns, IndexArray]  # and the rank of each judgement
Single: TypeAlias = tuple[int, str, Reading]  # rank, link, reading
Append: TypeAlias = Callable[[float, float], object]


def aligned_stretch(stretch: Stretch, parts: Parts) -> tuple[list[Judged], list[Happening]]:
    """All readings through alignment and detectors: thrusters' as columns, the others one by one.

    Returns:
        What was judged as columns, and what happens with all other readings. Detectors may still be at work.
    """
    columns = _routed(stretch, parts)
    singles = _singles(stretch, parts)
    judged: list[Judged] = []
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
    return judged, [
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


def _judged(channel: Channel[Any], several: Sequence[RankedColumns]) -> Judged | None:
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
