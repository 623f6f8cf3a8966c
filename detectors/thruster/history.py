"""The latest samples of a thruster, as arrays."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

TIME, COMMAND, SPEED, VOLTAGE, CURRENT, TRUSTED = range(6)  # rows
ROWS = 6


class History:
    """The latest samples, oldest first, in one array with a row for each quantity.

    Args:
        rows: number of quantities.
        keep: number of samples that stay available at least.
    """

    def __init__(self, rows: int, keep: int) -> None:
        self._keep = keep
        self._array = np.empty((rows, 2 * keep))
        self._start = 0  # number of the sample in column 0
        self.end = 0  # number of samples seen

    @property
    def first(self) -> int:
        """Number of the oldest sample that is still here."""
        return max(self._start, self.end - self._keep)

    def append(self, block: FloatArray) -> None:
        """Take (rows, N) samples in, N at most `keep`; the oldest are forgotten."""
        size = block.shape[1]
        used = self.end - self._start
        if used + size > self._array.shape[1]:
            kept = min(self._keep, used)
            self._array[:, :kept] = self._array[:, used - kept : used].copy()
            self._start = self.end - kept
            used = kept
        self._array[:, used : used + size] = block
        self.end += size

    def drop_newest(self, count: int) -> None:
        """Take the newest samples out again."""
        self.end -= count

    def row(self, index: int, start: int, stop: int) -> FloatArray:
        """Samples number start..stop-1 of one quantity: a view. Before the first sample, the first one's value."""
        low = start - self._start
        if low >= 0:
            return self._array[index, low : stop - self._start]
        head = np.full(-low, self._array[index, 0])
        return np.concatenate([head, self._array[index, : max(stop - self._start, 0)]])[: stop - start]
