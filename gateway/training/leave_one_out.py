"""What can be expected of a predictor in dives it has not seen: each recording against a model of all others."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

from detectors.navigation.lstm import Model
from gateway.training.checkpoint import Checkpoint
from gateway.training.evaluation import Figures, evaluate
from gateway.training.fit import Fitting, Observer, ignore
from gateway.training.records import InnovationRecord
from gateway.training.settings import Hyperparameters, TrainingSettings


class Fold(NamedTuple):
    """A model that has not seen one recording, and what it foretells of it."""

    left_out: str
    model: Model
    figures: Figures


def settings_of(model: Model) -> TrainingSettings:
    """Those that a model was made with, without a search.

    Raises:
        ValueError: it does not say.
    """
    try:
        hyperparameters = Hyperparameters(**model.provenance["hyperparameters"])
        return TrainingSettings(hyperparameters=hyperparameters, seed=model.provenance["seed"], splits=0)
    except (KeyError, TypeError) as error:
        raise ValueError(f"the model does not say what it was made with ({error}): train it anew") from error


def folds(
    records: Sequence[InnovationRecord], settings: TrainingSettings, observer: Observer = ignore
) -> Iterator[Fold]:
    """One for each recording, in their order.

    Raises:
        ValueError: fewer than two recordings, or two of one name.
    """
    names = [record.name for record in records]
    if len(names) < 2 or len(set(names)) < len(names):
        raise ValueError(f"recordings {', '.join(names)}: want two or more, each with a name of its own")
    for left_out in records:
        others = [record for record in records if record is not left_out]
        model = Fitting(others, settings, Checkpoint(None, "", resume=False), observer).run()
        figures = evaluate(model, [left_out])
        yield Fold(left_out.name, replace(model, provenance={**model.provenance, "left_out": left_out.name}), figures)
