"""Trains predictors, and finds the hyper-parameters to do it with (paper 003, sections 4 and 5.2)."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from math import log10
from typing import Any

import numpy as np
import torch

from detectors.navigation import NavigationConfig
from detectors.navigation.lstm import Model, Predictor
from detectors.thruster.swarm import Dimension, MultiCentreSwarm, Position
from gateway.navigation_data import NavigationData
from gateway.training.checkpoint import Checkpoint
from gateway.training.evaluation import Figures, evaluate, pooled
from gateway.training.innovations import innovations
from gateway.training.network import Batch, Scaling, Training
from gateway.training.records import InnovationRecord, Split, interval_s, splits
from gateway.training.settings import Hyperparameters, Search, TrainingSettings

# Paper 003, section 5.2; both learning factors of its swarm.
INERTIA = 0.6
ATTRACTION = 2.0
# Logarithm of the learning rate, hidden units, epochs. What the paper's swarm found is this one's prior knowledge.
DIMENSIONS = (
    Dimension(log10(1e-3), log10(3e-2)),
    Dimension(8, 128, integer=True),
    Dimension(10, 60, integer=True),
)


@dataclass(frozen=True, slots=True)
class Stage:
    """How far the work has come.

    Attributes:
        training: number of the training, from 1. of: how many there will be at most.
        hyperparameters: of this one.
        epochs_done: of its epochs.
        best: least fitness so far; None before the first.
    """

    training: int
    of: int
    hyperparameters: Hyperparameters
    epochs_done: int
    best: float | None


Observer = Callable[[Stage], None]


def ignore(stage: Stage) -> None:
    """An observer that does not look."""


class Fitting:
    """All trainings that lead to one model.

    Args:
        records: healthy dives.
        settings: what to train.
        checkpoint: where it is kept how far all has come.
        observer: told after each epoch.

    Raises:
        ValueError: too few records.
    """

    def __init__(
        self,
        records: Sequence[InnovationRecord],
        settings: TrainingSettings,
        checkpoint: Checkpoint,
        observer: Observer = ignore,
    ) -> None:
        self._records = records
        self._splits = splits(records, settings.seed, settings.splits)
        self._interval_s = interval_s(records)
        self._settings = settings
        self._checkpoint = checkpoint
        self._observer = observer
        self._begun = 0
        self._best: float | None = None

    def run(self) -> Model:
        """The model, trained on all recordings, with its provenance; the figures in it are of recordings left out."""
        with _one_thread():
            return self._run()

    def _run(self) -> Model:
        hyperparameters = self._settings.hyperparameters or self._found()
        figures = self._validated(hyperparameters) if self._settings.splits else None
        model = self._trained("all recordings", self._records, hyperparameters)
        return replace(model, provenance=self._provenance(hyperparameters, figures))

    def _found(self) -> Hyperparameters:
        swarm = _swarm(self._settings.search, self._settings.seed)
        return _hyperparameters(swarm.minimise(self._fitness, DIMENSIONS).position)

    def _fitness(self, position: Position) -> float:
        return self._validated(_hyperparameters(position)).fitness

    def _validated(self, hyperparameters: Hyperparameters) -> Figures:
        """The figures on recordings left out; known already where a search met the same before."""
        parts = [self._part(number, split, hyperparameters) for number, split in enumerate(self._splits)]
        figures = pooled(parts)
        self._best = figures.fitness if self._best is None else min(self._best, figures.fitness)
        return figures

    def _part(self, number: int, split: Split, hyperparameters: Hyperparameters) -> Figures:
        name = f"split {number}, {hyperparameters!r}"
        figures = self._checkpoint.result(name)
        if figures is None:
            figures = evaluate(self._trained(name, split.training, hyperparameters), split.validation)
            self._checkpoint.finish(name, figures)
        return figures

    def _trained(self, name: str, records: Sequence[InnovationRecord], hyperparameters: Hyperparameters) -> Model:
        inputs = Scaling.of(np.vstack([record.features for record in records]))
        targets = Scaling.of(np.vstack([record.targets for record in records]))
        training = Training(Batch.of(records, inputs, targets), hyperparameters, self._settings.seed)
        state = self._checkpoint.state(name)
        if state is not None:
            training.restore(state)
        self._begun += 1
        while not training.done:
            training.run_epoch()
            self._checkpoint.keep(name, training.state())
            self._observer(self._stage(training))
        return _model(training, inputs, targets, self._interval_s)

    def _stage(self, training: Training) -> Stage:
        of = self._settings.trainings
        return Stage(self._begun, of, training.hyperparameters, training.epochs_done, self._best)

    def _provenance(self, hyperparameters: Hyperparameters, figures: Figures | None) -> Mapping[str, Any]:
        searched = self._settings.hyperparameters is None
        return {
            "recordings": [record.name for record in self._records],
            "samples": sum(len(record.time_s) for record in self._records),
            "seed": self._settings.seed,
            "hyperparameters": asdict(hyperparameters),
            "search": asdict(self._settings.search) if searched else None,
            "validated_with": sorted(record.name for split in self._splits for record in split.validation),
            "figures": asdict(figures) if figures else None,
            "torch": str(torch.__version__),
            "numpy": np.__version__,
        }


@contextmanager
def _one_thread() -> Iterator[None]:
    """The matrices are too small for more, and sums must not depend on how many there are."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


def _model(training: Training, inputs: Scaling, targets: Scaling, interval_s: float) -> Model:
    scales = {
        "input_mean": inputs.mean,
        "input_scale": inputs.scale,
        "output_mean": targets.mean,
        "output_scale": targets.scale,
    }
    arrays: dict[str, Any] = {name: values.astype(np.float32) for name, values in scales.items()}
    arrays.update(training.network.arrays())
    return Model(**arrays, interval_s=interval_s)


def _swarm(search: Search, seed: int) -> MultiCentreSwarm:
    known = Hyperparameters()
    return MultiCentreSwarm(
        [(log10(known.learning_rate), known.hidden, known.epochs)],
        particles=search.particles,
        iterations=search.iterations,
        auxiliary_centres=min(2, search.particles // 2 - 1),
        memory=1,
        inertia=INERTIA,
        attraction=ATTRACTION,
        seed=seed,
    )


def _hyperparameters(position: Position) -> Hyperparameters:
    logarithm, hidden, epochs = position
    return Hyperparameters(learning_rate=10.0**logarithm, hidden=int(hidden), epochs=int(epochs))


def train_predictor(
    recordings: Sequence[NavigationData],
    settings: TrainingSettings | None = None,
    config: NavigationConfig | None = None,
) -> Predictor:
    """A predictor of what the navigation filter's innovations are in healthy dives.

    Args:
        recordings: healthy dives.
        settings: None: the defaults, which search for nothing.
        config: of the filter; None: the defaults.

    Raises:
        ValueError: too few recordings, or one that nothing can be learnt from.
    """
    records = [innovations(recording, config) for recording in recordings]
    return Predictor(train_model(records, settings or TrainingSettings()))


def train_model(records: Sequence[InnovationRecord], settings: TrainingSettings) -> Model:
    """The same of what the filter made of the recordings, at one go."""
    return Fitting(records, settings, Checkpoint(None, "", resume=False)).run()
