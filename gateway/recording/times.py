"""Unix seconds as nanoseconds, and back to the very same float."""

from __future__ import annotations

from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray: TypeAlias = NDArray[np.float64]

NS = 1_000_000_000
_LATEST_S = 9.2e9  # the year 2261: as far as 64 bits of nanoseconds reach


def nanoseconds(time_s: ArrayLike) -> NDArray[np.int64]:
    """Nanoseconds since 1970.

    From April 1970 on, floats are more than a nanosecond apart, and `seconds` gives the same ones again, bit for bit.

    Args:
        time_s: (N,) or a number; what is before 1970 or after 2261 comes out as the nearer of the two.
    """
    bounded = np.clip(np.asarray(time_s, dtype=np.float64), 0.0, _LATEST_S)
    whole = np.floor(bounded)
    return whole.astype(np.int64) * NS + np.rint((bounded - whole) * NS).astype(np.int64)


def seconds(time_ns: NDArray[Any]) -> FloatArray:
    """(N,) unix seconds of nanoseconds."""
    whole, rest = np.divmod(time_ns.astype(np.int64), NS)
    sums: FloatArray = whole + rest / NS
    return sums


def nanosecond(time_s: float) -> int:
    """`nanoseconds` of one."""
    return int(nanoseconds(time_s))
