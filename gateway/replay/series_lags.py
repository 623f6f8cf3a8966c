"""Lags at which two logs' values change alike: the coarse half of `series_match`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy import fft

from gateway.replay.log_trace import Series

FloatArray: TypeAlias = NDArray[np.float64]

GRID_S = 0.05
GRID_POINTS_MAX = 1 << 18
GAP_S = 3.0  # values further apart are not joined
CANDIDATES = 5
APART_S = 2.0  # candidates, at least
COMMON_MIN = 0.05  # of the changes of at least one of the two


def span(series: Series) -> float:
    """From the least to the greatest value."""
    return float(np.ptp(series.value)) if len(series) > 1 else 0.0


def interval_s(series: Series) -> float:
    """Between two samples, usually."""
    return float(np.median(np.diff(series.time_s)))


def candidate_lags(firsts: Sequence[Series], seconds: Sequence[Series]) -> list[float]:
    """Lags at which the changes of two logs correlate most.

    Args:
        firsts, seconds: of each log the same thrusters' values, each of at least two samples that differ.

    Returns:
        At most `CANDIDATES`, to be added to the second log's times, the best first.
    """
    starts_s = [min(float(one.time_s[0]) for one in log) for log in (firsts, seconds)]
    spans_s = [
        max(float(one.time_s[-1]) for one in log) - start_s
        for log, start_s in zip((firsts, seconds), starts_s, strict=True)
    ]
    step_s = max(GRID_S, max(spans_s) / GRID_POINTS_MAX)
    smoothing = max(1, round(max(interval_s(one) for one in (*firsts, *seconds)) / step_s))
    size = fft.next_fast_len(int(sum(spans_s) / step_s) + 4, real=True)
    correlation = _correlation(
        [_changes(one, starts_s[0], spans_s[0], step_s, smoothing) for one in firsts],
        [_changes(one, starts_s[1], spans_s[1], step_s, smoothing) for one in seconds],
        size,
    )
    lags = np.arange(size)
    lags[lags > spans_s[0] / step_s + 1] -= size
    best = _peaks(correlation, lags * step_s, max(APART_S, 2.0 * smoothing * step_s))
    return [starts_s[0] - starts_s[1] + lag_s for lag_s in best]


def _changes(
    series: Series, start_s: float, span_s: float, step_s: float, smoothing: int
) -> tuple[FloatArray, FloatArray]:
    """(changes over a step of the grid, 1 where they are known)."""
    grid_s = start_s + np.arange(int(span_s / step_s) + 2) * step_s
    after = np.clip(np.searchsorted(series.time_s, grid_s), 1, len(series) - 1)
    known = (series.time_s[after] - series.time_s[after - 1] <= GAP_S) & (grid_s >= series.time_s[0])
    known &= grid_s <= series.time_s[-1]
    value = np.interp(grid_s, series.time_s, series.value / span(series))
    if smoothing > 1:
        value = np.convolve(value, np.full(smoothing, 1.0 / smoothing), mode="same")
    both = known[1:] & known[:-1]
    return np.diff(value) * both, both.astype(np.float64)


def _correlation(
    firsts: list[tuple[FloatArray, FloatArray]], seconds: list[tuple[FloatArray, FloatArray]], size: int
) -> FloatArray:
    """(size,) of the changes, by lag, over what both know: -1 to 1, and 0 where that is too little."""
    common = np.zeros(size)
    energies = np.zeros((2, size))
    for (one, one_known), (other, other_known) in zip(firsts, seconds, strict=True):
        common += _lagged(one, other, size)
        energies[0] += _lagged(one**2, other_known, size)
        energies[1] += _lagged(one_known, other**2, size)
    energies = np.maximum(energies, 0.0)
    whole = [sum(float(one @ one) for one, _ in log) for log in (firsts, seconds)]
    enough = (energies[0] > COMMON_MIN * whole[0]) | (energies[1] > COMMON_MIN * whole[1])
    scale = np.sqrt(energies[0] * energies[1])
    told = enough & (scale > 1e-9 * np.sqrt(whole[0] * whole[1]))
    correlation: FloatArray = np.divide(common, scale, out=np.zeros(size), where=told)
    return correlation


def _lagged(one: FloatArray, other: FloatArray, size: int) -> FloatArray:
    """(size,) sum over k of one[k + lag] other[k]."""
    lagged: FloatArray = fft.irfft(fft.rfft(one, size) * np.conj(fft.rfft(other, size)), size)
    return lagged


def _peaks(correlation: FloatArray, lag_s: FloatArray, apart_s: float) -> list[float]:
    """Lags of the greatest values, apart from each other."""
    left = correlation.copy()
    found: list[float] = []
    while len(found) < CANDIDATES and left.max() > 0.0:
        best_s = float(lag_s[int(np.argmax(left))])
        found.append(best_s)
        left[np.abs(lag_s - best_s) < apart_s] = 0.0
    return found
