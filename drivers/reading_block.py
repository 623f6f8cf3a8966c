"""Readings of a whole block of frames: those of thrusters, which are many, as columns; the few others, whole.

`row` is the place of the frame that completed a reading in the block that it was decoded from: readings of one block
are in the order of their rows, and several of one frame in the order in which the columns stand here (all commands
before all reports, of ascending thrusters, then the rest).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import isnan
from typing import TypeAlias

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

    def readings(self) -> list[Reading]:
        """One by one, in their order: exactly what decoding the frames one by one gives."""
        keyed: list[tuple[int, int, int, Reading]] = [
            *((row, 0, one.thruster, reading) for one in self.commands for row, reading in _commands(one)),
            *((row, 1, one.thruster, reading) for one in self.reports for row, reading in _reports(one)),
            *((row, 2, number, reading) for number, (row, reading) in enumerate(self.others)),
        ]
        return [reading for *_, reading in sorted(keyed, key=lambda one: one[:3])]


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
