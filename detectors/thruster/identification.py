"""Learning a thruster from a window of samples: delay and lag, gain, order and window, noise.

The model is a Hammerstein model: the speed follows, by a first-order lag, the target that a static curve gives for the
delayed command. For a given delay and lag it is linear in the coefficients of the curve, so that every delay and lag
of a grid costs one small least-squares problem. Delays share their normal matrix: it is the speed that is shifted.

Within the window the gain may drift (two columns, linear and quadratic in time) and follow the supply voltage (one
more); both multiply the curve, so the curve of a first pass makes the columns of the second.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, nan

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from detectors.thruster.candidates import WindowCandidates
from detectors.thruster.config import ThrusterConfig
from detectors.thruster.curve import CommandBasis
from detectors.thruster.lag import follow_gain, lag_grid, lagged
from detectors.thruster.model import Response, ThrusterModel, TransientError
from detectors.thruster.search import Search

FloatArray = NDArray[np.float64]

RUN_IN = 40  # samples at the window's start whose lag state is not known
SHARE_MIN = 15  # samples beyond a command before the commands up to it count as learnt
USABLE_MIN = 100  # samples that a model takes at least
TREND_SAMPLES = 1500.0  # time scale of the gain's drift
TREND_DEVIATION = 0.1  # relative drift of the gain expected over that time
SUPPLY_DEVIATION = 1.0  # of the supply exponent
NOISE_MIN = 3e-4  # standard deviation of the speed in top speeds: no sensor is taken to be better
PLAUSIBLE = 9.0  # a delay and lag is plausible if it lowers the log likelihood by less than half of this
TRANSIENT_ERROR_MAX = 2.0  # of the distance to the target
TRANSIENT_ERROR = 0.25  # part of the distance to the target that the lag model may err by on a way not seen before
TIMING_ERROR = 1.0  # samples by which a command may be stamped late, where it was not seen
SEEN_SAMPLES = 15  # samples with a change of this size or beyond before that change counts as seen
CORRELATION_MAX = 0.97


@dataclass(frozen=True, slots=True, eq=False)
class Window:
    """The samples to learn from: (N,) each, but the command, which has `delay_max` earlier ones in front.

    Attributes:
        trusted: samples to learn from; the others are only passed through.
        voltage_v, current_a: NaN where not measured.
    """

    command: FloatArray
    speed_rpm: FloatArray
    trusted: NDArray[np.bool_]
    voltage_v: FloatArray
    current_a: FloatArray

    @property
    def lead(self) -> int:
        """Number of earlier commands in front."""
        return len(self.command) - len(self.speed_rpm)


@dataclass(frozen=True, slots=True, eq=False)
class _Data:
    """A window made ready: signed speeds in top speeds, basis columns, what may drift."""

    basis: CommandBasis
    columns: FloatArray  # (K, lead + N)
    lead: int
    speed: FloatArray  # (N,)
    usable: NDArray[np.bool_]  # (N,)
    time: FloatArray  # (N,) 0 at the newest
    supply: FloatArray  # (N,) relative deviation of the supply voltage, 0 where not measured

    def lagged(self, delay: int, lag: float) -> FloatArray:
        """(K, N) columns as they show in the speed."""
        moved = lagged(self.columns, lag)
        return moved[:, self.lead - delay : moved.shape[1] - delay]


@dataclass(frozen=True, slots=True, eq=False)
class _Fit:
    """A solved least-squares problem: coefficients, covariance, residual of all N samples."""

    coefficients: FloatArray
    covariance: FloatArray
    residual: FloatArray


def learn(window: Window, config: ThrusterConfig, search: Search) -> ThrusterModel | None:
    """The thruster as this window shows it; None where it shows too little (at rest, or too few trusted samples)."""
    scale = float(np.abs(window.command).max())
    top_rpm = float(np.quantile(np.abs(window.speed_rpm), 0.995))
    if scale <= 0.0 or top_rpm <= 0.0 or np.count_nonzero(window.trusted) < USABLE_MIN:
        return None
    supply_v = _nominal(window.voltage_v)
    data, unsigned = _prepare(window, config, scale, top_rpm, supply_v)
    if np.count_nonzero(data.usable) < USABLE_MIN:
        return None
    gain, noise, correlation = np.ones_like(data.speed), 0.01, 0.0
    for _ in range(2):
        table = _Table(data, gain, noise, config)
        delay, lag = table.best
        gain, noise, correlation = _drift(data, delay, lag, gain, noise)
    table = _Table(data, gain, noise, config)
    delay, lag, plausible = table.refined(PLAUSIBLE * _inflation(correlation))
    return _conclude(
        window, data, config, search, _Setting(delay, lag, plausible, gain, noise), top_rpm, supply_v, unsigned
    )


@dataclass(frozen=True, slots=True, eq=False)
class _Setting:
    delay: int
    lag: float
    plausible: tuple[tuple[int, float], ...]
    gain: FloatArray
    noise: float


def _conclude(
    window: Window,
    data: _Data,
    config: ThrusterConfig,
    search: Search,
    setting: _Setting,
    top_rpm: float,
    supply_v: float,
    unsigned: bool,
) -> ThrusterModel:
    """Order and window, noise, coefficients and their covariance, for the delay and lag that were found."""
    columns = data.lagged(setting.delay, setting.lag)
    candidates = WindowCandidates(
        columns * setting.gain, data.speed, data.usable, data.basis, config, noise=setting.noise
    )
    choice = search(candidates)
    recent = data.usable.copy()
    recent[: len(recent) - choice.window] = False
    design, prior = _with_drift(columns, columns.T @ candidates.coefficients(choice), data)
    first = _solve(design, data.speed, prior, recent / setting.noise**2)
    static = data.columns[:, data.lead - setting.delay : data.columns.shape[1] - setting.delay]
    distance = np.abs(first.coefficients[: data.basis.size] @ (static - columns))
    faster = np.abs(first.coefficients[: data.basis.size] @ static) >= np.abs(
        first.coefficients[: data.basis.size] @ columns
    )
    resolution_rpm = _resolution_rpm(window.speed_rpm)
    moving = recent & (np.abs(static).sum(axis=0) > 0.0)
    noise = max(_quiet_noise(first.residual[moving], distance[moving]), resolution_rpm / top_rpm / np.sqrt(12.0))
    way = _settling(distance, setting.lag)
    up = _transient_error(first.residual, way, recent & faster, noise, TRANSIENT_ERROR)
    down = _transient_error(first.residual, way, recent & ~faster, noise, TRANSIENT_ERROR)
    steps = np.abs(np.diff(first.coefficients[: data.basis.size] @ static, append=0.0)) * follow_gain(setting.lag)
    timing = _transient_error(first.residual[:-1], steps[:-1], recent[:-1], noise, TIMING_ERROR)
    spread = (np.where(faster, up.at(way), down.at(way)) / noise) ** 2
    final = _solve(design, data.speed, prior, recent / (noise**2 * (1.0 + spread)))
    correlation = _correlation((final.residual / np.sqrt(1.0 + spread))[recent])
    size = data.basis.size
    coefficients = final.coefficients[:size] * data.basis.up_to(choice.order)
    if choice.order < data.basis.order:
        lower = data.basis.up_to(choice.order)
        kept = np.concatenate([lower, np.ones(len(design) - size, dtype=bool)])
        reduced = _solve(design[kept], data.speed, prior[kept], recent / (noise**2 * (1.0 + spread)))
        coefficients = np.zeros(size)
        coefficients[lower] = reduced.coefficients[: int(lower.sum())]
    learnt = [_learnt(window.command[data.lead :][recent] * side) for side in (1.0, -1.0)]
    return ThrusterModel(
        basis=data.basis,
        response=Response(setting.delay, setting.lag, coefficients),
        alternatives=tuple(_alternative(data, setting.gain, d, l, noise) for d, l in setting.plausible),
        order=choice.order,
        window=choice.window,
        top_rpm=top_rpm,
        supply_exponent=float(final.coefficients[size]),
        supply_v=supply_v,
        whitener=_whitener(final.covariance[: size + 1, : size + 1], prior[: size + 1], correlation),
        noise=noise,
        correlation=correlation,
        spin_up=up,
        spin_down=down,
        timing=timing,
        learnt_ahead=learnt[0],
        learnt_astern=learnt[1],
        unsigned=unsigned,
        resolution_rpm=resolution_rpm,
        current_law=_current_law(window.current_a[recent], data.speed[recent]),
    )


# ---------------------------------------------------------------------------------------------------- preparation


def _nominal(voltage_v: FloatArray) -> float:
    measured = voltage_v[np.isfinite(voltage_v)]
    return float(np.median(measured)) if len(measured) > len(voltage_v) // 2 else nan


def _prepare(
    window: Window, config: ThrusterConfig, scale: float, top_rpm: float, supply_v: float
) -> tuple[_Data, bool]:
    count = len(window.speed_rpm)
    astern = bool(np.count_nonzero(window.command < -0.01 * scale) >= SHARE_MIN)
    basis = CommandBasis(scale, config.order_max, astern)
    unsigned = not bool((window.speed_rpm < -0.02 * top_rpm).any())
    speed, usable = window.speed_rpm / top_rpm, window.trusted.copy()
    usable[:RUN_IN] = False
    if unsigned and astern:
        speed, certain = _signed(window.command, speed, config.delay_max)
        usable &= certain
    supply = np.zeros(count)
    if np.isfinite(supply_v):
        supply = np.where(np.isfinite(window.voltage_v), window.voltage_v / supply_v - 1.0, 0.0)
    time = (np.arange(count) - (count - 1)) / TREND_SAMPLES
    return _Data(basis, basis.columns(window.command), window.lead, speed, usable, time, supply), unsigned


def _signed(command: FloatArray, speed: FloatArray, delay_max: int) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Sign for speeds of a sensor without one, from the command; uncertain within `delay_max` of a reversal."""
    sign = np.sign(command)
    views = sliding_window_view(sign, delay_max + 1)[-len(speed) :]
    certain = (views.min(axis=1) == views.max(axis=1)) & (views[:, 0] != 0.0)
    return np.abs(speed) * np.where(sign[-len(speed) :] < 0.0, -1.0, 1.0), certain


