"""Which samples of a mark are drawn: as many as one can see, and all that stand out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from gateway.plotting.decimation import decimated
from gateway.plotting.figure import Band, FloatArray, Line


def drawn_line(line: Line, points_max: int, *, over_time: bool) -> tuple[FloatArray, FloatArray]:
    """x and y of what is drawn of a line, with gaps (NaN in y). Along a track, extremes of x are kept as those of y.

    Args:
        line: any.
        points_max: about how many samples are wanted.
        over_time: x does nothing but grow.
    """
    x, y = np.asarray(line.x, dtype=float), np.where(np.isfinite(line.x), gapped(line.y), np.nan)
    kept = decimated(y, points_max) if over_time else _both(x, y, points_max)
    return x[kept], y[kept]


def alone(value: FloatArray) -> NDArray[np.bool_]:
    """(N,) which samples of a line have gaps on both sides: there is no line to draw."""
    known = np.isfinite(np.concatenate(([np.nan], value, [np.nan])))
    return known[1:-1] & ~known[:-2] & ~known[2:]


def band_samples(band: Band, points_max: int) -> NDArray[np.intp]:
    """Of a band (N,): indices, rising, with the extremes of both edges."""
    return _both(band.low, band.high, points_max)


def gapped(value: FloatArray) -> FloatArray:
    """With a gap (NaN) for all that is no number."""
    value = np.asarray(value, dtype=float)
    return np.where(np.isfinite(value), value, np.nan)


def known_in(*columns: FloatArray) -> NDArray[np.bool_]:
    """(N,) where none of the columns (N,) has a gap."""
    known: NDArray[np.bool_] = np.logical_and.reduce([np.isfinite(column) for column in columns])
    return known


def pieces(*columns: FloatArray) -> list[slice]:
    """Stretches in which none of the columns (N,) has a gap."""
    edges = np.flatnonzero(np.diff(known_in(*columns), prepend=False, append=False))
    return [slice(int(begin), int(end)) for begin, end in edges.reshape(-1, 2)]


def _both(one: FloatArray, other: FloatArray, points_max: int) -> NDArray[np.intp]:
    half = max(points_max // 2, 4)
    if len(one) <= points_max:
        return np.arange(len(one))
    return np.union1d(decimated(gapped(one), half), decimated(gapped(other), half))
