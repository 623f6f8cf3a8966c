"""Delay and lag of a thruster: those that explain a window best, and the others that explain it nearly as well.

For a given delay and lag the speed is linear in the coefficients of the curve, and the misfit is what least squares
leaves. The curve hardly depends on the timing, though. So it is fitted at few lags only, the pivots. At a lag beside
a pivot its speed is one filtered series, and what the curve would change there is solved with the pivot's columns.
All delays and lags then cost little more than one of them: a matrix product. The error grows with the fourth power
of the distance from the pivot; so one is set wherever a misfit is, or may be, the least.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from detectors.thruster.lag import LAG_NEGLIGIBLE, lag_grid, lagged
from detectors.thruster.model import Response
from detectors.thruster.window import RUN_IN, Prepared

FloatArray = NDArray[np.float64]

CLOSE = 0.1  # samples: between lags over which the misfit is a parabola ...
WIDE = 4.0 * CLOSE  # ... and from the first of three to the last, where it is none any more
ROUNDS = 12  # of looking closer, at most
PIVOTS = 8  # at most
NEXT_TO = 0.25  # samples from a pivot within which its columns do
DOUBTFUL = 2.0  # times the least misfit: a delay that promises less is looked at with a pivot of its own


class TimingGrid:
    """Every delay, and lags from none to `lag_max`, for one window.

    Args:
        data: the window.
        lag_max: longest lag, samples.
        lag: where the best one is expected, None for no idea.
    """

    def __init__(self, data: Prepared, lag_max: float, lag: float | None) -> None:
        self._data = data
        self.lags = lag_grid(lag_max)
        self.penalty = np.diag(data.basis.prior_deviation**-2.0)
        shared = np.asarray(sliding_window_view(data.usable, data.lead + 1).all(axis=1))
        self._shared = shared[RUN_IN:].astype(np.float64)
        self._first = self.lags[2::3].tolist() if lag is None else [lag]
        self.pivots: list[Pivot] = []

    def search(self, gain: FloatArray, noise: float) -> TimingSearch:
        """The best delay and lag for speeds that are divided by this (N,) gain and have this noise."""
        shifted = sliding_window_view(self._data.speed / gain, len(self._data.speed) - self._data.lead)
        shifted = shifted[:, RUN_IN:] * self._shared
        if not self.pivots:
            self.pivots = [Pivot(self, lag, shifted, noise) for lag in self._first]
        return TimingSearch(self, shifted, noise)

    def columns(self, lag: float) -> FloatArray:
        """(K, T) columns of the curve at this lag; 0 in samples that not all delays can use."""
        return self._seen(lagged(self._data.columns, lag))

    def speed(self, coefficients: FloatArray, lag: float) -> FloatArray:
        """(T,) speeds that this curve gives at this lag."""
        return np.asarray(self._seen(lagged((coefficients @ self._data.columns)[None, :], lag))[0])

    def _seen(self, columns: FloatArray) -> FloatArray:
        """The part of (R, lead + N) columns that speeds of every delay are compared with."""
        start = self._data.lead + RUN_IN
        return np.asarray(columns[:, start : start + len(self._shared)] * self._shared)


class Pivot:
    """The curve fitted at one lag, at the delay that is best there, and its speeds at lags around."""

    def __init__(self, grid: TimingGrid, lag: float, shifted: FloatArray, noise: float) -> None:
        self.lag = lag
        self.columns = grid.columns(lag)
        self.gram = self.columns @ self.columns.T
        right = self.columns @ shifted.T
        coefficients = np.linalg.solve(self.gram + noise**2 * grid.penalty, right)
        misfit = (shifted**2).sum(axis=1) - (right * coefficients).sum(axis=0)
        self.coefficients = np.asarray(coefficients[:, np.argmin(misfit)])
        self._grid = grid
        self._speeds: dict[float, FloatArray] = {}

    def speeds(self, lags: FloatArray) -> FloatArray:
        """(L, T) speeds that the curve gives at these lags."""
        for lag in lags.tolist():
            if lag not in self._speeds:
                self._speeds[lag] = self._grid.speed(self.coefficients, lag)
        return np.stack([self._speeds[lag] for lag in lags.tolist()])


class _View:
    """What a pivot says of the misfits for one gain and noise."""

    def __init__(self, pivot: Pivot, penalty: FloatArray, shifted: FloatArray, noise: float) -> None:
        self.pivot = pivot
        self._shifted, self._variance = shifted, noise**2
        self._energy = (shifted**2).sum(axis=1)
        self._right = (pivot.columns @ shifted.T).T - self._variance * penalty @ pivot.coefficients
        self.covariance = np.linalg.inv(pivot.gram + self._variance * penalty)

    def misfits(self, lags: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(L, D) misfits in units of the noise variance; (L, D, K) correlation of what is left with the columns."""
        speeds = self.pivot.speeds(lags)
        left = self._right - (speeds @ self.pivot.columns.T)[:, None, :]
        explained = ((left @ self.covariance) * left).sum(axis=2)
        energy = self._energy - 2.0 * speeds @ self._shifted.T + (speeds**2).sum(axis=1)[:, None]
        return (energy - explained) / self._variance, left


@dataclass(frozen=True, slots=True, eq=False)
class _Least:
    """Where parabolas through the misfits at three neighbouring lags are least: (D,) for each delay.

    Attributes:
        lag, misfit: there.
        width: of the three lags.
    """

    lag: FloatArray
    misfit: FloatArray
    width: FloatArray


