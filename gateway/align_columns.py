"""Alignment of whole columns: the samples that `ThrusterAligner` would give one by one, bit for bit, with numpy.

It is for regular traffic. Whatever is not (times that run backwards, values that are not finite, a rate still to be
learnt, commands of a stream whose rate others change) goes through the aligner reading by reading.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from drivers.reading_block import CommandColumns, ReportColumns
from gateway.align import TELEMETRY_HOLD_S, HeldTelemetry, Point, ThrusterAligner, is_time

FloatArray: TypeAlias = NDArray[np.float64]
IndexArray: TypeAlias = NDArray[np.intp]

_ABOVE_ZERO = float(np.nextafter(0.0, 1.0))


@dataclass(frozen=True, slots=True)
class SampleColumns:
    """N samples of one thruster.

    Attributes:
        report: (N,) ascending, the report that completed each.
        time_s, command, speed_rpm, voltage_v, current_a: (N,), NaN where not measured.
    """

    report: IndexArray
    time_s: FloatArray
    command: FloatArray
    speed_rpm: FloatArray
    voltage_v: FloatArray
    current_a: FloatArray

    def __len__(self) -> int:
        return len(self.time_s)

    def part(self, rows: NDArray[np.bool_]) -> SampleColumns:
        """Some of them."""
        return SampleColumns(*(getattr(self, name)[rows] for name in self.__slots__))


def align_columns(
    aligner: ThrusterAligner, commands: CommandColumns, reports: ReportColumns, commands_before: IndexArray
) -> SampleColumns | None:
    """Takes commands and reports of one thruster in, gives out the samples that they complete.

    Args:
        aligner: of the thruster; it is as if each had come by itself.
        commands, reports: in the order of their arrival.
        commands_before: (reports,) how many of these commands arrived before each report.

    Returns:
        None, and nothing was taken, where they have to be taken one by one.
    """
    if not (aligner.regular and _admissible(aligner, commands, reports)):
        return None
    held = _Held.of(aligner, commands)
    samples = _samples(aligner, held, reports, commands_before)
    held.leave(aligner, samples)
    _leave(aligner, reports)
    return samples


def _admissible(aligner: ThrusterAligner, commands: CommandColumns, reports: ReportColumns) -> bool:
    points, speed = aligner.held.points, aligner.speed
    measured = ~np.isnan(reports.speed_rpm)
    return (
        _ascending(commands.time_s, points[-1].time_s if points else -np.inf, least_s=0.0)
        and _ascending(reports.time_s, -np.inf, least_s=0.0)
        and _ascending(reports.time_s[measured], -np.inf if speed is None else speed.time_s, least_s=_ABOVE_ZERO)
        and bool(np.isfinite(commands.fraction).all())
        and not any(np.isinf(column).any() for column in (reports.speed_rpm, reports.voltage_v, reports.current_a))
    )


def _ascending(times_s: FloatArray, before_s: float, least_s: float) -> bool:
    """Whether times go on from the one before by steps of at least so much."""
    if not len(times_s):
        return True
    return bool(
        is_time(float(times_s[0]))
        and is_time(float(times_s[-1]))
        and times_s[0] - before_s >= least_s
        and (np.diff(times_s) >= least_s).all()
    )


@dataclass(frozen=True, slots=True)
class _Held:
    """Commands of a block behind those that are remembered, each holding until the next.

    Attributes:
        time_s, value: (M,).
        first: (M,) oldest command that is still remembered when this one is the newest: after a silence, itself.
        remembered: how many of them were there before the block.
    """

    time_s: FloatArray
    value: FloatArray
    first: IndexArray
    remembered: int

    @staticmethod
    def of(aligner: ThrusterAligner, commands: CommandColumns) -> _Held:
        points = aligner.held.points
        time_s = np.concatenate([[point.time_s for point in points], commands.time_s])
        value = np.concatenate([[point.value for point in points], commands.fraction])
        starts = np.diff(time_s, prepend=-np.inf) > aligner.held.stale_s
        first = np.maximum.accumulate(np.where(starts, np.arange(len(time_s)), 0))
        return _Held(time_s, value, first, len(points))

    def mean(self, start_s: FloatArray, end_s: FloatArray, newest: IndexArray, stale_s: float) -> FloatArray:
        """(N,) as `HeldCommand.mean`, over the same terms in the same order; NaN where that gives None.

        Args:
            start_s, end_s: (N,) intervals.
            newest: (N,) the last command that had come by then, -1: none had.
            stale_s: a command holds for this long.
        """
        if not len(self.time_s):
            return np.full(len(end_s), np.nan)
        last = np.minimum(np.searchsorted(self.time_s, end_s, side="right") - 1, newest)
        begin = np.minimum(np.searchsorted(self.time_s, start_s, side="right") - 1, newest)
        known = (newest >= 0) & (begin >= self.first[newest]) & (end_s - self.time_s[last] <= stale_s)
        held, total = self.value[last], np.zeros(len(end_s))
        for step in range(int((last - begin)[known].max(initial=0))):
            earlier = np.minimum(begin + step, last)
            later = np.minimum(earlier + 1, last)
            overlap_s = np.minimum(self.time_s[later], end_s) - np.maximum(self.time_s[earlier], start_s)
            total = np.where(overlap_s > 0.0, total + (self.value[earlier] - held) * overlap_s, total)
        return np.where(known, held + total / (end_s - start_s), np.nan)

    def leave(self, aligner: ThrusterAligner, samples: SampleColumns) -> None:
        """Has the aligner remember what it would after each by itself."""
        if len(self.time_s) == self.remembered == 0:
            return
        oldest_s = self.time_s[-1] - aligner.held.keep_s if len(self.time_s) > self.remembered else self.time_s[0]
        needed = int(np.searchsorted(self.time_s, oldest_s, side="right")) - 1
        rows = range(max(int(self.first[-1]), needed), len(self.time_s))
        aligner.held.replace(Point(float(self.time_s[row]), float(self.value[row])) for row in rows)
        if len(samples):
            aligner.held.forget_before(float(samples.time_s[-1]))


def _samples(
    aligner: ThrusterAligner, held: _Held, reports: ReportColumns, commands_before: IndexArray
) -> SampleColumns:
    """The grid points between each two successive speeds, but for gaps; see `ThrusterAligner._samples_between`."""
    rate_hz = aligner.rate_hz or 0.0  # regular: it is known
    measured = np.flatnonzero(~np.isnan(reports.speed_rpm))
    before = [] if aligner.speed is None else [aligner.speed]
    times_s = np.concatenate([[point.time_s for point in before], reports.time_s[measured]])
    speeds_rpm = np.concatenate([[point.value for point in before], reports.speed_rpm[measured]])
    ends = np.floor(times_s * rate_hz - aligner.phase).astype(np.int64)
    firsts = ends[:-1] + 1 if aligner.last_index is None else np.maximum(ends[:-1], aligner.last_index) + 1
    counts = np.where(np.diff(times_s) <= aligner.gap_s, np.maximum(ends[1:] - firsts + 1, 0), 0)
    pair = np.repeat(np.arange(len(counts)), counts)
    index = firsts[pair] + np.arange(len(pair)) - np.repeat(np.cumsum(counts) - counts, counts)
    if len(index):
        aligner.last_index = int(index[-1])
    report = measured[pair + 1 - len(before)]
    time_s = (index + aligner.phase) / rate_hz
    command = held.mean(
        (index - 1 + aligner.phase) / rate_hz,
        time_s,
        held.remembered + commands_before[report] - 1,
        aligner.held.stale_s,
    )
    share = np.clip((time_s - times_s[pair]) / (times_s[pair + 1] - times_s[pair]), 0.0, 1.0)
    samples = SampleColumns(
        report=report,
        time_s=time_s,
        command=command,
        speed_rpm=speeds_rpm[pair] + (speeds_rpm[pair + 1] - speeds_rpm[pair]) * share,
        voltage_v=_telemetry(aligner.voltage, reports.time_s, reports.voltage_v, report, time_s),
        current_a=_telemetry(aligner.current, reports.time_s, reports.current_a, report, time_s),
    )
    return samples.part(~np.isnan(command))


def _telemetry(
    held: HeldTelemetry, reports_s: FloatArray, values: FloatArray, report: IndexArray, time_s: FloatArray
) -> FloatArray:
    """(N,) what was last measured before the report that completed each sample, where that is not too old."""
    newest = held.newest or Point(-np.inf, np.nan)
    # the one before the block stands in front: row + 1 of the block is behind it
    all_s, all_values = np.append(newest.time_s, reports_s), np.append(newest.value, values)
    rows = np.arange(len(all_s))
    last = np.maximum.accumulate(np.where(np.isnan(all_values), 0, rows))[report]
    return np.where(time_s - all_s[last] > TELEMETRY_HOLD_S, np.nan, all_values[last])


def _leave(aligner: ThrusterAligner, reports: ReportColumns) -> None:
    """Has the aligner remember the last that was measured."""
    speed = _last(reports, reports.speed_rpm)
    aligner.speed = aligner.speed if speed is None else speed
    for held, column in ((aligner.voltage, reports.voltage_v), (aligner.current, reports.current_a)):
        newest = _last(reports, column)
        held.newest = held.newest if newest is None else newest


def _last(reports: ReportColumns, column: FloatArray) -> Point | None:
    measured = np.flatnonzero(~np.isnan(column))
    if not len(measured):
        return None
    return Point(float(reports.time_s[measured[-1]]), float(column[measured[-1]]))
