"""What sensors make of the truth: when positions come, how far they are off, and what goes wrong with them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

FloatArray = NDArray[np.float64]

HEADING_NOISE_DEG = (1.0, 2.0)
COMPASS_ERROR_DEG = 2.0  # constant, at most, to either side
# of rough missions, the share in which each of these goes wrong
IRREGULAR, CORRELATED, GAPS, REPEATED, OUTLIERS, JUMP = 1 / 2, 1 / 2, 1 / 3, 1 / 3, 1 / 3, 1 / 4
JITTER = 0.5  # irregular intervals are off by up to so much, relative
CORRELATED_SHARE_MAX = 0.5  # of the variance
CORRELATION_S = (3.0, 30.0)
GAPS_MAX, GAP_S = 3, (5.0, 30.0)
REPEATED_SHARE = (0.1, 0.6)
OUTLIER_SHARE = (0.002, 0.02)
FAR = (10.0, 60.0)  # outliers and jumps, in standard deviations of the noise


@dataclass(frozen=True, slots=True, kw_only=True)
class Sensors:
    """How good the sensors of one mission are.

    Attributes:
        noise_m: standard deviation of a position, in each of north and east.
        correlated: share of its variance that wanders, with time constant `correlation_s`.
        repeated, outliers: share of the positions that are the one before again, or far off.
        jump_s: when the frame of the positions is moved for good; NaN for never.
        heading_noise_rad, compass_error_rad: standard deviation and constant part of the heading's error.
    """

    noise_m: float
    heading_noise_rad: float
    compass_error_rad: float
    correlated: float = 0.0
    correlation_s: float = CORRELATION_S[0]
    repeated: float = 0.0
    outliers: float = 0.0
    jump_s: float = float("nan")


def random_sensors(rng: np.random.Generator, noise_m: float, duration_s: float, rough: bool) -> Sensors:
    """Sensors with noise alone, or some of those that have more wrong."""
    heading_noise_rad = np.radians(rng.uniform(*HEADING_NOISE_DEG))
    compass_error_rad = np.radians(rng.uniform(-COMPASS_ERROR_DEG, COMPASS_ERROR_DEG))
    if not rough:
        return Sensors(noise_m=noise_m, heading_noise_rad=heading_noise_rad, compass_error_rad=compass_error_rad)
    return Sensors(
        noise_m=noise_m,
        heading_noise_rad=heading_noise_rad,
        compass_error_rad=compass_error_rad,
        correlated=_sometimes(rng, CORRELATED, 0.0, CORRELATED_SHARE_MAX),
        correlation_s=rng.uniform(*CORRELATION_S),
        repeated=_sometimes(rng, REPEATED, *REPEATED_SHARE),
        outliers=_sometimes(rng, OUTLIERS, *OUTLIER_SHARE),
        jump_s=_sometimes(rng, JUMP, 0.1 * duration_s, duration_s) or float("nan"),
    )


def random_instants(rng: np.random.Generator, rate_hz: float, duration_s: float, rough: bool) -> FloatArray:
    """(N,) instants of the positions: even, or in some rough missions irregular or with gaps."""
    count = int(duration_s * rate_hz)
    irregular = rough and rng.random() < IRREGULAR
    intervals_s = (
        rng.uniform(1.0 - JITTER, 1.0 + JITTER, count) / rate_hz if irregular else np.full(count, 1 / rate_hz)
    )
    time_s = np.cumsum(intervals_s) - intervals_s[0]
    for _ in range(rng.integers(1, GAPS_MAX + 1) if rough and rng.random() < GAPS else 0):
        begin_s = rng.uniform(0.1, 0.9) * duration_s
        time_s = time_s[(time_s < begin_s) | (time_s > begin_s + rng.uniform(*GAP_S))]
    return np.asarray(time_s[time_s < duration_s])


def measured_positions(
    rng: np.random.Generator, sensors: Sensors, time_s: FloatArray, position_m: FloatArray
) -> FloatArray:
    """(N, 2) positions as the sensors give them, of (N, 2) true ones."""
    count = len(time_s)
    white_m = np.sqrt(1.0 - sensors.correlated) * rng.standard_normal((count, 2))
    wandering_m = np.sqrt(sensors.correlated) * _wandering(rng, time_s, sensors.correlation_s)
    seen_m = position_m + sensors.noise_m * (white_m + wandering_m)
    if np.isfinite(sensors.jump_s):
        seen_m = seen_m + np.where(time_s[:, np.newaxis] > sensors.jump_s, _far(rng, sensors, 1), 0.0)
    off = rng.random(count) < sensors.outliers
    seen_m[off] += _far(rng, sensors, int(off.sum()))
    fresh = np.append(True, rng.random(count - 1) >= sensors.repeated)
    return np.asarray(seen_m[np.maximum.accumulate(np.where(fresh, np.arange(count), 0))])


def measured_headings(rng: np.random.Generator, sensors: Sensors, heading_rad: FloatArray) -> FloatArray:
    """(N,) headings as the compass gives them, -pi to pi, of (N,) true ones."""
    noise_rad = sensors.heading_noise_rad * rng.standard_normal(len(heading_rad))
    seen_rad = heading_rad + sensors.compass_error_rad + noise_rad
    return np.asarray(np.arctan2(np.sin(seen_rad), np.cos(seen_rad)))


def wander(rng: np.random.Generator, count: int, keep: float) -> FloatArray:
    """(count,) first-order autoregression of unit standard deviation; `keep` is its correlation over one sample."""
    white = rng.standard_normal(count)
    return np.asarray(lfilter([1.0], [1.0, -keep], np.append(white[:1], np.sqrt(1.0 - keep**2) * white[1:])))


def _wandering(rng: np.random.Generator, time_s: FloatArray, correlation_s: float) -> FloatArray:
    """(N, 2) of unit standard deviation, drawn at even instants and read between them."""
    even_s = np.arange(0.0, time_s[-1] + 1.0)
    keep = float(np.exp(-1.0 / correlation_s))
    return np.column_stack([np.interp(time_s, even_s, wander(rng, len(even_s), keep)) for _ in range(2)])


def _sometimes(rng: np.random.Generator, share: float, low: float, high: float) -> float:
    """Uniform between the bounds, in a share of the calls; else 0."""
    happens, value = rng.random() < share, rng.uniform(low, high)
    return float(value) if happens else 0.0


def _far(rng: np.random.Generator, sensors: Sensors, count: int) -> FloatArray:
    distance_m = sensors.noise_m * rng.uniform(*FAR, count)
    bearing_rad = rng.uniform(-np.pi, np.pi, count)
    return np.asarray(distance_m * [np.cos(bearing_rad), np.sin(bearing_rad)]).T
