"""Has the gain changed? The newest samples' mean gain error against that of the samples before, on five time scales.

A fault is a fast, lasting, multiplicative change. Drift of gain is slow: it is in the newest samples and in those
before alike. An error of delay, lag or curve shows in transients or after a change of command: the weights and the
standard deviation of each mean know of those. What remains is tested: the mean relative residual of the newest n
samples, less that of the reference before them, over its standard deviation, and against a least change that matters.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

NEWEST = np.array([3, 8, 20, 50, 100])  # n, samples
CHANGE_MIN = np.array([0.12, 0.035, 0.026, 0.018, 0.08])  # least relative change that is a fault
FLOOR = np.array([0.006, 0.006, 0.004, 0.0045, 0.008])  # standard deviation that no mean gain error is better than
REFERENCE = np.array([80, 80, 80, 100, 400])
APART = 4  # samples between reference and newest
REACH = int((NEWEST + APART + REFERENCE).max())  # samples that a test looks back on
DEVIATIONS = 4.7  # standard deviations that are a fault
ELSEWHERE = 0.016  # extra standard deviation per full scale of distance between the commands of newest and reference
ELSEWHERE_MAX = 0.008
HEADROOM = 1.3  # a statistic that healthy samples reached is not a fault below this multiple
SHARE_MIN = 0.3  # of a window's samples, counted by their weight, that it takes to be judged at all

WEIGHT, WEIGHT_SQUARED, ERROR, COMMAND, SYSTEMATIC, UNCERTAINTY = range(6)  # rows; uncertainty takes the rest


@dataclass(frozen=True, slots=True, eq=False)
class GainChange:
    """For N samples on the five scales, (5, N) each.

    Attributes:
        change: mean gain error of the newest samples less the reference's; 0 where it cannot be judged.
        deviation: its standard deviation.
        newest, reference: the two means.
        newest_deviation: standard deviation of the newest samples' mean alone; infinite where there are too few.
    """

    change: FloatArray
    deviation: FloatArray
    newest: FloatArray
    reference: FloatArray
    newest_deviation: FloatArray


class RunningSums:
    """Sums over the samples so far of weight, weighted gain error and what else the test needs.

    Args:
        rows: of the quantities that are summed.
        capacity: number of samples that it takes.
    """

    def __init__(self, rows: int, capacity: int) -> None:
        self._sums = np.zeros((rows, capacity + 1))
        self.count = 0

    @property
    def room(self) -> int:
        return int(self._sums.shape[1]) - 1 - self.count

    def extend(self, values: FloatArray) -> None:
        """Add (rows, N) values, one sample after the other: the same in blocks as one by one."""
        start, stop = self.count, self.count + values.shape[1]
        with_sum = np.concatenate([self._sums[:, start : start + 1], values], axis=1)
        self._sums[:, start : stop + 1] = np.cumsum(with_sum, axis=1)
        self.count = stop

    def forget(self, count: int) -> None:
        """Take the newest samples out again."""
        self.count -= count

    def test(self, samples: int, scale: float, correlation: float) -> GainChange:
        """Test the newest samples, each with what was before it.

        Args:
            samples: how many.
            scale: full scale of the command.
            correlation: of neighbouring residuals.
        """
        stop = np.arange(self.count - samples + 1, self.count + 1)
        newest = self._windows(samples, 0 * NEWEST, NEWEST)
        reference = self._windows(samples, NEWEST + APART, NEWEST + APART + REFERENCE)
        enough_new = _effective_samples(newest) >= SHARE_MIN * NEWEST[:, None]
        enough = enough_new & (_effective_samples(reference) >= SHARE_MIN * REFERENCE[:, None])
        enough &= stop >= NEWEST[:, None]
        weight_newest = np.where(newest[WEIGHT] > 0.0, newest[WEIGHT], 1.0)
        weight_reference = np.where(reference[WEIGHT] > 0.0, reference[WEIGHT], 1.0)
        mean_newest, mean_reference = newest / weight_newest, reference / weight_reference
        own = _inflation(NEWEST, correlation)[:, None] / weight_newest + mean_newest[SYSTEMATIC] ** 2
        other = _inflation(REFERENCE, correlation)[:, None] / weight_reference
        variance = own + other + mean_reference[SYSTEMATIC] ** 2 + (FLOOR**2)[:, None]
        distance = np.abs(mean_newest[COMMAND] - mean_reference[COMMAND]) / scale
        variance += np.minimum(ELSEWHERE * distance, ELSEWHERE_MAX) ** 2
        for row in mean_newest[UNCERTAINTY:] - mean_reference[UNCERTAINTY:]:
            variance += row * row
        change = np.where(enough, mean_newest[ERROR] - mean_reference[ERROR], 0.0)
        alone = np.where(enough_new, np.sqrt(own), np.inf)
        return GainChange(change, np.sqrt(variance), mean_newest[ERROR], mean_reference[ERROR], alone)

    def _windows(self, samples: int, newest: NDArray[np.int_], oldest: NDArray[np.int_]) -> FloatArray:
        """(rows, 5, samples) sums over the samples from `newest` to `oldest` before each of the last `samples`."""
        windows = np.empty((len(self._sums), len(newest), samples))
        for scale, (a, b) in enumerate(zip(newest.tolist(), oldest.tolist(), strict=True)):
            np.subtract(self._until(samples, a), self._until(samples, b), out=windows[:, scale])
        return windows

    def _until(self, samples: int, back: int) -> FloatArray:
        """(rows, samples) sums up to `back` samples before each of the last `samples`; 0 before the first."""
        stop = self.count + 1 - back
        start = stop - samples
        if start >= 0:
            return self._sums[:, start:stop]
        return self._sums[:, np.maximum(np.arange(start, stop), 0)]


def _inflation(samples: NDArray[np.int_], correlation: float) -> FloatArray:
    """Variance of the mean of so many samples of an autoregressive series over that of independent ones."""
    apart = 1.0 - correlation
    within = 2.0 * correlation * (1.0 - correlation**samples) / (samples * apart**2)
    return np.asarray((1.0 + correlation) / apart - within)


def _effective_samples(sums: FloatArray) -> FloatArray:
    """How many equally weighted samples would say as much: (sum of w)^2 / sum of w^2 (Kish)."""
    squared = sums[WEIGHT_SQUARED]
    effective: FloatArray = np.divide(sums[WEIGHT] ** 2, squared, out=np.zeros_like(squared), where=squared > 0.0)
    return effective
