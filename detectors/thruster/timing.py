"""Delay and lag of a thruster: those that explain a window best, and the others that explain it nearly as well.

For a given delay and lag the speed is linear in the coefficients of the curve, so that every delay and lag of a grid
costs one small least-squares problem. All delays share their normal matrix: it is the speed that is shifted.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from detectors.thruster.lag import lag_grid, lagged
from detectors.thruster.window import RUN_IN, Prepared

FloatArray = NDArray[np.float64]

NEAR_LAGS, NEAR_DELAYS = 4, 2  # of the grid, around its best point, that are looked at more closely
LAG_PRECISION = 0.03  # samples


@dataclass(frozen=True, slots=True)
class Timing:
    """A delay and a lag, in samples, and the extreme ones among those that are plausible as well."""

    delay: int
    lag: float
    plausible: tuple[tuple[int, float], ...] = ()


class TimingGrid:
    """Every delay, and lags from none to `lag_max`, for one window."""

    def __init__(self, data: Prepared, lag_max: float) -> None:
        self._data = data
        self._penalty = np.diag(data.basis.prior_deviation**-2.0)
        self._lags = lag_grid(lag_max)
        self._shared = np.asarray(sliding_window_view(data.usable, data.lead + 1).all(axis=1))[RUN_IN:]
        columns = [self._columns(float(lag)) for lag in self._lags]
        self._grid = [(column, column @ column.T) for column in columns]

    def search(self, gain: FloatArray, noise: float) -> TimingSearch:
        """The misfits for speeds that are divided by this (N,) gain and have this noise."""
        data = self._data
        views = sliding_window_view(data.speed / gain, len(data.speed) - data.lead)
        shifted = views[:, RUN_IN:][:, self._shared]
        return TimingSearch(self, shifted, noise)

    def misfit_on_grid(self, shifted: FloatArray, noise: float) -> FloatArray:
        """(lags, delays) misfits in units of the noise variance."""
        return np.array([self._misfit(columns, gram, shifted, noise) for columns, gram in self._grid])

    def misfit(self, lag: float, shifted: FloatArray, noise: float) -> FloatArray:
        """(delays,) misfits at a lag that need not be on the grid."""
        columns = self._columns(lag)
        return self._misfit(columns, columns @ columns.T, shifted, noise)

    @property
    def lags(self) -> FloatArray:
        """The lags of the grid."""
        return self._lags

    def _columns(self, lag: float) -> FloatArray:
        start = self._data.lead + RUN_IN
        return lagged(self._data.columns, lag)[:, start : start + len(self._shared)][:, self._shared]

    def _misfit(self, columns: FloatArray, gram: FloatArray, shifted: FloatArray, noise: float) -> FloatArray:
        normal = gram / noise**2 + self._penalty
        right = columns @ shifted.T / noise**2
        energy = (shifted**2).sum(axis=1) / noise**2
        return np.asarray(energy - (right * np.linalg.solve(normal, right)).sum(axis=0))


class TimingSearch:
    """The misfits of all delays and lags for one gain and noise."""

    def __init__(self, grid: TimingGrid, shifted: FloatArray, noise: float) -> None:
        self._grid, self._shifted, self._noise = grid, shifted, noise
        self._misfit = grid.misfit_on_grid(shifted, noise)
        self._row, self._delay = (int(i) for i in np.unravel_index(np.argmin(self._misfit), self._misfit.shape))

    @property
    def coarse(self) -> Timing:
        """The best point of the grid."""
        return Timing(self._delay, float(self._grid.lags[self._row]))

    def fine(self, margin: float) -> Timing:
        """The best delay and lag, with the plausible ones: those whose misfit is within `margin` of the best."""
        nearby = range(max(self._delay - NEAR_DELAYS, 0), min(self._delay + NEAR_DELAYS + 1, len(self._shifted)))
        found = [self._refined(delay) for delay in nearby]
        misfit, best_delay, best_lag = min(found)
        on_grid = [
            (float(self._misfit[row, delay]), delay, float(lag))
            for row, lag in enumerate(self._grid.lags)
            for delay in range(len(self._shifted))
        ]
        others = [*on_grid, *(one for one in found if one[1] != best_delay)]
        plausible = [(delay, lag) for value, delay, lag in others if value - misfit < margin]
        return Timing(best_delay, best_lag, _extremes(plausible))

    def _refined(self, delay: int) -> tuple[float, int, float]:
        """Misfit, delay and lag with the lag between the points of the grid."""
        lags, shifted = self._grid.lags, self._shifted[delay : delay + 1]
        from scipy.optimize import minimize_scalar  # here: it takes half a second to load

        result = minimize_scalar(
            lambda lag: float(self._grid.misfit(float(lag), shifted, self._noise)[0]),
            bounds=(
                float(lags[max(self._row - NEAR_LAGS, 0)]),
                float(lags[min(self._row + NEAR_LAGS, len(lags) - 1)]),
            ),
            method="bounded",
            options={"xatol": LAG_PRECISION},
        )
        return float(result.fun), delay, float(result.x)


def _extremes(plausible: list[tuple[int, float]]) -> tuple[tuple[int, float], ...]:
    """Of these delays and lags, those with the least and the greatest sum, and with the least and greatest delay."""
    if not plausible:
        return ()
    by_sum = sorted(plausible, key=sum)
    return tuple(sorted({by_sum[0], by_sum[-1], min(plausible), max(plausible)}))