# ---------------------------------------------------------------------------------------------------- delay and lag


class _Table:
    """Misfit of every delay and lag of the grid, in units of the noise variance."""

    def __init__(self, data: _Data, gain: FloatArray, noise: float, config: ThrusterConfig) -> None:
        self._data, self._variance = data, noise**2
        self._penalty = np.diag(data.basis.prior_deviation**-2.0)
        self._lags = lag_grid(config.lag_max)
        delays = data.lead + 1
        self._span = slice(RUN_IN, len(data.speed) - data.lead)
        shared = sliding_window_view(data.usable, delays).all(axis=1)[RUN_IN:]
        shifted = sliding_window_view(data.speed / gain, len(data.speed) - data.lead)[:, RUN_IN:]
        self._shared, self._shifted = shared, shifted[:, shared]
        self._energy = (self._shifted**2).sum(axis=1) / self._variance
        self._misfit = np.array([self._of(float(lag)) for lag in self._lags])

    def _of(self, lag: float, delay: int | None = None) -> FloatArray:
        """Misfit at this lag: for each delay, or for one."""
        which = slice(None) if delay is None else slice(delay, delay + 1)
        start = self._data.lead + RUN_IN
        columns = lagged(self._data.columns, lag)[:, start : start + len(self._shared)][:, self._shared]
        normal = columns @ columns.T / self._variance + self._penalty
        right = columns @ self._shifted[which].T / self._variance
        return np.asarray(self._energy[which] - (right * np.linalg.solve(normal, right)).sum(axis=0))

    @property
    def best(self) -> tuple[int, float]:
        """Delay and lag of least misfit on the grid."""
        row, delay = np.unravel_index(np.argmin(self._misfit), self._misfit.shape)
        return int(delay), float(self._lags[row])

    def refined(self, margin: float) -> tuple[int, float, tuple[tuple[int, float], ...]]:
        """Best delay and lag, the lag between grid points; and the extreme ones whose misfit is within `margin`."""
        row, delay = np.unravel_index(np.argmin(self._misfit), self._misfit.shape)
        low, high = self._lags[max(row - 4, 0)], self._lags[min(row + 4, len(self._lags) - 1)]
        near = range(max(int(delay) - 2, 0), min(int(delay) + 2, self._data.lead) + 1)
        found = [self._refine(d, float(low), float(high)) for d in near]
        misfit, best_delay, best_lag = min(found)
        grid = [
            (self._misfit[i, j], j, float(lag))
            for i, lag in enumerate(self._lags)
            for j in range(self._misfit.shape[1])
        ]
        plausible = [(d, lag) for m, d, lag in grid + found if m - misfit < margin and d != best_delay]
        plausible += [(d, lag) for m, d, lag in grid if m - misfit < margin and d == best_delay]
        return best_delay, best_lag, _extremes(plausible)

    def _refine(self, delay: int, low: float, high: float) -> tuple[float, int, float]:
        result = minimize_scalar(
            lambda lag: float(self._of(float(lag), delay)[0]),
            bounds=(low, high),
            method="bounded",
            options={"xatol": 0.02},
        )
        return float(result.fun), delay, float(result.x)


