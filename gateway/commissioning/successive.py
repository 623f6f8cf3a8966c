"""Dives one after the other, as if they were one."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from gateway.commissioning.dive import ThrusterSamples

FloatArray: TypeAlias = NDArray[np.float64]
Columns: TypeAlias = tuple[FloatArray, FloatArray, FloatArray, FloatArray, FloatArray]

PAUSE_S = 60.0  # between dives


def successive(dives: Sequence[ThrusterSamples]) -> Iterator[Columns]:
    """Columns of each dive for one detector that goes through all of them: times begin where the one before ended.

    Shifted by whole periods: the samples stay where they are on their grid.
    """
    end_s = -np.inf
    for one in dives:
        shift_s = 0.0
        if one.time_s[0] <= end_s:
            shift_s = np.ceil((end_s + PAUSE_S - one.time_s[0]) * one.rate_hz) / one.rate_hz
        time_s = one.time_s + shift_s
        end_s = float(time_s[-1])
        yield time_s, *one.columns()[1:]