class TimingSearch:
    """The misfits of all delays and lags for one gain and noise, and their least.

    Args:
        grid: the window; pivots are added to it.
        shifted: (D, T) speeds with each delay taken off; 0 in samples that not all delays can use.
        noise: standard deviation of the speed.

    Attributes:
        delay, lag: the best, samples.
    """

    def __init__(self, grid: TimingGrid, shifted: FloatArray, noise: float) -> None:
        self._grid, self._shifted, self._noise = grid, shifted, noise
        self._views = [_View(pivot, grid.penalty, shifted, noise) for pivot in grid.pivots]
        self._lags = grid.lags
        self._owner = np.full(len(self._lags), -1)
        self._misfit = np.empty((len(self._lags), len(shifted)))
        self._left = np.empty((*self._misfit.shape, len(grid.penalty)))
        for pivot in grid.pivots:
            self._add(_around(pivot.lag))
        least = self._look_closer()
        self.delay = int(least.misfit.argmin())
        self.lag, self._least = float(least.lag[self.delay]), float(least.misfit.min())

    def plausible(self, margin: float) -> tuple[Response, ...]:
        """The extreme ones among the other delays and lags whose misfit is within `margin` of the best."""
        within = self._misfit - self._least < margin
        within[np.abs(self._lags - self.lag) <= CLOSE, self.delay] = False
        return tuple(self._response(*point) for point in _extremes(within, self._lags))

    def _look_closer(self) -> _Least:
        """Look at further lags, and set pivots, until the least misfit is certain."""
        for _ in range(ROUNDS):
            self._fill()
            least = self._parabolas()
            best = int(least.misfit.argmin())
            apart = self._apart(least.lag)
            doubtful = (apart > NEXT_TO) & (least.misfit < DOUBTFUL * max(least.misfit[best], 0.0))
            if least.width[best] > WIDE:
                self._add(_around(float(least.lag[best])))
            elif doubtful.any() and len(self._views) < PIVOTS:
                self._pivot(float(least.lag[np.where(doubtful, least.misfit, np.inf).argmin()]))
            else:
                break
        return least

    def _apart(self, lags: FloatArray) -> FloatArray:
        """Distance of lags from the nearest pivot."""
        return np.asarray(np.abs(lags[:, None] - [view.pivot.lag for view in self._views]).min(axis=1))

    def _fill(self) -> None:
        """Misfits of lags that are new, or have a nearer pivot now."""
        owner = np.abs(self._lags[:, None] - [view.pivot.lag for view in self._views]).argmin(axis=1)
        for number, view in enumerate(self._views):
            new = (owner == number) & (self._owner != number)
            if new.any():
                self._misfit[new], self._left[new] = view.misfits(self._lags[new])
        self._owner = owner

    def _parabolas(self) -> _Least:
        middle = np.clip(self._misfit.argmin(axis=0), 1, len(self._misfit) - 2)
        rows = middle + np.array([[-1], [0], [1]])
        lags = self._lags[rows]
        return _Least(*_vertices(lags, self._misfit[rows, np.arange(len(middle))]), np.ptp(lags, axis=0))

    def _add(self, lags: FloatArray) -> None:
        """Take further lags in; those that are nearly known tell nothing but rounding."""
        lags = lags[np.abs(lags[:, None] - self._lags).min(axis=1) > 0.25 * CLOSE]
        where = np.searchsorted(self._lags, lags)
        self._lags = np.insert(self._lags, where, lags)
        self._owner = np.insert(self._owner, where, -1)
        self._misfit = np.insert(self._misfit, where, 0.0, axis=0)
        self._left = np.insert(self._left, where, 0.0, axis=0)

    def _pivot(self, lag: float) -> None:
        """Set a further pivot."""
        pivot = Pivot(self._grid, lag, self._shifted, self._noise)
        self._grid.pivots.append(pivot)
        self._views.append(_View(pivot, self._grid.penalty, self._shifted, self._noise))
        self._add(_around(lag))

    def _response(self, row: int, delay: int) -> Response:
        """The curve as it is at this lag and delay."""
        view = self._views[self._owner[row]]
        change = view.covariance @ self._left[row, delay]
        return Response(delay, float(self._lags[row]), view.pivot.coefficients + change)


def _around(lag: float) -> FloatArray:
    """Three lags close to this one."""
    return max(lag, 2.0 * CLOSE) + np.array([-CLOSE, 0.0, CLOSE])


def _vertices(lags: FloatArray, misfit: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Where D parabolas through (3, D) misfits at these lags are least, within the triples, and their misfits there.

    Over the filter's memory, for it is that in which the speed is nearly linear.
    """
    x = np.exp(-1.0 / np.maximum(lags, LAG_NEGLIGIBLE))
    left, right = np.diff(x, axis=0)
    down, up = np.diff(misfit, axis=0) / (left, right)
    bend = (up - down) / (left + right)
    convex = bend > 0.0
    vertex = 0.5 * (x[0] + x[1] - np.divide(down, bend, out=np.zeros_like(bend), where=convex))
    vertex = np.clip(np.where(convex, vertex, x[1]), x[0], x[2])
    return -1.0 / np.log(vertex), misfit[0] + (vertex - x[0]) * (down + bend * (vertex - x[1]))


def _extremes(plausible: NDArray[np.bool_], lags: FloatArray) -> list[tuple[int, int]]:
    """Of the (rows, delays) that are plausible, those with the extreme sums of delay and lag, and extreme delays."""
    rows, delays = np.nonzero(plausible)
    if not len(rows):
        return []
    total = delays + lags[rows]
    by_delay = np.lexsort((lags[rows], delays))
    chosen = {int(total.argmin()), int(total.argmax()), int(by_delay[0]), int(by_delay[-1])}
    return sorted((int(rows[one]), int(delays[one])) for one in chosen)
