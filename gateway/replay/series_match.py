"""By how much one log's clock is ahead of another's, from values that both have: the same thrusters' commands.

- **Coarse.** Both are put on an even grid, smoothed over the interval of the slower one, and their changes are
  correlated at every lag at once (by FFT), over what both cover at that lag. The greatest peaks are candidates.
- **Fine.** For each, the slower one's samples are compared with the faster one's value at their times, and the
  variance that is left unexplained, gain and zero point free, is made least. Straight lines between the faster one's
  samples are not late on average, as values that are held from one sample to the next would be.
- **Drift.** The fine step, in stretches of the common time, and a straight line through what they found.
- **Sure** is what explains nearly all, by enough changes, and much better than the second best candidate: a dive has
  manoeuvres that resemble each other.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from gateway.replay.log_trace import Series
from gateway.replay.series_lags import GAP_S, candidate_lags, interval_s, span

FloatArray: TypeAlias = NDArray[np.float64]
Rows: TypeAlias = NDArray[np.intp]

SAMPLES_MAX = 4000  # of a thruster, that are compared
NEIGHBOURS = 4  # either side of a change, that are compared with it
SAMPLES_MIN = 3
STEPS_S = (0.05, 0.01, 0.002)
STEPS = 10  # either way
REACH_S = 0.02
AS_GOOD = 0.05  # of the way up from the best to what is a reach away

DRIFT_SPAN_S = 300.0  # below, the offset is less sure than what a drift makes of it
DRIFT_MAX = 300e-6
STRETCH_S = 120.0
STRETCHES_MIN = 3
STRETCH_SAMPLES_MIN = 40

CHANGE = 0.05  # of a thruster's range
CHANGES_MIN = 10
UNEXPLAINED_MAX = 0.1
MARGIN_MIN = 2.0
LEAST = 1e-9  # so that nothing is better without end


@dataclass(frozen=True, slots=True)
class Match:
    """How one log's times become another's.

    Attributes:
        offset_s: to be added, at `at_s`.
        at_s: by the clock of the log whose times are to be changed.
        drift: seconds a second.
        error_s: by which the offset may be wrong; what drift makes of it is in here, too.
        unexplained: share of the variance of the values that remains.
        margin: how much more of it the second best offset leaves.
        overlap_s: for how long both have values.
    """

    offset_s: float
    at_s: float
    drift: float
    error_s: float
    unexplained: float
    margin: float
    overlap_s: float


def match(one: Mapping[int, Series], other: Mapping[int, Series]) -> Match | None:
    """What is to be added to the times of `other`; None where nothing is sure."""
    numbers = [n for n in one if n in other and min(span(one[n]), span(other[n])) > 0.0]
    if not numbers:
        return None
    firsts, seconds = [one[n] for n in numbers], [other[n] for n in numbers]
    found = [_Comparison(firsts, seconds, lag_s) for lag_s in candidate_lags(firsts, seconds)]
    found = [one for one in found if one.changes >= CHANGES_MIN]
    if not found:
        return None
    best = min(found, key=lambda one: one.unexplained)
    result = best.match([one.unexplained for one in found if one is not best])
    return result if result.unexplained <= UNEXPLAINED_MAX and result.margin >= MARGIN_MIN else None


class _Comparison:
    """Two logs near one lag: the samples of the slower one at which something changes, beside the faster one."""

    def __init__(self, firsts: list[Series], seconds: list[Series], lag_s: float) -> None:
        self._turned = _slowness_s(firsts) > _slowness_s(seconds)
        self._fast, self._slow = (seconds, firsts) if self._turned else (firsts, seconds)
        # from the slow one's times to the fast one's
        self._lag_s = -lag_s if self._turned else lag_s
        self._rows = [_changing(slow, fast, self._lag_s) for fast, slow in zip(self._fast, self._slow, strict=True)]
        times_s = np.concatenate([slow.time_s[row] for slow, row in self._pairs()])
        self._begin_s, self._end_s = (float(times_s.min()), float(times_s.max())) if len(times_s) else (0.0, 0.0)
        self.changes = self._count_changes()
        self._error_s = 0.0
        if self.changes:
            self._lag_s, self._error_s = self._best(self._lag_s, self._rows)
        self.unexplained = self._unexplained(self._lag_s, self._rows)

    @property
    def overlap_s(self) -> float:
        """From the first to the last sample that is compared."""
        return self._end_s - self._begin_s

    def match(self, others: Sequence[float]) -> Match:
        """With drift, where the logs are long enough to see it; `others`: what other lags leave unexplained."""
        lag_s, at_s, drift = self._line()
        unexplained = self._unexplained(lag_s, self._rows, at_s, drift)
        margin = min(others, default=1.0) / max(unexplained, LEAST)
        if self._turned:  # t2 = t1 + lag + drift (t1 - at), solved for t1
            lag_s, at_s, drift = -lag_s, at_s + lag_s, -drift / (1.0 + drift)
        return Match(lag_s, at_s, drift, self._error_s, unexplained, margin, self.overlap_s)

    def _line(self) -> tuple[float, float, float]:
        """(lag, when, drift) through the best lags of stretches of the common time."""
        middle_s = (self._begin_s + self._end_s) / 2.0
        points = np.array(self._stretches()) if self.overlap_s >= DRIFT_SPAN_S else np.empty((0, 2))
        if len(points) < STRETCHES_MIN:
            return self._lag_s, middle_s, 0.0
        slope, intercept, _, _ = stats.theilslopes(points[:, 1], points[:, 0] - middle_s)
        if abs(slope) > DRIFT_MAX:
            return self._lag_s, middle_s, 0.0
        return float(intercept), middle_s, float(slope)

    def _stretches(self) -> list[tuple[float, float]]:
        """(middle, best lag) of those that change enough to tell."""
        edges_s = np.linspace(self._begin_s, self._end_s, int(self.overlap_s / STRETCH_S) + 1)
        points = []
        for begin_s, end_s in pairwise(edges_s.tolist()):
            rows = [row[(slow.time_s[row] >= begin_s) & (slow.time_s[row] < end_s)] for slow, row in self._pairs()]
            if sum(map(len, rows)) >= STRETCH_SAMPLES_MIN:
                lag_s, _ = self._best(self._lag_s, rows)
                if self._unexplained(lag_s, rows) <= UNEXPLAINED_MAX:
                    points.append(((begin_s + end_s) / 2.0, lag_s))
        return points

    def _pairs(self) -> Iterator[tuple[Series, Rows]]:
        return zip(self._slow, self._rows, strict=True)

    def _best(self, around_s: float, rows: list[Rows]) -> tuple[float, float]:
        """(lag, how far off it may be): the middle of the lags that are about as good as the best near another."""
        for step_s in STEPS_S:
            lags_s = around_s + np.arange(-STEPS, STEPS + 1) * step_s
            left = [self._unexplained(lag_s, rows) for lag_s in lags_s.tolist()]
            around_s = float(lags_s[int(np.argmin(left))])
        reach_s = max(REACH_S, _slowness_s(self._slow))
        lags_s = around_s + np.linspace(-reach_s, reach_s, 4 * STEPS + 1)
        return _middle(lags_s, np.array([self._unexplained(lag_s, rows) for lag_s in lags_s.tolist()]))

    def _unexplained(self, lag_s: float, rows: list[Rows], at_s: float = 0.0, drift: float = 0.0) -> float:
        """Share of the slow one's variance that the fast one's values leave, gain and zero point free."""
        left = total = 0.0
        for fast, slow, row in zip(self._fast, self._slow, rows, strict=True):
            if len(row) < SAMPLES_MIN:
                continue
            time_s, value = slow.time_s[row], slow.value[row]
            beside = np.interp(time_s + lag_s + drift * (time_s - at_s), fast.time_s, fast.value)
            value, beside = value - value.mean(), beside - beside.mean()
            own, common, square = float(value @ value), float(value @ beside), float(beside @ beside)
            total += own
            # least squares: own - common^2 / square; a gain below 0 explains nothing
            left += own - common * max(common, 0.0) / square if square > 0.0 else own
        return left / total if total > 0.0 else 1.0

    def _count_changes(self) -> int:
        """At how many different seconds something changed."""
        seconds = [np.floor(slow.time_s[row[_steps(slow)[row]]]) for slow, row in self._pairs()]
        return len(np.unique(np.concatenate(seconds)))


def _middle(lag_s: FloatArray, left: FloatArray) -> tuple[float, float]:
    """(middle, half of the width) of the lags around the best one up to a level a little above its own.

    Held values that are sampled slowly fit equally well over a range of lags; it is symmetric about the true one.
    """
    best = int(np.argmin(left))
    level = left[best] + AS_GOOD * max((left[0] + left[-1]) / 2.0 - left[best], 0.0)
    above = np.flatnonzero(left > level)
    edges_s = []
    for outer, step in ((above[above < best][-1:], 1), (above[above > best][:1], -1)):
        if not len(outer):
            edges_s.append(float(lag_s[0 if step == 1 else -1]))
            continue
        out, inside = int(outer[0]), int(outer[0]) + step
        share = (left[out] - level) / (left[out] - left[inside])
        edges_s.append(float(lag_s[out] + share * (lag_s[inside] - lag_s[out])))
    return (edges_s[0] + edges_s[1]) / 2.0, (edges_s[1] - edges_s[0]) / 2.0


def _slowness_s(log: Sequence[Series]) -> float:
    return float(np.median([interval_s(one) for one in log]))


def _steps(series: Series) -> NDArray[np.bool_]:
    """(N,) whether the next value is another."""
    return np.abs(np.diff(series.value, append=series.value[-1:])) > CHANGE * span(series)


def _changing(slow: Series, fast: Series, lag_s: float) -> Rows:
    """Samples near which the slow one's value changes, and the fast one has values."""
    moves = np.diff(slow.value, prepend=slow.value[:1]) != 0.0
    moves = np.convolve(moves, np.ones(2 * NEIGHBOURS + 1), mode="same") > 0.0
    time_s = slow.time_s + lag_s
    after = np.searchsorted(fast.time_s, time_s)
    inside = (after > 0) & (after < len(fast))
    inside[inside] = fast.time_s[after[inside]] - fast.time_s[after[inside] - 1] <= GAP_S
    rows = np.flatnonzero(moves & inside)
    return rows[:: max(1, -(-len(rows) // SAMPLES_MAX))]
