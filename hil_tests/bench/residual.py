"""What the general detectors are given to look at: the residual of a simple model of the thruster.

They know nothing of commands and speeds. So that they are not judged for that, each gets the relative residual of the
best simple model that there is of these runs: a cubic of the command behind a first-order lag and a delay, by least
squares over the first, healthy samples, lag and delay by trying all of a grid. It is relative to the predicted speed,
because a loss of speed is; and scaled by its own noise, so that default settings meet numbers of the size that they
were made for.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray
from scipy.signal import lfilter

from hil_tests.random_runs import ONSET_MIN, RandomRun

FloatArray = NDArray[np.float64]

FITTED = 600  # samples from the start that the model is fitted to; after them, but healthy, it shows how it predicts
CALIBRATION = ONSET_MIN  # samples from the start that are known to be healthy, for scale and threshold
ORDER = 3
DELAYS = range(11)
LAGS = (0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 4.5, 5.0, 5.5, 6.0, 7.0, 8.0)
SPEED_FLOOR = 0.05  # of the top speed: slower ones are divided by this
MEAN = 8  # samples of the short mean that is a feature beside the residual itself


def scaled_residual(run: RandomRun) -> FloatArray:
    """(N,) relative residual over its standard deviation in the calibration."""
    start, speed = max(DELAYS), run.speed_rpm
    best, predicted = np.inf, np.zeros_like(speed)
    for lag in LAGS:
        columns = _columns(run.command, lag)
        for delay in DELAYS:
            shifted = np.roll(columns, delay, axis=0)
            coefficients = np.linalg.lstsq(shifted[start:FITTED], speed[start:FITTED], rcond=None)[0]
            candidate = shifted @ coefficients
            misfit = float(((speed - candidate)[start:FITTED] ** 2).sum())
            if misfit < best:
                best, predicted = misfit, candidate
    relative = (speed - predicted) / np.maximum(predicted, SPEED_FLOOR * float(speed[:CALIBRATION].max()))
    relative[:start] = 0.0
    return np.asarray(relative / relative[:CALIBRATION].std())


def features(residual: FloatArray) -> FloatArray:
    """(N, 2): the residual, and its mean over the newest `MEAN` samples times sqrt(MEAN), both of unit scale."""
    mean = lfilter(np.full(MEAN, 1.0 / np.sqrt(MEAN)), [1.0], residual)
    return np.column_stack([residual, mean])


def _columns(command: FloatArray, lag: float) -> FloatArray:
    """(N, ORDER + 1) Chebyshev polynomials of the command, each behind the lag."""
    columns = chebyshev.chebvander(2.0 * command / float(command.max()) - 1.0, ORDER)
    share = 1.0 - np.exp(-1.0 / lag) if lag > 0.0 else 1.0
    start = (1.0 - share) * columns[:1]
    return np.asarray(lfilter([share], [1.0, share - 1.0], columns, axis=0, zi=start)[0])
