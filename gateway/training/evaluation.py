"""How well a predictor foretells innovations, beside what needs no learning."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt
from statistics import fmean

import numpy as np
from numpy.typing import NDArray

from detectors.navigation.lstm import OUTPUTS, Model, Predictor
from gateway.training.records import InnovationRecord

FloatArray = NDArray[np.float64]
Four = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True)
class Figures:
    """Root mean square errors on recordings, of the DVL forward, right, down in m/s and of the depth in m.

    Attributes:
        fitness: of innovations and logarithms of variances together, each in standard deviations of the training
            data: what the swarm minimises (paper 003, section 4).
        predicted: of the innovations by the predictor.
        zero: by the filter's own word that they are 0.
        mean: by their means in training.
    """

    fitness: float
    predicted: Four
    zero: Four
    mean: Four


def evaluate(model: Model, records: Sequence[InnovationRecord]) -> Figures:
    """The figures of a model on recordings, each from its beginning."""
    said = np.vstack([predictions(model, record) for record in records])
    true = np.vstack([record.targets for record in records])
    return Figures(
        fitness=float(np.sqrt(np.mean(((said - true) / model.output_scale) ** 2))),
        predicted=_errors(said - true),
        zero=_errors(true),
        mean=_errors(true - model.output_mean),
    )


def pooled(figures: Sequence[Figures]) -> Figures:
    """Of several sets of recordings that count alike."""
    return Figures(
        fitness=sqrt(fmean(one.fitness**2 for one in figures)),
        predicted=_pooled([one.predicted for one in figures]),
        zero=_pooled([one.zero for one in figures]),
        mean=_pooled([one.mean for one in figures]),
    )


def _pooled(errors: Sequence[Four]) -> Four:
    forward, right, down, depth = (sqrt(fmean(one**2 for one in column)) for column in zip(*errors, strict=True))
    return forward, right, down, depth


def _errors(difference: FloatArray) -> Four:
    forward, right, down, depth = np.sqrt(np.mean(difference[:, :OUTPUTS] ** 2, axis=0)).tolist()
    return forward, right, down, depth


def predictions(model: Model, record: InnovationRecord) -> FloatArray:
    """(T, 8) innovations and logarithms of variances, one step of the predictor after the other."""
    predictor = Predictor(model)
    steps = [predictor.step(features) for features in record.features]
    return np.array([np.concatenate((innovation, np.log(variance))) for innovation, variance in steps])
