"""How a predictor is trained."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import isfinite


@dataclass(frozen=True, slots=True, kw_only=True)
class Hyperparameters:
    """The three that paper 003 searches for; these defaults are what its swarm found, and a number of epochs.

    Attributes:
        learning_rate: of the first epochs, halved after each fifth of them.
        hidden: units of the network.
        epochs: how often all the training data are gone through.

    Raises:
        ValueError: one out of its range.
    """

    learning_rate: float = 0.01
    hidden: int = 128
    epochs: int = 60

    def __post_init__(self) -> None:
        if not (isfinite(self.learning_rate) and self.learning_rate > 0):
            raise ValueError(f"learning_rate = {self.learning_rate}: want above 0")
        for name in ("hidden", "epochs"):
            if getattr(self, name) < 1:
                raise ValueError(f"{name} = {getattr(self, name)}: want 1 or more")

    def __str__(self) -> str:
        return f"learning rate {self.learning_rate:.4g}, {self.hidden} hidden units, {self.epochs} epochs"


@dataclass(frozen=True, slots=True, kw_only=True)
class Search:
    """How the hyper-parameters are searched for, by the particle swarm (paper 003: 20 particles, 100 iterations).

    That is up to 2000 trainings, hours on one core for an hour of dives, and five times as many with five splits. The
    defaults end in some ten minutes.

    Attributes:
        particles: of the swarm.
        iterations: moves of all particles.

    Raises:
        ValueError: one out of its range.
    """

    particles: int = 8
    iterations: int = 3

    def __post_init__(self) -> None:
        if self.particles < 2:
            raise ValueError(f"particles = {self.particles}: want 2 or more")
        if self.iterations < 1:
            raise ValueError(f"iterations = {self.iterations}: want 1 or more")


@dataclass(frozen=True, slots=True, kw_only=True)
class TrainingSettings:
    """What to train.

    Attributes:
        hyperparameters: to train with; None: those that the swarm finds.
        search: how it finds them.
        seed: of the first weights, of the swarm, and of the choice of the recordings to validate with.
        splits: ways to choose these, 1 to 5, and 0 for none; a search has one at least. They tell what the final
            model, made of all, can be expected to do. The paper has one; with a dozen of dives that is as much luck
            as judgement, so that the default takes them in turns.

    Raises:
        ValueError: one out of its range.
    """

    hyperparameters: Hyperparameters | None = field(default_factory=Hyperparameters)
    search: Search = field(default_factory=Search)
    seed: int = 0
    splits: int = 5

    def __post_init__(self) -> None:
        least = 1 if self.hyperparameters is None else 0
        if not least <= self.splits <= 5:
            raise ValueError(f"splits = {self.splits}: want {least} to 5")
        if self.seed < 0:
            raise ValueError(f"seed = {self.seed}: want 0 or more")

    @property
    def trainings(self) -> int:
        """How many there will be at most."""
        searched = self.search.particles * (self.search.iterations + 1) if self.hyperparameters is None else 1
        return searched * self.splits + 1
