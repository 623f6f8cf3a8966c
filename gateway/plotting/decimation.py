"""Fewer points for a plot that looks the same: of every piece its lowest and its highest are kept."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def decimated(value: FloatArray, points_max: int) -> NDArray[np.intp]:
    """Which points of a line to draw (min/max decimation: no peak is lost, however short).

    Args:
        value: (N,); NaN is where the line has a gap, and stays one.
        points_max: how many are wanted at most; three more for each piece of the line with a gap.

    Returns:
        Indices, rising; first and last point among them. All of them where there are few enough.

    Raises:
        ValueError: fewer than four points are wanted.
    """
    if points_max < 4:
        raise ValueError(f"points_max = {points_max}: want 4 or more")
    count = len(value)
    if count <= points_max:
        return np.arange(count)
    pieces = _pieces(value, (points_max - 2) // 2)
    gap = np.isnan(pieces)
    begins = np.arange(len(pieces)) * pieces.shape[1]
    low = begins + np.where(gap, np.inf, pieces).argmin(axis=1)
    high = begins + np.where(gap, -np.inf, pieces).argmax(axis=1)
    broken = (begins + gap.argmax(axis=1))[gap.any(axis=1)]
    kept = np.unique(np.concatenate(([0], low, high, broken, [count - 1])))
    return kept[kept < count]


def _pieces(value: FloatArray, count: int) -> FloatArray:
    """(M, L) with M <= count pieces of the same length, the last filled up with gaps."""
    length = -(-len(value) // count)
    filled = np.full(-(-len(value) // length) * length, np.nan)
    filled[: len(value)] = value
    return filled.reshape(-1, length)
