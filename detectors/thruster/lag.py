"""First-order motor lag: the speed follows its target by the same part of the distance at every sample."""

from __future__ import annotations

from math import exp

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

LAG_NEGLIGIBLE = 0.05  # samples
GRID_STEPS = 12


def follow_gain(lag: float) -> float:
    """Part of the distance to the target that is covered in one sample, for a time constant in samples."""
    return 1.0 if lag < LAG_NEGLIGIBLE else 1.0 - exp(-1.0 / lag)


def lagged(columns: FloatArray, lag: float) -> FloatArray:
    """(K, N) columns after a lag of this many samples, starting from rest at the first of them."""
    gain = follow_gain(lag)
    return columns if gain == 1.0 else _filtered(columns, gain, columns[:, :1])


def followed(target: FloatArray, speed: float, gain: float) -> FloatArray:
    """(N,) speeds that follow (N,) targets with this gain, after one of `speed`. The same in blocks as one by one."""
    return target if gain == 1.0 else _filtered(target[None, :], gain, np.array([[speed]]))[0]


def _filtered(columns: FloatArray, gain: float, before: FloatArray) -> FloatArray:
    """y_t = gain x_t + (1 - gain) y_(t-1) along (K, N) columns, after (K, 1) of `before`."""
    from scipy.signal import lfilter  # here: all of it takes a second to load, and only a detector at work needs it

    start = (1.0 - gain) * before
    return np.asarray(lfilter([gain], [1.0, gain - 1.0], columns, axis=1, zi=start)[0])


def lag_grid(lag_max: float) -> FloatArray:
    """Lags to try, from none to `lag_max`, closer together where they are short."""
    return lag_max * np.linspace(0.0, 1.0, GRID_STEPS) ** 1.6
