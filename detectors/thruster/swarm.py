"""Multi-centre particle swarm with memory (paper 000, section 4.2).

Two things set it apart from the standard swarm. It remembers: optima of earlier searches, and prior knowledge, are
part of the first population, and the rest of it is spread from one of them by a chaotic map (equations 8 and 9). And
it has several centres: besides the best particle, good particles far away from it attract their neighbours (10-13).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Position = tuple[float, ...]

# The paper leaves the three factors of equation 13 open; these are Clerc and Kennedy's, which converge.
INERTIA = 0.7298
ATTRACTION = 1.49618
CLOSEST = 0.02  # equation 9: neighbours in the sequence nearer than this are moved apart
_SAME = 1e-9  # two values of the chaotic map this close are one
_LONGEST_PERIOD = 4
_TINY = np.finfo(np.float64).tiny


def tent(t: FloatArray) -> FloatArray:
    """The tent map, elementwise on [0, 1] (equation 8)."""
    return np.where(t <= 0.5, 2.0 * t, 2.0 * (1.0 - t))


def improved_tent_sequence(start: FloatArray, length: int, rng: np.random.Generator) -> FloatArray:
    """`length` points of the unit cube, spread by the tent map from `start` (equations 8 and 9): (length, D).

    A value that falls into a short period is multiplied by a random number of [0, 1] (the paper's reference 43), one
    that stays within 0.02 of the last, as at the fixed points and near them, is moved by up to 0.4 (equation 9).
    """
    points = [np.clip(start, 0.0, 1.0)]
    for _ in range(length):
        following = tent(points[-1])
        random = rng.random((2, len(start)))
        repeats = np.any(np.abs(following - points[-_LONGEST_PERIOD:]) <= _SAME, axis=0)
        following = np.where(repeats, following * random[0], following)
        apart = np.where(following <= 0.5, 0.4, -0.4) * random[1]  # (9)
        points.append(np.where(np.abs(following - points[-1]) <= CLOSEST, following + apart, following))
    return np.array(points[1:]).reshape(length, len(start))


@dataclass(frozen=True, slots=True)
class Dimension:
    """One dimension of the search: the closed interval from `low` to `high`, of whole numbers where `integer`."""

    low: float
    high: float
    integer: bool = False

    def __post_init__(self) -> None:
        if not (np.isfinite(self.low) and np.isfinite(self.high) and self.low <= self.high):
            raise ValueError(f"dimension from {self.low} to {self.high}: want finite bounds, low <= high")


@dataclass(frozen=True, slots=True)
class Optimum:
    """The best that a search met: where, how good, and how many distinct positions were evaluated for it."""

    position: Position
    fitness: float
    evaluations: int


class MultiCentreSwarm:
    """The swarm. Keeps its memory of optima and its random numbers from search to search; picklable between them.

    Args:
        prior: positions known beforehand to be good; the memory starts with them. Clipped to the dimensions.
        particles: size of the population (paper: 20).
        iterations: moves of the population in one search.
        auxiliary_centres: centres beside the main one (paper: 2); 0 makes it a standard swarm with memory.
        memory: how many of the latest distinct optima are remembered. All take part in the next first population.
        inertia, attraction: factors of equation 13; the second of a particle's own best and of its centre alike.
        seed: of the random numbers.

    Raises:
        ValueError: sizes or factors out of range, or a prior of the wrong dimension.
    """

    def __init__(
        self,
        prior: Sequence[Sequence[float]] = (),
        *,
        particles: int = 20,
        iterations: int = 30,
        auxiliary_centres: int = 2,
        memory: int = 5,
        inertia: float = INERTIA,
        attraction: float = ATTRACTION,
        seed: int = 0,
    ) -> None:
        if not 0 <= auxiliary_centres <= particles // 2 - 1:
            raise ValueError(
                f"auxiliary_centres = {auxiliary_centres}: want 0..{particles // 2 - 1}, in the better half"
            )
        if not 1 <= memory < particles:
            raise ValueError(f"memory = {memory}: want 1..{particles - 1}, fewer than particles")
        if iterations < 1:
            raise ValueError(f"iterations = {iterations}: want 1 or more")
        if not (0.0 <= inertia < 1.0 and attraction > 0.0):
            raise ValueError(f"inertia = {inertia}, attraction = {attraction}: want 0 or more below 1, and above 0")
        self._particles, self._iterations, self._auxiliary = particles, iterations, auxiliary_centres
        self._inertia, self._attraction = inertia, attraction
        self._memory: deque[Position] = deque((tuple(map(float, p)) for p in prior), maxlen=memory)
        self._rng = np.random.default_rng(seed)

    @property
    def memory(self) -> tuple[Position, ...]:
        """Prior knowledge and remembered optima, the latest last."""
        return tuple(self._memory)

    def remember(self, position: Sequence[float]) -> None:
        """Make this position the latest of the memory."""
        remembered = tuple(map(float, position))
        if remembered in self._memory:
            self._memory.remove(remembered)
        self._memory.append(remembered)

    def minimise(self, fitness: Callable[[Position], float], dimensions: Sequence[Dimension]) -> Optimum:
        """Search for the position of least fitness, and remember it.

        Args:
            fitness: zero or more, the less the better (equation 11 divides by it); NaN counts as infinite. Called
                once for each distinct position.
            dimensions: the D dimensions of the search space. They may differ from search to search (not in number).

        Raises:
            ValueError: a negative fitness, no dimensions, or a remembered position of another number of dimensions.
        """
        space = _Space(dimensions, fitness)
        x = self._first_population(space)
        v = np.zeros_like(x)
        best, best_fitness = x.copy(), space.evaluate(x)
        for _ in range(self._iterations):
            centres = choose_centres(best, best_fitness, self._auxiliary)
            learn_from = self._learning_centres(x, best, best_fitness, centres)
            r1, r2 = self._rng.random((2, *x.shape))
            own, others = self._attraction * r1 * (best - x), self._attraction * r2 * (learn_from - x)
            v = self._inertia * v + own + others  # (13)
            x = np.clip(x + v, 0.0, 1.0)
            now = space.evaluate(x)
            better = now < best_fitness
            best[better], best_fitness[better] = x[better], now[better]
        winner = int(np.argmin(best_fitness))
        optimum = Optimum(space.position(best[winner]), float(best_fitness[winner]), space.evaluations)
        self.remember(optimum.position)
        return optimum

    def _first_population(self, space: _Space) -> FloatArray:
        """The memory, and the tent map's points from a random one of it (section 4.2.1), in the unit cube."""
        remembered = np.array([space.unit(p) for p in self._memory]).reshape(-1, space.size)
        known = len(remembered)
        start = remembered[self._rng.integers(known)] if known else self._rng.random(space.size)
        return np.vstack((remembered, improved_tent_sequence(start, self._particles - known, self._rng)))

    def _learning_centres(
        self, x: FloatArray, best: FloatArray, best_fitness: FloatArray, centres: NDArray[np.intp]
    ) -> FloatArray:
        """Where each particle learns from (step 5): (particles, D)."""
        distance = np.linalg.norm(x[:, None, :] - best[centres], axis=2)  # (12), main centre first
        nearest = np.argmin(distance, axis=1)  # the first of equals: "not greater than" favours the main centre
        # an auxiliary centre is followed with a chance of 3/4 f_gbest / f_mbest, else the main one is
        chance = 0.75 * _ratio(best_fitness[centres[0]], best_fitness[centres[nearest]])
        nearest[self._rng.random(len(x)) > chance] = 0
        learn_from: FloatArray = best[centres[nearest]]
        learn_from[centres] = best[centres]  # the centres themselves learn from their own best
        return learn_from


def choose_centres(best: FloatArray, best_fitness: FloatArray, auxiliary: int) -> NDArray[np.intp]:
    """Indices of the main centre and, after it, of the auxiliary centres (steps 1-4).

    Distances are taken in the unit cube, where no dimension outweighs another by its unit.

    Args:
        best: (particles, D) each particle's best position.
        best_fitness: (particles,) its fitness.
        auxiliary: number of auxiliary centres.
    """
    ranked = np.argsort(best_fitness, kind="stable")
    main, top = ranked[0], ranked[1 : len(ranked) // 2]  # step 1: the better half, less the best
    distance = np.linalg.norm(best[top] - best[main], axis=1)  # step 2, (10)
    weighted = distance / np.maximum(best_fitness[top], _TINY)  # step 3, (11): far and good
    chosen = top[np.argsort(-weighted, kind="stable")[:auxiliary]]  # step 4
    return np.concatenate(([main], chosen))


def _ratio(least: float, fitness: FloatArray) -> FloatArray:
    """least / fitness for least <= fitness, where zeros and infinities are equal to each other."""
    equal = fitness == least
    return np.where(equal, 1.0, least / np.where(equal, 1.0, fitness))


class _Space:
    """The search space as the unit cube, with the fitness of every position met so far."""

    def __init__(self, dimensions: Sequence[Dimension], fitness: Callable[[Position], float]) -> None:
        if not dimensions:
            raise ValueError("dimensions: want at least one")
        self.size = len(dimensions)
        self._dimensions = dimensions
        self._fitness = fitness
        self._known: dict[Position, float] = {}

    @property
    def evaluations(self) -> int:
        return len(self._known)

    def position(self, unit: FloatArray) -> Position:
        """The position in its own units, whole where it must be."""
        values = (d.low + float(t) * (d.high - d.low) for d, t in zip(self._dimensions, unit, strict=True))
        return tuple(float(round(x)) if d.integer else x for d, x in zip(self._dimensions, values, strict=True))

    def unit(self, position: Position) -> list[float]:
        """The inverse; a position outside is brought to the border, the only value of a dimension lies at 0."""
        if len(position) != self.size:
            raise ValueError(f"remembered position {position}: want {self.size} dimensions")
        spans = (max(d.high - d.low, _TINY) for d in self._dimensions)
        return [
            min(max((x - d.low) / span, 0.0), 1.0)
            for d, x, span in zip(self._dimensions, position, spans, strict=True)
        ]

    def evaluate(self, x: FloatArray) -> FloatArray:
        return np.array([self._evaluate(self.position(unit)) for unit in x])

    def _evaluate(self, position: Position) -> float:
        if position not in self._known:
            fitness = float(self._fitness(position))
            if fitness < 0.0:
                raise ValueError(f"fitness {fitness} at {position}: want 0 or more, equation 11 divides by it")
            self._known[position] = float("inf") if np.isnan(fitness) else fitness
        return self._known[position]
