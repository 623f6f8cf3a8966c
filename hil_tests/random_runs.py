"""Random runs of one thruster, healthy or with a lasting loss of speed: what its detector is measured on.

The ranges are those of the detector's target: 3000 samples; motor lag 0 to 6 samples, delay 0 to 8; a gain that
drifts by up to 6 % over 1200 samples or more; noise of 0.1 to 0.5 % of the top speed; commands that hold, ramp and
swing between 15 and 100 %. A run is its seed: with another loss it is still the same thruster, command and noise.

"plain" runs keep to the letter of that. "varied" runs fill the ranges with what somebody else might have chosen:
sums of sines, a drift that wanders, correlated noise, quantised speeds, delays of parts of a sample, other units and
rates, and a loss that shows at once instead of through the motor's lag.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

FloatArray = NDArray[np.float64]
Style = Literal["plain", "varied"]

SAMPLES = 3000
COMMAND_MIN, COMMAND_MAX = 0.15, 1.0
LAG_MAX, DELAY_MAX = 6.0, 8
DRIFT_MAX, DRIFT_SPAN_MIN = 0.06, 1200
NOISE_MIN, NOISE_MAX = 0.001, 0.005
ONSET_MIN, ONSET_MAX = 800, 2700  # samples at which a loss may begin: after learning, and with room to be found
TOP_RPM_MIN, TOP_RPM_MAX = 300.0, 10_000.0
# The command's unit in varied runs: fraction, percent, volt, microseconds from neutral.
COMMAND_UNITS = (1.0, 100.0, 12.0, 400.0)
PLAIN_RATE_HZ = 50.0
RATES_HZ = (10.0, 20.0, 25.0, 50.0, 100.0)
QUANTISED_SHARE, CORRELATED_SHARE = 1 / 3, 1 / 2
PIECE_MIN, PIECE_MAX = 40, 300  # samples for which a hold, ramp or swing lasts


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RandomRun:
    """One run and what is true of it.

    Attributes:
        seed: that it was made from.
        time_s, command, speed_rpm: (N,) what a detector sees; the command in some linear unit.
        loss: lasting relative loss of speed, 0.0 for a healthy run.
        onset: first sample whose speed shows the loss, if only by a little; set in healthy runs too.
        lag: of the motor, in samples. delay: in samples.
        noise: standard deviation, relative to `top_rpm`.
        top_rpm: speed at the greatest command.
    """

    seed: int
    time_s: FloatArray
    command: FloatArray
    speed_rpm: FloatArray
    loss: float
    onset: int
    lag: float
    delay: float
    noise: float
    top_rpm: float


def random_run(seed: int, loss: float = 0.0, style: Style = "plain", samples: int = SAMPLES) -> RandomRun:
    """The run of this seed.

    Args:
        seed: 0 or more.
        loss: lasting relative loss of speed from a random sample on, 0.0 for none.
        style: "plain" or "varied", see above.
        samples: its length; beyond `ONSET_MAX`.

    Raises:
        ValueError: an argument out of range.
    """
    _check(loss, style, samples)
    varied = style == "varied"
    rng = np.random.default_rng([get_args(Style).index(style), seed])
    command = _command(rng, samples, (_hold, _ramp, _swing, _sines) if varied else (_hold, _ramp, _swing))
    curve = _curve(rng)
    gain = _drift(rng, samples, (_linear, _sine, _ramped, _wandering) if varied else (_linear, _sine, _ramped))
    lag = float(rng.uniform(0.0, LAG_MAX))
    delay = float(rng.uniform(0.0, DELAY_MAX)) if varied else float(rng.integers(DELAY_MAX + 1))
    noise = float(np.exp(rng.uniform(np.log(NOISE_MIN), np.log(NOISE_MAX))))
    top_rpm = float(np.exp(rng.uniform(np.log(TOP_RPM_MIN), np.log(TOP_RPM_MAX))))
    onset = int(rng.integers(ONSET_MIN, ONSET_MAX))
    at_once = varied and bool(rng.random() < 0.5)
    remaining = np.where(np.arange(samples) < onset, 1.0, 1.0 - loss)
    target = curve(_delayed(command, delay)) * gain
    speed = _lagged(target, lag) * remaining if at_once else _lagged(target * remaining, lag)
    measured = top_rpm * (speed + noise * _noise(rng, samples, CORRELATED_SHARE if varied else 0.0))
    return RandomRun(
        seed=seed,
        time_s=np.arange(samples) / (float(rng.choice(RATES_HZ)) if varied else PLAIN_RATE_HZ),
        command=command * (float(rng.choice(COMMAND_UNITS)) if varied else 1.0),
        speed_rpm=_quantised(rng, measured, top_rpm) if varied else measured,
        loss=loss,
        onset=onset,
        lag=lag,
        delay=delay,
        noise=noise,
        top_rpm=top_rpm,
    )


def _check(loss: float, style: str, samples: int) -> None:
    if not 0.0 <= loss < 1.0:
        raise ValueError(f"loss = {loss}: want 0 or more, below 1")
    if style not in get_args(Style):
        raise ValueError(f"style = {style!r}: want one of {', '.join(get_args(Style))}")
    if samples <= ONSET_MAX:
        raise ValueError(f"samples = {samples}: want more than {ONSET_MAX}, the latest begin of a loss")


# ------------------------------------------------------------------------------------------------------- command

Piece = Callable[[np.random.Generator, float, int], FloatArray]


def _command(rng: np.random.Generator, samples: int, kinds: tuple[Piece, ...]) -> FloatArray:
    """Pieces of these kinds, one after the other; each knows where the last one ended."""
    pieces = [np.array([rng.uniform(COMMAND_MIN, COMMAND_MAX)])]
    while sum(map(len, pieces)) <= samples:
        kind = kinds[rng.integers(len(kinds))]
        pieces.append(kind(rng, float(pieces[-1][-1]), int(rng.integers(PIECE_MIN, PIECE_MAX))))
    return np.concatenate(pieces)[1 : samples + 1]


def _hold(rng: np.random.Generator, start: float, length: int) -> FloatArray:
    return np.full(length, rng.uniform(COMMAND_MIN, COMMAND_MAX))


def _ramp(rng: np.random.Generator, start: float, length: int) -> FloatArray:
    return np.linspace(start, rng.uniform(COMMAND_MIN, COMMAND_MAX), length)


def _swing(rng: np.random.Generator, start: float, length: int) -> FloatArray:
    return _around(rng, _phase(rng, length, 30.0, 300.0))


def _sines(rng: np.random.Generator, start: float, length: int) -> FloatArray:
    waves = np.array([rng.uniform(0.2, 1.0) * _phase(rng, length, 15.0, 400.0) for _ in range(4)])
    return _around(rng, waves.sum(axis=0) / np.abs(waves.sum(axis=0)).max())


def _phase(rng: np.random.Generator, length: int, shortest: float, longest: float) -> FloatArray:
    period = rng.uniform(shortest, longest)
    return np.asarray(np.sin(2.0 * np.pi * np.arange(length) / period + rng.uniform(0.0, 2.0 * np.pi)))


def _around(rng: np.random.Generator, wave: FloatArray) -> FloatArray:
    """A wave within -1..1, as a swing around a random command within the bounds."""
    centre = rng.uniform(COMMAND_MIN + 0.1, COMMAND_MAX - 0.1)
    return np.asarray(centre + rng.uniform(0.05, min(centre - COMMAND_MIN, COMMAND_MAX - centre)) * wave)


# ------------------------------------------------------------------------------------------------------- thruster


def _curve(rng: np.random.Generator) -> Callable[[FloatArray], FloatArray]:
    """From command to steady speed, both as fractions."""
    shape, bend = rng.integers(4), rng.uniform()
    if shape == 0:
        share = 0.8 * bend - 0.4
        return lambda u: (1.0 - share) * u + share * u**2
    if shape == 1:
        return lambda u: u ** (0.55 + 0.55 * bend)
    if shape == 2:
        return lambda u: np.tanh((0.8 + 1.2 * bend) * u) / np.tanh(0.8 + 1.2 * bend)
    dead = rng.uniform(0.0, 0.1)
    return lambda u: (np.maximum(u - dead, 0.0) / (1.0 - dead)) ** (0.6 + 0.4 * bend)


def _delayed(command: FloatArray, delay: float) -> FloatArray:
    """The command that many samples later, between samples in proportion."""
    samples = np.arange(len(command))
    return np.asarray(np.interp(samples - delay, samples, command))


def _lagged(target: FloatArray, lag: float) -> FloatArray:
    """First-order lag with this time constant in samples, settled at the start."""
    share = 1.0 - np.exp(-1.0 / lag) if lag > 0.0 else 1.0
    start = [(1.0 - share) * target[0]]
    return np.asarray(lfilter([share], [1.0, share - 1.0], target, zi=start)[0])


# ---------------------------------------------------------------------------------------------------------- drift

Drift = Callable[[np.random.Generator, int, float], FloatArray]


def _drift(rng: np.random.Generator, samples: int, kinds: tuple[Drift, ...]) -> FloatArray:
    """Gain over time, changing by at most `DRIFT_MAX` within any `DRIFT_SPAN_MIN` samples."""
    kind = kinds[rng.integers(len(kinds))]
    shape = kind(rng, samples, rng.uniform(DRIFT_SPAN_MIN, samples))
    return np.asarray(1.0 + rng.uniform(-DRIFT_MAX, DRIFT_MAX) * shape)


def _linear(rng: np.random.Generator, samples: int, span: float) -> FloatArray:
    return np.arange(samples) / span


def _sine(rng: np.random.Generator, samples: int, span: float) -> FloatArray:
    return np.asarray(0.5 * np.sin(np.pi * np.arange(samples) / span + rng.uniform(0.0, 2.0 * np.pi)))


def _ramped(rng: np.random.Generator, samples: int, span: float) -> FloatArray:
    begin = rng.uniform(0.0, samples - DRIFT_SPAN_MIN)
    return np.clip((np.arange(samples) - begin) / span, 0.0, 1.0)


def _wandering(rng: np.random.Generator, samples: int, span: float) -> FloatArray:
    """A random walk, smoothed over a third of the shortest span; its way within that span is scaled to 1."""
    smooth = DRIFT_SPAN_MIN // 3
    walk = np.cumsum(rng.standard_normal(samples + smooth - 1))
    walk = np.convolve(walk, np.full(smooth, 1.0 / smooth), mode="valid")
    spans = np.lib.stride_tricks.sliding_window_view(walk, DRIFT_SPAN_MIN)
    return np.asarray((walk - walk[0]) / np.ptp(spans, axis=1).max())


# --------------------------------------------------------------------------------------------------------- sensor


def _noise(rng: np.random.Generator, samples: int, correlated_share: float) -> FloatArray:
    """Noise of unit standard deviation: white, or in a share of the runs a first-order autoregression."""
    white = rng.standard_normal(samples)
    if not rng.random() < correlated_share:
        return white
    correlation = rng.uniform(0.3, 0.9)
    innovation = np.concatenate([white[:1], np.sqrt(1.0 - correlation**2) * white[1:]])
    return np.asarray(lfilter([1.0], [1.0, -correlation], innovation))


def _quantised(rng: np.random.Generator, speed_rpm: FloatArray, top_rpm: float) -> FloatArray:
    """Speeds in whole steps of the sensor, in a share of the runs."""
    step_rpm = top_rpm * rng.uniform(0.0005, 0.003)
    return np.round(speed_rpm / step_rpm) * step_rpm if rng.random() < QUANTISED_SHARE else speed_rpm
