"""Learning a thruster from a window of samples: delay and lag, gain, order and window, noise.

The model is a Hammerstein model: the speed follows, by a first-order lag, the target that a static curve gives for
the delayed command. Within the window the gain may drift and follow the supply voltage. Both multiply the curve, so
the curve of a first pass makes the columns of the second.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, nan

import numpy as np
from numpy.typing import NDArray

from detectors.thruster.candidates import WindowCandidates
from detectors.thruster.config import ThrusterConfig
from detectors.thruster.lag import follow_gain
from detectors.thruster.least_squares import Fit, solve, whitener, with_drift
from detectors.thruster.model import Response, ThrusterModel, TransientError
from detectors.thruster.noise import (
    correlation,
    inflation,
    quiet_noise,
    robust_deviation,
    sensor_step_rpm,
    settling,
    shared_low_speed_variance,
    transient_error,
)
from detectors.thruster.search import Choice, Search
from detectors.thruster.timing import TimingGrid
from detectors.thruster.window import SHARE_MIN, Prepared, Window, prepare

FloatArray = NDArray[np.float64]

USABLE_MIN = 100  # samples that a model takes at least
FIRST_NOISE = 0.01  # of the top speed, before anything is known
TURNS = 2  # of the search for timing and drift
PLAUSIBLE = 9.0  # a delay and lag is plausible if it lowers the log likelihood by less than half of this
TRANSIENT_ERROR = 0.25  # part of the distance to the target that the lag model may err by on a way not seen before
TIMING_ERROR = 1.0  # samples by which a command may be stamped late, where it was not seen


def learn(
    window: Window, config: ThrusterConfig, search: Search, before: ThrusterModel | None = None
) -> ThrusterModel | None:
    """The thruster as this window shows it; None where it shows too little (at rest, or too few trusted samples).

    Args:
        before: an earlier model: where the search for the lag begins.
    """
    data = prepare(window, config.order_max, USABLE_MIN)
    if data is None:
        return None
    timing, drift = _timing(data, config.lag_max, None if before is None else before.response.lag)
    columns = data.lagged(timing.delay, timing.lag)
    candidates = WindowCandidates(
        columns * drift.gain, data.speed, data.usable, data.basis, config, noise=drift.noise
    )
    choice = search(candidates)
    recent = data.usable.copy()
    recent[: len(recent) - choice.window] = False
    curve = candidates.coefficients(choice) @ columns
    resolution_rpm = sensor_step_rpm(window.speed_rpm)
    errors = _errors(data, timing, columns, curve, recent, max(drift.noise, resolution_rpm / data.top_rpm / 12**0.5))
    weight = recent / errors.variance
    full = solve(*with_drift(columns, curve, data), data.speed, weight)
    correlated = correlation((full.residual * np.sqrt(weight))[recent])
    driven = (window.command[data.lead :] - data.basis.neutral)[recent]
    size = data.basis.size + 1
    prior = np.concatenate([data.basis.prior_deviation, [1.0]])
    return ThrusterModel(
        basis=data.basis,
        response=Response(timing.delay, timing.lag, _coefficients(data, columns, curve, choice, weight, full)),
        alternatives=timing.plausible,
        order=choice.order,
        window=choice.window,
        top_rpm=data.top_rpm,
        supply_exponent=float(full.coefficients[size - 1]),
        supply_v=data.supply_v,
        whitener=whitener(full.covariance[:size, :size], prior, inflation(correlated)),
        noise=errors.noise,
        correlation=correlated,
        spin_up=errors.spin_up,
        spin_down=errors.spin_down,
        timing=errors.timing,
        learnt_ahead=learnt_range(driven),
        learnt_astern=learnt_range(-driven),
        unsigned=data.unsigned,
        resolution_rpm=resolution_rpm,
        current_law=_current_law(window.current_a[recent], data.speed[recent]),
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Drift:
    """(N,) gain over the window, 1 at first; noise and correlation of what it leaves."""

    gain: FloatArray
    noise: float
    correlation: float


@dataclass(frozen=True, slots=True)
class _Timing:
    """Delay and lag, samples, and the extreme ones among those that are plausible as well."""

    delay: int
    lag: float
    plausible: tuple[Response, ...]


def _timing(data: Prepared, lag_max: float, lag: float | None) -> tuple[_Timing, _Drift]:
    """Delay and lag, and the drift of the gain: each is found with the other taken off, in turns."""
    grid = TimingGrid(data, lag_max, lag)
    drift = _Drift(np.ones_like(data.speed), FIRST_NOISE, 0.0)
    found = grid.search(drift.gain, drift.noise)
    for _ in range(TURNS):
        drift = _drift(data, found.delay, found.lag, drift)
        found = grid.search(drift.gain, drift.noise)
    return _Timing(found.delay, found.lag, found.plausible(PLAUSIBLE * inflation(drift.correlation))), drift


def _drift(data: Prepared, delay: int, lag: float, before: _Drift) -> _Drift:
    columns = data.lagged(delay, lag) * before.gain
    weight = data.usable / before.noise**2
    rough = solve(columns, data.basis.prior_deviation, data.speed, weight)
    fit = solve(*with_drift(columns, rough.coefficients @ columns, data), data.speed, weight)
    supply, linear, quadratic = fit.coefficients[-3:]
    change = 1.0 + supply * data.supply + linear * data.time + quadratic * data.time**2
    residual = fit.residual[data.usable]
    return _Drift(before.gain * np.clip(change, 0.5, 2.0), robust_deviation(residual), correlation(residual))


@dataclass(frozen=True, slots=True, eq=False)
class _Errors:
    """Noise, errors while the speed changes, and the (N,) variance that they make."""

    noise: float
    spin_up: TransientError
    spin_down: TransientError
    timing: TransientError
    variance: FloatArray


def _errors(
    data: Prepared, timing: _Timing, columns: FloatArray, curve: FloatArray, recent: NDArray[np.bool_], noise: float
) -> _Errors:
    """How far the model errs: at rest, on the way up and down, at the first sample of a step, and near standstill.

    What no polynomial follows near standstill must not bend it elsewhere: taken at the sensor's word, slow samples
    pull a curve that is held by few faster ones far off between them, with no doubt about it.
    """
    fit = solve(*with_drift(columns, curve, data), data.speed, recent / noise**2)
    coefficients = fit.coefficients[: data.basis.size]
    target, speed = coefficients @ data.static(timing.delay), coefficients @ columns
    distance, faster = np.abs(target - speed), np.abs(target) >= np.abs(speed)
    moving = recent & (data.static(timing.delay) != 0.0).any(axis=0)
    sensor_noise = max(quiet_noise(fit.residual[moving], distance[moving]), noise if not moving.any() else 0.0)
    way = settling(distance, timing.lag)
    up, down = recent & faster, recent & ~faster
    spin_up = transient_error(fit.residual[up], way[up], sensor_noise, TRANSIENT_ERROR)
    spin_down = transient_error(fit.residual[down], way[down], sensor_noise, TRANSIENT_ERROR)
    first_step = np.abs(np.diff(target)) * follow_gain(timing.lag)
    before = recent[:-1]
    late = transient_error(fit.residual[:-1][before], first_step[before], sensor_noise, TIMING_ERROR)
    transient = np.where(faster, spin_up.at(way), spin_down.at(way))
    variance = sensor_noise**2 + transient**2 + shared_low_speed_variance(speed, recent)
    return _Errors(sensor_noise, spin_up, spin_down, late, variance)


def _coefficients(
    data: Prepared, columns: FloatArray, curve: FloatArray, choice: Choice, weight: FloatArray, full: Fit
) -> FloatArray:
    """(K,) coefficients of the order that was chosen, 0 beyond it."""
    if choice.order == data.basis.order:
        return full.coefficients[: data.basis.size]
    kept = data.basis.up_to(choice.order)
    design, prior = with_drift(columns, curve, data)
    chosen = np.concatenate([kept, [True, True, True]])
    coefficients = np.zeros(data.basis.size)
    coefficients[kept] = solve(design[chosen], prior[chosen], data.speed, weight).coefficients[: int(kept.sum())]
    return coefficients


def learnt_range(command: FloatArray) -> tuple[float, float]:
    """Least and greatest of the positive commands, leaving out the `SHARE_MIN` outermost; (inf, -inf) for none."""
    positive = np.sort(command[command > 0.0])
    if len(positive) <= 2 * SHARE_MIN:
        return (inf, -inf)
    return float(positive[SHARE_MIN]), float(positive[-SHARE_MIN - 1])


def _current_law(current_a: FloatArray, speed: FloatArray) -> tuple[float, float]:
    """Idle current and current at top speed of a propeller whose torque grows with the square of the speed."""
    known = np.isfinite(current_a)
    if np.count_nonzero(known) < USABLE_MIN:
        return (nan, nan)
    design = np.stack([np.ones(int(known.sum())), np.abs(speed[known]) ** 3])
    idle, full = np.linalg.lstsq(design.T, current_a[known], rcond=None)[0]
    return (max(float(idle), 0.0), float(full)) if full > 0.0 else (nan, nan)