def _extremes(plausible: list[tuple[int, float]]) -> tuple[tuple[int, float], ...]:
    """Of these delays and lags, those with the least and the greatest sum, and with the least and greatest delay."""
    if not plausible:
        return ()
    by_sum = sorted(plausible, key=sum)
    return tuple(sorted({by_sum[0], by_sum[-1], min(plausible), max(plausible)}))


# ---------------------------------------------------------------------------------------------------- least squares


def _solve(design: FloatArray, speed: FloatArray, prior: FloatArray, weight: FloatArray) -> _Fit:
    """Bayesian least squares: (K, N) design, (N,) weights = 1 / variance, zero-mean prior of these deviations."""
    weighted = design * weight
    precision = weighted @ design.T + np.diag(prior**-2.0)
    covariance = np.linalg.inv(precision)
    coefficients = covariance @ (weighted @ speed)
    return _Fit(coefficients, covariance, speed - coefficients @ design)


def _with_drift(columns: FloatArray, curve: FloatArray, data: _Data) -> tuple[FloatArray, FloatArray]:
    """Columns and prior deviations of coefficients, supply exponent, linear and quadratic drift of the gain."""
    design = np.concatenate([columns, [curve * data.supply, curve * data.time, curve * data.time**2]])
    deviations = [SUPPLY_DEVIATION, TREND_DEVIATION, TREND_DEVIATION]
    return design, np.concatenate([data.basis.prior_deviation, deviations])


