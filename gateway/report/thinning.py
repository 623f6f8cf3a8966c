"""Samples of hours in bounded memory, as they come: what stands out is kept, and nothing that the eye could not tell.

Time is cut into bins on a fixed grid. Of each bin its first and last sample stay, and of each value in which peaks
count those where it is lowest, highest, and first not known. All values of a sample stay or go together. Where there
are too many, the bins become twice as long: so the longer the dive, the coarser.

What stays depends on the samples alone, not on how they were handed over.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from functools import partial
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]
BoolArray: TypeAlias = NDArray[np.bool_]

SAMPLES_MAX = 16_000
WIDTH_MIN_S = 1.0 / 128.0
WAITING_MAX = 1024  # samples that came alone and are thinned together


class Thinning:
    """See the module's text.

    Args:
        names: of the values of a sample.
        peaks: those in which the lowest and the highest are kept.
        gap_s: where samples are further apart, there is one of NaN between them: a line breaks there.
        samples_max: how many are kept, but for those of the bin that is not over.

    Raises:
        ValueError: `peaks` has another name.
    """

    def __init__(
        self, names: Sequence[str], peaks: Collection[str], gap_s: float, samples_max: int = SAMPLES_MAX
    ) -> None:
        others = set(peaks) - set(names)
        if others:
            raise ValueError(f"peaks = {sorted(others)}: want some of {', '.join(names)}")
        self._names = tuple(names)
        self._peaks = tuple(1 + place for place, name in enumerate(names) if name in peaks)
        self._gap_s, self._samples_max = gap_s, samples_max
        self._width_s = WIDTH_MIN_S
        self._over: list[FloatArray] = []  # time and values of bins that are over
        self._kept = 0
        self._open = np.empty((0, 1 + len(names)))  # of the newest bin
        self._waiting: list[tuple[float, ...]] = []

    def append(self, time_s: float, *values: float) -> None:
        """Takes one sample."""
        self._waiting.append((time_s, *values))
        if len(self._waiting) >= WAITING_MAX:
            self._take_waiting()

    def extend(self, time_s: FloatArray, *values: FloatArray) -> None:
        """Takes (N,) samples, in order of time. One that is not later than the one before is left out."""
        self._take_waiting()
        self._take(np.column_stack([time_s, *values]).astype(np.float64, copy=False))

    def columns(self) -> tuple[FloatArray, Mapping[str, FloatArray]]:
        """(N,) times of what is kept, and the values by their names."""
        self._take_waiting()
        rows = np.concatenate([*self._over, self._open])
        return rows[:, 0], {name: rows[:, 1 + place] for place, name in enumerate(self._names)}

    def _take_waiting(self) -> None:
        if self._waiting:
            waiting, self._waiting = self._waiting, []
            self._take(np.array(waiting, dtype=np.float64))

    def _take(self, rows: FloatArray) -> None:
        newest = self._open[-1:]
        rows = _rising(rows, after_s=float(newest[0, 0]) if len(newest) else -np.inf)
        if not len(rows):
            return
        joined = np.concatenate([newest, rows])
        rows = _with_gaps(joined, self._gap_s)[len(newest) :]
        self._close(np.concatenate([self._open, rows]))
        while self._kept > self._samples_max:
            self._coarsen()

    def _close(self, rows: FloatArray) -> None:
        """Thins rows, and puts aside those of bins that are over."""
        thinned = self._thinned(rows)
        newest = np.floor(thinned[-1, 0] / self._width_s)
        first = int(np.searchsorted(np.floor(thinned[:, 0] / self._width_s), newest))
        if first:
            self._over.append(thinned[:first])
        self._kept += first
        self._open = thinned[first:]

    def _coarsen(self) -> None:
        rows = np.concatenate([*self._over, self._open])
        self._width_s *= 2.0
        self._over, self._kept = [], 0
        self._close(rows)

    def _thinned(self, rows: FloatArray) -> FloatArray:
        place = np.floor(rows[:, 0] / self._width_s)
        starts = np.flatnonzero(np.diff(place, prepend=-np.inf))
        counts = np.diff(starts, append=len(rows))
        kept = np.zeros(len(rows), dtype=bool)
        kept[starts] = kept[starts + counts - 1] = True
        first = partial(_first_of_each, bins=np.repeat(np.arange(len(starts)), counts))
        for column in self._peaks:
            value = rows[:, column]
            kept[first(np.isnan(value))] = True
            for extreme in _EXTREMES:
                kept[first(value == np.repeat(extreme(value, starts), counts))] = True
        return rows[kept]


_EXTREMES: tuple[Callable[[FloatArray, NDArray[np.intp]], FloatArray], ...] = (np.fmin.reduceat, np.fmax.reduceat)


def _first_of_each(hit: BoolArray, bins: NDArray[np.intp]) -> NDArray[np.intp]:
    """Index of the first that is hit in each bin where one is."""
    hits = np.flatnonzero(hit)
    return hits[np.diff(bins[hits], prepend=-1) > 0]


def _rising(rows: FloatArray, after_s: float) -> FloatArray:
    time_s = np.where(np.isfinite(rows[:, 0]), rows[:, 0], -np.inf)
    latest = np.maximum.accumulate(np.append(after_s, time_s))[:-1]
    rising = time_s > latest
    return rows if rising.all() else rows[rising]


def _with_gaps(rows: FloatArray, gap_s: float) -> FloatArray:
    """With a row of NaN in the middle of each gap."""
    behind = 1 + np.flatnonzero(np.diff(rows[:, 0]) > gap_s)
    if not len(behind):
        return rows
    blank = np.full((len(behind), rows.shape[1]), np.nan)
    blank[:, 0] = (rows[behind - 1, 0] + rows[behind, 0]) / 2.0
    return np.insert(rows, behind, blank, axis=0)
