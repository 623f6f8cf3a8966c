"""Readings of a whole block of frames: those of thrusters, which are many, as columns; the few others, whole.

`row` is the place of the frame that completed a reading in the block that it was decoded from: readings of one block
are in the order of their rows, and several of one frame in the order in which the columns stand here (all commands
before all reports, of ascending thrusters, then the rest).
"""

from __future__ import annotations

from bisect import bisect_left
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from math import isnan
from operator import itemgetter
from typing import Any, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from drivers.readings import Reading, ThrusterCommand, ThrusterReport

FloatArray: TypeAlias = NDArray[np.float64]
IndexArray: TypeAlias = NDArray[np.intp]


@dataclass(frozen=True, slots=True)
class CommandColumns:
    """N `ThrusterCommand` of one thruster. `row`: (N,) ascending; `time_s`, `fraction`: (N,), finite."""

    thruster: int
    row: IndexArray
    time_s: FloatArray
    fraction: FloatArray


@dataclass(frozen=True, slots=True)
class ReportColumns:
    """N `ThrusterReport` of one thruster, with what detectors and health watches read.

    Attributes:
        thruster: its number.
        row: (N,) ascending.
        time_s: (N,) finite.
        speed_rpm, voltage_v, current_a, temperature_k, error_count: (N,) float64, NaN where not measured.
    """

    thruster: int
    row: IndexArray
    time_s: FloatArray
    speed_rpm: FloatArray
    voltage_v: FloatArray
    current_a: FloatArray
    temperature_k: FloatArray
    error_count: FloatArray


_ColumnsT = TypeVar("_ColumnsT", CommandColumns, ReportColumns)


@dataclass(frozen=True, slots=True)
class ReadingBlock:
    """See the module's text.

    Attributes:
        commands, reports: at most one of each thruster, ascending by it; none empty.
        others: (row, reading), ascending.
    """

    commands: tuple[CommandColumns, ...] = ()
    reports: tuple[ReportColumns, ...] = ()
    others: tuple[tuple[int, Reading], ...] = ()

    def __bool__(self) -> bool:
        return bool(self.commands or self.reports or self.others)

    @staticmethod
    def of(readings: Sequence[Reading]) -> ReadingBlock:
        """Readings that are few, whole, each in a row of its own."""
        return ReadingBlock(others=tuple(enumerate(readings)))

    @staticmethod
    def joined(blocks: Sequence[ReadingBlock]) -> ReadingBlock:
        """One after the other."""
        commands: defaultdict[int, list[CommandColumns]] = defaultdict(list)
        reports: defaultdict[int, list[ReportColumns]] = defaultdict(list)
        others: list[tuple[int, Reading]] = []
        first = 0
        for block in blocks:
            shifted = block._shifted(first)
            for commanded in shifted.commands:
                commands[commanded.thruster].append(commanded)
            for reported in shifted.reports:
                reports[reported.thruster].append(reported)
            others += shifted.others
            first = max(first, shifted.rows)
        return ReadingBlock(
            tuple(_joined(commands[thruster]) for thruster in sorted(commands)),
            tuple(_joined(reports[thruster]) for thruster in sorted(reports)),
            tuple(others),
        )

    @property
    def rows(self) -> int:
        """One more than the last row that there is a reading of."""
        columns: tuple[CommandColumns | ReportColumns, ...] = (*self.commands, *self.reports)
        last = [int(one.row[-1]) for one in columns] + [row for row, _ in self.others[-1:]]
        return 1 + max(last, default=-1)

    def times(self) -> tuple[IndexArray, FloatArray]:
        """(N,) rows, ascending, and times of all readings."""
        columns: tuple[CommandColumns | ReportColumns, ...] = (*self.commands, *self.reports)
        rows = np.concatenate(
            [*(one.row for one in columns), np.array([row for row, _ in self.others], dtype=np.intp)]
        )
        times_s = np.concatenate([*(one.time_s for one in columns), [one.time_s for _, one in self.others]])
        order = np.argsort(rows, kind="stable")
        return rows[order], times_s[order]

    def split(self, row: int) -> tuple[ReadingBlock, ReadingBlock]:
        """Readings before a row, and from it on."""
        place = bisect_left(self.others, row, key=itemgetter(0))
        commands = [_split(one, row) for one in self.commands]
        reports = [_split(one, row) for one in self.reports]
        before, after = (
            ReadingBlock(
                tuple(halves[half] for halves in commands if len(halves[half].row)),
                tuple(halves[half] for halves in reports if len(halves[half].row)),
                self.others[:place] if half == 0 else self.others[place:],
            )
            for half in (0, 1)
        )
        return before, after

    def moved(self, time_of: Callable[[Any], Any]) -> ReadingBlock:
        """The same by another clock. `time_of`: what its time is by that one, of a number or an array."""
        return ReadingBlock(
            tuple(replace(one, time_s=time_of(one.time_s)) for one in self.commands),
            tuple(replace(one, time_s=time_of(one.time_s)) for one in self.reports),
            tuple((row, replace(reading, time_s=time_of(reading.time_s))) for row, reading in self.others),
        )

    def reordered(self, row: IndexArray) -> ReadingBlock:
        """The same in other rows. `row`: (rows,) the new one of each, such that those of one column still rise."""
        others = [(int(row[old]), reading) for old, reading in self.others]
        return ReadingBlock(
            tuple(replace(one, row=row[one.row]) for one in self.commands),
            tuple(replace(one, row=row[one.row]) for one in self.reports),
            tuple(sorted(others, key=itemgetter(0))),
        )

    def _shifted(self, rows: int) -> ReadingBlock:
        return ReadingBlock(
            tuple(replace(one, row=one.row + rows) for one in self.commands),
            tuple(replace(one, row=one.row + rows) for one in self.reports),
            tuple((row + rows, reading) for row, reading in self.others),
        )

    def readings(self) -> list[Reading]:
        """One by one, in their order: exactly what decoding the frames one by one gives."""
        keyed: list[tuple[int, int, int, Reading]] = [
            *((row, 0, one.thruster, reading) for one in self.commands for row, reading in _commands(one)),
            *((row, 1, one.thruster, reading) for one in self.reports for row, reading in _reports(one)),
            *((row, 2, number, reading) for number, (row, reading) in enumerate(self.others)),
        ]
        return [reading for *_, reading in sorted(keyed, key=lambda one: one[:3])]


