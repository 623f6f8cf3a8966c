"""What is left of the speed when the model is taken off: noise, errors while the speed changes, the sensor's step."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from detectors.thruster.fading import FadingMaximum
from detectors.thruster.model import TransientError

FloatArray = NDArray[np.float64]

NOISE_MIN = 3e-4  # standard deviation of the speed in top speeds: no sensor is taken to be better
TRANSIENT_ERROR_MAX = 2.0  # of the change
SEEN_SAMPLES = 15  # samples with a change of this size or beyond before that change counts as seen
CORRELATION_MAX = 0.97
LOW_SPEED_ERROR = 0.04  # error of the curve, in top speeds, near standstill; it vanishes above about 0.2 of top speed
LOW_SPEED = 0.1


def quiet_noise(residual: FloatArray, distance: FloatArray) -> float:
    """Standard deviation in the half of the samples that are nearest to their target; tolerant of outliers."""
    if not len(residual):
        return NOISE_MIN
    quiet = residual[distance <= np.median(distance)]
    robust = robust_deviation(quiet)
    return max(robust, 0.7 * float(np.sqrt(np.mean(np.clip(quiet, -4 * robust, 4 * robust) ** 2))))


def robust_deviation(residual: FloatArray) -> float:
    """Standard deviation of a normal distribution with this median magnitude, at least `NOISE_MIN`."""
    return max(1.4826 * float(np.median(np.abs(residual))), NOISE_MIN)


def low_speed_error(speed: FloatArray) -> FloatArray:
    """(N,) error that a smooth curve makes at these speeds: a dead band, or a steep start, is no polynomial."""
    slowness = (speed / LOW_SPEED) * (speed / LOW_SPEED)
    return np.asarray(LOW_SPEED_ERROR / (1.0 + slowness * slowness))


def shared_low_speed_variance(speed: FloatArray, counted: NDArray[np.bool_]) -> FloatArray:
    """(N,) variance that gives slow samples, all together, no more weight than one with `low_speed_error`.

    They share their error: a thousand of them say no more of the curve than one.
    """
    error = low_speed_error(speed)
    together = float(error[counted].sum()) / LOW_SPEED_ERROR
    return np.asarray(max(together, 1.0) * error * error)


def settling_decay(lag: float) -> float:
    """Part of a transient's error that is still expected one sample later."""
    return float(np.exp(-1.0 / (2.0 * lag + 4.0)))


def settling(distance: FloatArray, lag: float) -> FloatArray:
    """(N,) the distance to the target with a memory: a step is not over when the lag model says so."""
    return FadingMaximum(settling_decay(lag)).over(distance)[0]


def transient_error(residual: FloatArray, change: FloatArray, noise: float, unseen_share: float) -> TransientError:
    """How far the model errs while the speed changes by this much, and up to what change that was seen."""
    energy = float((change**4).sum()) + 1e-30
    seen = float(((residual**2 - noise**2) * change**2).sum()) / energy
    doubt = 2.0 * noise**2 * float(np.sqrt(2.0 / energy))
    share = min(float(np.sqrt(max(seen, 0.0) + doubt)), TRANSIENT_ERROR_MAX)
    far = float(np.sort(change)[-SEEN_SAMPLES]) if len(change) >= SEEN_SAMPLES else 0.0
    return TransientError(share, far, max(share, unseen_share))


def correlation(residual: FloatArray) -> float:
    """Of neighbouring residuals, within 0..0.97."""
    if len(residual) < 3 or not residual.std() > 0.0:
        return 0.0
    centred = residual - residual.mean()
    return float(np.clip((centred[1:] * centred[:-1]).mean() / (centred**2).mean(), 0.0, CORRELATION_MAX))


def inflation(correlated: float) -> float:
    """Variance of a mean of correlated samples over that of independent ones."""
    return (1.0 + correlated) / (1.0 - correlated)


def sensor_step_rpm(speed_rpm: FloatArray) -> float:
    """The step that the sensor's readings are multiples of; 0 where there is none."""
    steps = np.abs(np.diff(speed_rpm))
    steps = steps[steps > 0.0]
    if not len(steps):
        return 0.0
    smallest = float(np.quantile(steps, 0.02))
    multiples = steps / smallest
    stepped = np.mean(np.abs(multiples - np.round(multiples)) < 0.02 * np.maximum(multiples, 1.0)) > 0.9
    return smallest if stepped else 0.0
