"""Choice of a model's order and window: by the paper's swarm, or exactly over the whole grid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from detectors.thruster.swarm import Dimension, MultiCentreSwarm, Position

SearchName = Literal["exact", "swarm"]


@dataclass(frozen=True, slots=True)
class Choice:
    """The best candidate found: its order, its window in samples, its fitness (equation 17)."""

    order: int
    window: int
    fitness: float


class SearchSpace(Protocol):
    """Orders and windows to choose from, and how good each pair is: the smaller, the better."""

    @property
    def orders(self) -> Sequence[int]: ...
    @property
    def windows(self) -> Sequence[int] | NDArray[np.int_]: ...
    def fitness(self, order: int, window: int) -> float:
        """Of one pair; any window from the first to the last of `windows`."""

    def grid(self) -> NDArray[np.float64]:
        """(orders, windows) fitness of all pairs."""


class Search(Protocol):
    """Picks one of the candidates. May learn from one call to the next; picklable between them."""

    def __call__(self, candidates: SearchSpace) -> Choice: ...


class ExactSearch:
    """The certain optimum of the whole grid; of equals the lowest order, then the shortest window."""

    def __call__(self, candidates: SearchSpace) -> Choice:
        grid = candidates.grid()
        order, window = (int(index) for index in np.unravel_index(np.argmin(grid), grid.shape))
        return Choice(int(candidates.orders[order]), int(candidates.windows[window]), float(grid[order, window]))


class SwarmSearch:
    """The paper's multi-centre particle swarm with memory (section 4.3, step 4).

    Args:
        prior: (order, window) known beforehand to be good, as the first entries of the memory of optima.
        seed: of the swarm's random numbers.
    """

    def __init__(self, prior: tuple[tuple[int, int], ...] = (), seed: int = 0) -> None:
        self._swarm = MultiCentreSwarm(prior, seed=seed)

    @property
    def memory(self) -> tuple[Position, ...]:
        """Prior knowledge and optima of the latest searches, as (order, window)."""
        return self._swarm.memory

    def __call__(self, candidates: SearchSpace) -> Choice:
        orders, windows = candidates.orders, candidates.windows
        optimum = self._swarm.minimise(
            lambda position: candidates.fitness(int(position[0]), int(position[1])),
            (Dimension(orders[0], orders[-1], integer=True), Dimension(windows[0], windows[-1], integer=True)),
        )
        order, window = (int(value) for value in optimum.position)
        return Choice(order, window, optimum.fitness)


def search_named(name: SearchName, *, order_max: int, window_min: int, window_max: int, seed: int = 0) -> Search:
    """A search by its name in the configuration.

    The swarm's prior knowledge of thrusters: the speed is nearly proportional to a voltage (order 1) and bends
    smoothly with a throttle (order 2 or 3); the state lasts for a short or for a long while.

    Raises:
        ValueError: unknown name.
    """
    if name == "exact":
        return ExactSearch()
    if name == "swarm":
        return SwarmSearch(((min(3, order_max), window_max), (min(2, order_max), window_min), (1, window_min)), seed)
    raise ValueError(f"search = {name!r}: want 'exact' or 'swarm'")