def _joined(several: Sequence[_ColumnsT]) -> _ColumnsT:
    if len(several) == 1:
        return several[0]
    names = [name for name in several[0].__slots__ if name != "thruster"]
    columns: dict[str, Any] = {name: np.concatenate([getattr(one, name) for one in several]) for name in names}
    return replace(several[0], **columns)


def _split(columns: _ColumnsT, row: int) -> tuple[_ColumnsT, _ColumnsT]:
    place = int(np.searchsorted(columns.row, row))
    names = [name for name in columns.__slots__ if name != "thruster"]
    before: dict[str, Any] = {name: getattr(columns, name)[:place] for name in names}
    after: dict[str, Any] = {name: getattr(columns, name)[place:] for name in names}
    return replace(columns, **before), replace(columns, **after)


def _commands(columns: CommandColumns) -> Iterator[tuple[int, Reading]]:
    for row, time_s, fraction in zip(
        columns.row.tolist(), columns.time_s.tolist(), columns.fraction.tolist(), strict=True
    ):
        yield row, ThrusterCommand(time_s, columns.thruster, fraction)


def _reports(columns: ReportColumns) -> Iterator[tuple[int, Reading]]:
    measured = (columns.speed_rpm, columns.voltage_v, columns.current_a, columns.temperature_k)
    values = zip(*(column.tolist() for column in measured), strict=True)
    counts = columns.error_count.tolist()
    for row, time_s, numbers, count in zip(
        columns.row.tolist(), columns.time_s.tolist(), values, counts, strict=True
    ):
        rpm, volts, amperes, kelvin = (None if isnan(number) else number for number in numbers)
        errors = None if isnan(count) else int(count)
        yield row, ThrusterReport(time_s, columns.thruster, rpm, volts, amperes, kelvin, errors)
