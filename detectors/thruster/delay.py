"""Transport delay from command to speed, by the maximum of Pearson correlation (paper 000, section 3)."""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def correlations(command: FloatArray, speed_rpm: FloatArray, delay_max: int) -> FloatArray:
    """Correlation of the command with the speed `delay` samples later, for every delay (equations 1 and 2).

    Every delay is judged by the same number of pairs, N - delay_max, as in the paper.

    Args:
        command: (N,) command, oldest first. For a speed sensor without a sign hand in its magnitude.
        speed_rpm: (N,) speed of the same samples.
        delay_max: longest delay to look at, in samples; N must exceed it by at least 2.

    Returns:
        (delay_max + 1,) coefficients in -1..1; NaN where one of the two series does not change.

    Raises:
        ValueError: shapes differ, or too few samples.
    """
    _check(command, speed_rpm, delay_max)
    pairs = len(command) - delay_max
    u = command[:pairs]
    v = sliding_window_view(speed_rpm, pairs)  # row tau: v_{tau+1} .. v_{tau+N-tau_max}
    du = u - u.mean()
    dv = v - v.mean(axis=1, keepdims=True)
    result = np.full(delay_max + 1, np.nan)
    # compared exactly: centring a constant leaves rounding behind, which would correlate with anything
    changes = (np.ptp(v, axis=1) > 0.0) & (np.ptp(u) > 0.0)
    norm = np.sqrt((du @ du) * np.einsum("ij,ij->i", dv, dv))
    np.divide(dv @ du, norm, out=result, where=changes & (norm > 0.0))
    return result


def estimate_delay(command: FloatArray, speed_rpm: FloatArray, delay_max: int, default: int = 0) -> int:
    """Delay in samples at which the correlation is greatest (equation 3); the shortest of equals.

    Args:
        command, speed_rpm, delay_max: as for `correlations`.
        default: the answer where nothing changes, so that no delay can be known (for example the last one known).

    Raises:
        ValueError: shapes differ, or too few samples.
    """
    r = correlations(command, speed_rpm, delay_max)
    return default if np.isnan(r).all() else int(np.nanargmax(r))


def align(command: FloatArray, speed_rpm: FloatArray, delay: int) -> tuple[FloatArray, FloatArray]:
    """Each speed beside the command that caused it (equation 14): two series of N - delay samples."""
    return command[: len(command) - delay], speed_rpm[delay:]


def _check(command: FloatArray, speed_rpm: FloatArray, delay_max: int) -> None:
    if command.ndim != 1 or command.shape != speed_rpm.shape:
        raise ValueError(f"command {command.shape} and speed_rpm {speed_rpm.shape}: want two series of one length")
    if delay_max < 0:
        raise ValueError(f"delay_max = {delay_max}: want 0 or more samples")
    if len(command) < delay_max + 2:
        raise ValueError(f"{len(command)} samples: want at least delay_max + 2 = {delay_max + 2}")
