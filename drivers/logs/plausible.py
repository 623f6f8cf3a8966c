"""What is passed over in columns of a log, and what is not known in them."""

from __future__ import annotations

from math import isnan
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from drivers.logs.damage import DamageReport

FloatArray: TypeAlias = NDArray[np.float64]
IndexArray: TypeAlias = NDArray[np.intp]
Mask: TypeAlias = NDArray[np.bool_]


def refuse(damage: DamageReport, offset: IndexArray, refused: Mask, cause: str) -> None:
    """Tells how many of (N,) rows are passed over, and where in the log the first of them stands."""
    count = int(refused.sum())
    if count:
        damage.add(cause, f"offset {int(offset[refused][0])}", count)


def refuse_at(damage: DamageReport, boot_s: FloatArray, refused: Mask, cause: str) -> None:
    """The same of a log that does not tell where in it a row stands: by its time since the autopilot's start."""
    count = int(refused.sum())
    if count:
        damage.add(cause, f"{boot_s[refused][0]:.3f} s", count)


def within(columns: FloatArray, limit: float) -> Mask:
    """(N,) which rows of (N, M) have no number beyond the limit, and all that are numbers."""
    good: Mask = np.logical_and.reduce(np.abs(columns) <= limit, axis=1)
    return good


def between(column: FloatArray, lowest: float, highest: float) -> FloatArray:
    """(N,) NaN where not strictly between the two: how senders say that they do not know."""
    return np.where((lowest < column) & (column < highest), column, np.nan)


def optional(column: FloatArray) -> list[float | None]:
    """N numbers, None where NaN."""
    if not np.isnan(column).any():
        return list(column.tolist())
    return [None if isnan(number) else number for number in column.tolist()]
