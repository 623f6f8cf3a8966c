"""A stretch of time, with the readings of all links in it as columns, and the one order that they are in."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from operator import itemgetter
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from drivers.reading_block import CommandColumns, ReadingBlock, ReportColumns
from drivers.readings import Reading, ThrusterCommand, ThrusterReport
from gateway.channel import Source

FloatArray: TypeAlias = NDArray[np.float64]
IndexArray: TypeAlias = NDArray[np.intp]
Columns: TypeAlias = CommandColumns | ReportColumns

# of what one frame has completed: see `ReadingBlock`
_COMMAND, _REPORT, _OTHER = 0, 1, 2


@dataclass(frozen=True, slots=True)
class BlockArrival:
    """Readings of one link over a stretch of time.

    Attributes:
        link: its name.
        readings: of it.
        place: (rows,) ascending, the place of each row of `readings` among all of the stretch; equal places are in
            the order of the arrivals. None: the order is that of time.
    """

    link: str
    readings: ReadingBlock
    place: NDArray[np.float64] | None = None


@dataclass(frozen=True, slots=True)
class RankedColumns:
    """Readings of one thruster over one link. `rank`: (N,) ascending, the place of each among all of the stretch."""

    source: Source
    columns: Columns
    rank: IndexArray

    def readings(self) -> Iterator[tuple[int, str, Reading]]:
        """One by one: rank, link, reading."""
        one = self.columns
        block = ReadingBlock((one,)) if isinstance(one, CommandColumns) else ReadingBlock(reports=(one,))
        for rank, reading in zip(self.rank.tolist(), block.readings(), strict=True):
            yield rank, self.source.link, reading


@dataclass(frozen=True, slots=True)
class Stretch:
    """See the module's text. The order is that of time, or that of places where the arrivals have them; within a
    link, that of its rows, whatever their times.

    Attributes:
        time_s: (N,) of all readings, by rank.
        link: (N,) index into `links`, by rank.
        links: their names.
        columns: readings of thrusters.
        others: rank, link, reading; ascending.
    """

    time_s: FloatArray
    link: IndexArray
    links: tuple[str, ...]
    columns: tuple[RankedColumns, ...]
    others: tuple[tuple[int, str, Reading], ...]

    @staticmethod
    def of(arrivals: Sequence[BlockArrival]) -> Stretch:
        """The stretch of these readings: of several links, each at most once, over the same time.

        Raises:
            ValueError: some arrivals have places, and some have none.
        """
        if len({arrival.place is None for arrival in arrivals}) > 1:
            raise ValueError("want places of all arrivals of a stretch, or of none")
        keys = [_keys(arrival) for arrival in arrivals]
        sizes = [len(one.time_s) for one in keys]
        due = np.concatenate([one.due for one in keys]) if keys else np.empty(0)
        time_s = np.concatenate([one.time_s for one in keys]) if keys else np.empty(0)
        order = np.argsort(due, kind="stable")  # links as given, and within them the order that they are in
        rank = np.empty(len(order), dtype=np.intp)
        rank[order] = np.arange(len(order))
        ranks = np.split(rank, np.cumsum(sizes)[:-1]) if keys else []
        parts = [_ranked(arrival, key, part) for arrival, key, part in zip(arrivals, keys, ranks, strict=True)]
        return Stretch(
            time_s=time_s[order],
            link=np.repeat(np.arange(len(arrivals)), sizes)[order],
            links=tuple(arrival.link for arrival in arrivals),
            columns=tuple(one for columns, _ in parts for one in columns),
            others=tuple(sorted((one for _, others in parts for one in others), key=itemgetter(0))),
        )

    def reached_s(self) -> FloatArray:
        """(N,) the newest time of all by then, by rank."""
        return np.maximum.accumulate(self.time_s)

    def readings(self) -> list[tuple[int, str, Reading]]:
        """One by one, in their order: rank, link, reading."""
        several = [one for columns in self.columns for one in columns.readings()]
        return sorted([*several, *self.others], key=itemgetter(0))


@dataclass(frozen=True, slots=True)
class _Keys:
    """Readings of a block in their order: `time_s`, and `due`, which never runs backwards: time, or place.

    `place`: (N,) for each reading, as they stand one kind and thruster after the other, its place in that order.
    """

    time_s: FloatArray
    due: FloatArray
    place: IndexArray


def _keys(arrival: BlockArrival) -> _Keys:
    block = arrival.readings
    several: list[Columns] = [*block.commands, *block.reports]
    kinds = [_COMMAND] * len(block.commands) + [_REPORT] * len(block.reports)
    sizes = [len(one.row) for one in several]
    others = len(block.others)
    row = np.concatenate([*(one.row for one in several), np.array([row for row, _ in block.others], dtype=np.intp)])
    time_s = np.concatenate([*(one.time_s for one in several), [one.time_s for _, one in block.others]])
    kind = np.append(np.repeat(kinds, sizes), np.full(others, _OTHER))
    number = np.append(np.repeat([one.thruster for one in several], sizes), np.arange(others))
    order = np.lexsort((number, kind, row))
    place = np.empty(len(order), dtype=np.intp)
    place[order] = np.arange(len(order))
    ordered_s = time_s[order]
    due = np.fmax.accumulate(ordered_s) if arrival.place is None else arrival.place[row[order]]
    return _Keys(ordered_s, due, place)


def _ranked(
    arrival: BlockArrival, keys: _Keys, rank: IndexArray
) -> tuple[list[RankedColumns], list[tuple[int, str, Reading]]]:
    """A link's readings with their ranks. `rank`: (N,) of its readings, by their place in it."""
    block, begin = arrival.readings, 0
    columns: list[RankedColumns] = []
    several: list[Columns] = [*block.commands, *block.reports]
    for one in several:
        kind: type[Reading] = ThrusterCommand if isinstance(one, CommandColumns) else ThrusterReport
        end = begin + len(one.row)
        source = Source(arrival.link, kind, one.thruster)
        columns.append(RankedColumns(source, one, rank[keys.place[begin:end]]))
        begin = end
    ranks = rank[keys.place[begin:]].tolist()
    return columns, [(place, arrival.link, reading) for place, (_, reading) in zip(ranks, block.others, strict=True)]
