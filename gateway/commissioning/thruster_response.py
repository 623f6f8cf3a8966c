"""How a thruster answers its command: curve, delay, lag, noise, and how sure they are."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from detectors.thruster import ThrusterConfig
from detectors.thruster.model import ThrusterModel
from detectors.thruster.stretch import model_of_stretch
from gateway.commissioning.dive import ThrusterSamples
from gateway.commissioning.steady_curve import SteadyCurve, steady_curve

FloatArray: TypeAlias = NDArray[np.float64]

STRETCH_S = 60.0  # of which each model is made: long enough to know a thruster, short enough to have several
LONGER, REACH_MAX = 2, 48  # samples of delay or lag to which the search is widened, step by step
AT_BOUND = 0.95


@dataclass(frozen=True, slots=True)
class Known:
    """A quantity, and how far it is known: from the least to the greatest of all stretches."""

    value: float
    low: float
    high: float

    @staticmethod
    def of(values: Sequence[float]) -> Known:
        """The median of several."""
        return Known(float(np.median(values)), min(values), max(values))


@dataclass(frozen=True, slots=True)
class ThrusterResponse:
    """How a thruster answers its command.

    Attributes:
        curve: steady speed over command.
        delay_s: transport delay.
        lag_s: time constant.
        noise_rpm: standard deviation of the measured speed.
        gains: of each dive, its speed relative to the curve, less 1; NaN where it has no stretch of its own.
        stretches: number of models that this is from.
        unsigned: whether the sensor gives the magnitude of the speed only.
        config: settings that it was found with: with a wider search where delay or lag are longer than usual.
    """

    curve: SteadyCurve
    delay_s: Known
    lag_s: Known
    noise_rpm: Known
    gains: tuple[float, ...]
    stretches: int
    unsigned: bool
    config: ThrusterConfig


def response(dives: Sequence[ThrusterSamples], config: ThrusterConfig) -> ThrusterResponse | None:
    """How one thruster answers, as these dives show it; None where they show too little."""
    fitted = [[*_models(one, config)] for one in dives]
    models = [model for dive in fitted for model, _ in dive]
    if models and (wider := _wider(models, config)) != config:
        return response(dives, wider)
    curve = steady_curve(models)
    return None if curve is None else _summary(curve, fitted, config)


def _models(samples: ThrusterSamples, config: ThrusterConfig) -> Iterator[tuple[ThrusterModel, float]]:
    """Of stretches of about equal length; each with its period."""
    block = np.stack(samples.columns())
    count = max(1, round(len(samples) / (STRETCH_S * samples.rate_hz)))
    for part in np.array_split(block, count, axis=1):
        found = model_of_stretch(part, config)
        if found is not None:
            yield found


def _wider(models: Sequence[ThrusterModel], config: ThrusterConfig) -> ThrusterConfig:
    """The settings with a longer search, where half of the models are at the end of this one."""
    late = np.median([model.response.delay >= config.delay_max for model in models]) > 0.0
    slow = np.median([model.response.lag >= AT_BOUND * config.lag_max for model in models]) > 0.0
    delay_max = min(LONGER * config.delay_max, REACH_MAX) if late else config.delay_max
    window_min, _, warmup = config.spans
    return replace(
        config,
        delay_max=max(delay_max, config.delay_max),
        lag_max=max(min(LONGER * config.lag_max, float(REACH_MAX)) if slow else 0.0, config.lag_max),
        warmup=max(warmup, window_min + max(delay_max, config.delay_max)),
    )


def _summary(
    curve: SteadyCurve, fitted: Sequence[Sequence[tuple[ThrusterModel, float]]], config: ThrusterConfig
) -> ThrusterResponse:
    models = [one for dive in fitted for one in dive]
    return ThrusterResponse(
        curve=curve,
        delay_s=Known.of([model.response.delay * period_s for model, period_s in models]),
        lag_s=Known.of([model.response.lag * period_s for model, period_s in models]),
        noise_rpm=Known.of([model.noise * model.top_rpm for model, _ in models]),
        gains=tuple(_gain([model for model, _ in dive], curve) for dive in fitted),
        stretches=len(models),
        unsigned=all(model.unsigned for model, _ in models),
        config=config,
    )


def _gain(models: Sequence[ThrusterModel], curve: SteadyCurve) -> float:
    gains = [gain for model in models if np.isfinite(gain := curve.gain_of(model))]
    return float(np.median(gains)) if gains else float("nan")
