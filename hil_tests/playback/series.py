"""What one thruster was told and how fast it turned, over time: what recordings of any kind are read into."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class ThrusterSeries:
    """One thruster over time, n samples.

    Attributes:
        time_s: (n,), rising, from any origin.
        command: (n,), fraction of full command, -1 to 1.
        speed_rpm: (n,), propeller speed, with or without a sign.
        voltage_v, current_a: (n,), supply; NaN where not measured.

    Raises:
        ValueError: arrays of unequal length or of less than one sample, a time that does not rise, a command beyond
            -1 to 1, a command or speed that is not finite.
    """

    time_s: FloatArray
    command: FloatArray
    speed_rpm: FloatArray
    voltage_v: FloatArray
    current_a: FloatArray

    def __post_init__(self) -> None:
        shapes = {column.shape for column in self.columns()}
        if len(shapes) != 1 or self.time_s.ndim != 1 or self.time_s.size == 0:
            raise ValueError(f"arrays must be of one length, at least 1, got shapes {sorted(shapes)}")
        if not np.all(np.diff(self.time_s) > 0.0):
            raise ValueError("time_s must rise from sample to sample")
        if not np.all(np.abs(self.command) <= 1.0):
            raise ValueError(f"command must lie in -1 to 1, got up to {np.max(np.abs(self.command))}")
        if not np.all(np.isfinite(self.speed_rpm)):
            raise ValueError("speed_rpm must be finite")

    @property
    def duration_s(self) -> float:
        """From the first sample to the last."""
        return float(self.time_s[-1] - self.time_s[0])

    def part(self, start_s: float, end_s: float) -> ThrusterSeries:
        """The samples of `start_s <= time_s < end_s`, with `start_s` as the new time 0.

        Raises:
            ValueError: there are none.
        """
        series = self._where((self.time_s >= start_s) & (self.time_s < end_s))
        return replace(series, time_s=series.time_s - start_s)

    def thinned(self, rate_hz: float) -> ThrusterSeries:
        """At most one sample, the first, of every period of 1 / `rate_hz`; samples keep their own times."""
        periods = np.floor((self.time_s - self.time_s[0]) * rate_hz + 1e-9)
        return self._where(np.diff(periods, prepend=-1.0) > 0.0)

    def with_speed_scaled(self, factor: float, from_s: float) -> ThrusterSeries:
        """A fault: from `from_s` on, for good, the thruster turns `factor` times as fast."""
        return replace(self, speed_rpm=np.where(self.time_s >= from_s, factor, 1.0) * self.speed_rpm)

    def columns(self) -> tuple[FloatArray, ...]:
        """All arrays, in the order of the constructor's arguments."""
        return self.time_s, self.command, self.speed_rpm, self.voltage_v, self.current_a

    def _where(self, wanted: NDArray[np.bool_]) -> ThrusterSeries:
        return ThrusterSeries(*(column[wanted] for column in self.columns()))


def chained(runs: Sequence[ThrusterSeries], pause_s: float) -> ThrusterSeries:
    """One run after the other, from time 0, with `pause_s` between the last sample of one and the first of the next.

    Raises:
        ValueError: no runs, or a pause that is not positive.
    """
    if not runs or not pause_s > 0.0:
        raise ValueError(f"need at least one run and a positive pause_s, got {len(runs)} and {pause_s}")
    starts = np.cumsum([0.0] + [run.duration_s + pause_s for run in runs[:-1]])
    moved = [replace(run, time_s=run.time_s - run.time_s[0] + start) for run, start in zip(runs, starts, strict=True)]
    columns = zip(*(run.columns() for run in moved), strict=True)
    return ThrusterSeries(*(np.concatenate(parts) for parts in columns))