def _drift(data: _Data, delay: int, lag: float, gain: FloatArray, noise: float) -> tuple[FloatArray, float, float]:
    """Gain over the window, noise and correlation of the residual, for this delay and lag."""
    columns = data.lagged(delay, lag)
    weight = data.usable / noise**2
    rough = _solve(columns * gain, data.speed, data.basis.prior_deviation, weight)
    curve = rough.coefficients @ (columns * gain)
    fit = _solve(*_reorder(_with_drift(columns * gain, curve, data), data.speed, weight))
    supply, linear, quadratic = fit.coefficients[-3:]
    change = 1.0 + supply * data.supply + linear * data.time + quadratic * data.time**2
    residual = fit.residual[data.usable]
    noise = max(1.4826 * float(np.median(np.abs(residual))), NOISE_MIN)
    return gain * np.clip(change, 0.5, 2.0), noise, _correlation(residual)


def _reorder(
    drifting: tuple[FloatArray, FloatArray], speed: FloatArray, weight: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    design, prior = drifting
    return design, speed, prior, weight


def _alternative(data: _Data, gain: FloatArray, delay: int, lag: float, noise: float) -> Response:
    columns = data.lagged(delay, lag) * gain
    fit = _solve(columns, data.speed, data.basis.prior_deviation, data.usable / noise**2)
    return Response(delay, lag, fit.coefficients)


def _inflation(correlation: float) -> float:
    """Variance of a mean of correlated samples over that of independent ones."""
    return (1.0 + correlation) / (1.0 - correlation)


def _whitener(covariance: FloatArray, prior: FloatArray, correlation: float) -> FloatArray:
    """W with W'W the covariance widened for correlated residuals, but never beyond the prior."""
    precision = np.linalg.inv(covariance) / _inflation(correlation)
    symmetric = 0.5 * (precision + precision.T) + np.diag(prior**-2.0)
    return np.asarray(np.linalg.inv(np.linalg.cholesky(symmetric)))


# ---------------------------------------------------------------------------------------------------- noise


def _quiet_noise(residual: FloatArray, distance: FloatArray) -> float:
    """Standard deviation in the half of the samples that are nearest to their target; tolerant of outliers."""
    if not len(residual):
        return NOISE_MIN
    quiet = residual[distance <= np.median(distance)]
    robust = 1.4826 * float(np.median(np.abs(quiet)))
    return max(NOISE_MIN, robust, 0.7 * float(np.sqrt(np.mean(np.clip(quiet, -4 * robust, 4 * robust) ** 2))))


def _settling(distance: FloatArray, lag: float) -> FloatArray:
    """The distance with a memory: a step is not over when the lag model says so."""
    decay, level, out = settling_decay(lag), 0.0, []
    for value in distance.tolist():
        level = max(value, decay * level)
        out.append(level)
    return np.array(out)


def settling_decay(lag: float) -> float:
    """Part of a transient's error that is still expected one sample later."""
    return float(np.exp(-1.0 / (2.0 * lag + 4.0)))


def _transient_error(
    residual: FloatArray, change: FloatArray, which: NDArray[np.bool_], noise: float, unseen_share: float
) -> TransientError:
    """How far the model errs while the speed changes by this much, and up to what change that was seen."""
    residual, change = residual[which], change[which]
    energy = float((change**4).sum()) + 1e-30
    seen = float(((residual**2 - noise**2) * change**2).sum()) / energy
    doubt = 2.0 * noise**2 * float(np.sqrt(2.0 / energy))
    share = min(float(np.sqrt(max(seen, 0.0) + doubt)), TRANSIENT_ERROR_MAX)
    far = float(np.sort(change)[-SEEN_SAMPLES]) if len(change) >= SEEN_SAMPLES else 0.0
    return TransientError(share, far, max(share, unseen_share))


def _correlation(residual: FloatArray) -> float:
    """Of neighbouring residuals, within 0..0.97."""
    if len(residual) < 3 or not residual.std() > 0.0:
        return 0.0
    centred = residual - residual.mean()
    return float(np.clip((centred[1:] * centred[:-1]).mean() / (centred**2).mean(), 0.0, CORRELATION_MAX))


def _resolution_rpm(speed_rpm: FloatArray) -> float:
    """The sensor's step, from the repeated differences of its readings: 0 where they do not repeat."""
    steps = np.abs(np.diff(speed_rpm))
    steps = steps[steps > 0.0]
    if not len(steps):
        return 0.0
    smallest = float(np.quantile(steps, 0.02))
    multiples = steps / smallest
    stepped = np.mean(np.abs(multiples - np.round(multiples)) < 0.02 * np.maximum(multiples, 1.0)) > 0.9
    return smallest if stepped else 0.0


def _learnt(command: FloatArray) -> tuple[float, float]:
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
