"""A basis of the flow that is chosen from the area driven, and moves with the vehicle.

Paper 002 leaves centres and widths to who knows the area. Here the centres are the nodes of a lattice over the whole
sea, of which those around the vehicle are in use, and the lattice is as wide as the vehicle's recent track asks for.
"""

from __future__ import annotations

from copy import copy
from math import ceil, exp, floor, inf, log2
from typing import Self

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Node = tuple[int, int]

# Nodes in use along each axis, counted from the south-west corner of the vehicle's cell. What is left out at the
# moment when a node falls out of use is exp(-8) of the node at hand.
_REACH = (-1, 0, 1, 2)
WIDTH_SPACINGS = 0.5  # standard deviation of each Gaussian: wide enough to blend, narrow enough to tell nodes apart
SPACINGS_PER_EXTENT = 2.0  # the recent track spans at most so many spacings, before the lattice is made wider
SHRINK = 4.0  # and at least a fourth of that, before it is made narrower
SPACING_MIN_M = 1.0
RECENT_S = 150.0  # the recent track: the last one to two times this
NODES_MAX = 256


class _Extent:
    """How far the recent track spans, from two boxes that take turns: bounded memory, and no sample is kept."""

    def __init__(self) -> None:
        self._boxes = [(inf, inf, -inf, -inf)] * 2
        self._since_s = -inf

    def include(self, position_m: FloatArray, time_s: float) -> float:
        """Longer side of the box around the recent track, after this position."""
        north, east = float(position_m[0]), float(position_m[1])
        if not 0.0 <= time_s - self._since_s < RECENT_S:
            self._boxes = [self._boxes[1], (north, east, north, east)]
            self._since_s = time_s
        south, west, far_north, far_east = self._boxes[1]
        self._boxes[1] = (min(south, north), min(west, east), max(far_north, north), max(far_east, east))
        sides = np.array(self._boxes)
        return float((sides[:, 2:].max(axis=0) - sides[:, :2].min(axis=0)).max())


class MovingBasisFlow:
    """A flow that is learnt over normalised Gaussians around the vehicle: a `LearntFlow`, steady in time.

    They add up to 1 everywhere, so that a uniform flow is exactly one with all parameters equal. Nodes come into use
    with the flow that was learnt just before. Those left behind keep theirs, the latest `NODES_MAX` of them.

    Args:
        dimensions: D; the basis is over the horizontal position in either case.
    """

    fastest_radps = 0.0

    def __init__(self, dimensions: int = 2) -> None:
        self._nodes: dict[Node, FloatArray] = {}  # (D,) each, the one in use last at the end
        self._elsewhere = np.zeros(dimensions)  # the flow learnt last: what is assumed where no node is known
        self._spacing_m = SPACING_MIN_M
        self._cell: Node | None = None
        self._extent = _Extent()

    @property
    def dimensions(self) -> int:
        """As `LearntFlow.dimensions`."""
        return len(self._elsewhere)

    @property
    def spacing_m(self) -> float:
        """Of the lattice; a Gaussian's width is `WIDTH_SPACINGS` of it."""
        return self._spacing_m

    @property
    def finest_m(self) -> float:
        """As `LearntFlow.finest_m`."""
        return WIDTH_SPACINGS * self._spacing_m

    @property
    def known_nodes(self) -> int:
        """Nodes whose parameters are kept."""
        return len(self._nodes)

    def move(self, position_m: FloatArray, time_s: float) -> None:
        """As `LearntFlow.move`: brings the nodes around this place into use."""
        wanted_m = max(self._extent.include(position_m, time_s) / SPACINGS_PER_EXTENT, SPACING_MIN_M)
        if not wanted_m <= self._spacing_m <= SHRINK * wanted_m:
            self._respace(2.0 ** ceil(log2(wanted_m)))
        cell = self._cell_of(position_m)
        if cell != self._cell:
            self._enter(cell)

    def values(self, position_m: FloatArray, time_s: float) -> FloatArray:
        """(16,) the Gaussians in use, at the place moved to last. As `LearntFlow.values`."""
        return self._weights(position_m, self._cell or self._cell_of(position_m))

    def velocity_mps(self, time_s: float, position_m: FloatArray) -> FloatArray:
        """As `LearntFlow.velocity_mps`; what was learnt last stands for nodes that were never in use."""
        cell = self._cell_of(position_m)
        known = np.array([self._nodes.get(node, self._elsewhere) for node in _around(cell)])
        velocity: FloatArray = self._weights(position_m, cell) @ known
        return velocity

    def learn(self, values: FloatArray, amount: FloatArray) -> None:
        """As `LearntFlow.learn`."""
        nodes = _around(self._cell or (0, 0))
        # new arrays, not in place: a frozen copy shares the old ones
        changed = np.array([self._nodes.get(node, self._elsewhere) for node in nodes]) + np.outer(values, amount)
        self._nodes.update(zip(nodes, changed, strict=True))
        self._elsewhere = values @ changed / values.sum()

    def frozen(self) -> Self:
        """As `LearntFlow.frozen`."""
        other = copy(self)
        other._nodes = self._nodes.copy()
        other._extent = _Extent()
        return other

    def _cell_of(self, position_m: FloatArray) -> Node:
        return floor(position_m[0] / self._spacing_m), floor(position_m[1] / self._spacing_m)

    def _weights(self, position_m: FloatArray, cell: Node) -> FloatArray:
        """(16,) normalised Gaussians of the nodes around a cell, in the order of `_around`."""
        north, east = (
            _normalised(float(along) / self._spacing_m - corner)
            for along, corner in zip(position_m[:2], cell, strict=True)
        )
        return np.outer(north, east).ravel()

    def _enter(self, cell: Node) -> None:
        self._cell = cell
        for node in _around(cell):
            # taken out and put back: the end of the dictionary is what was in use last
            self._nodes[node] = self._nodes.pop(node, self._elsewhere)
        while len(self._nodes) > NODES_MAX:
            del self._nodes[next(iter(self._nodes))]

    def _respace(self, spacing_m: float) -> None:
        """The same flow on a wider or narrower lattice: nodes next to the old ones take the flow of their place."""
        ratio = self._spacing_m / spacing_m
        nearest = dict.fromkeys((round(i * ratio), round(j * ratio)) for i, j in self._nodes)
        places = {node: np.array(node) * spacing_m for node in nearest}
        learnt = {node: self.velocity_mps(0.0, place) for node, place in places.items()}
        self._nodes, self._spacing_m, self._cell = learnt, spacing_m, None


def _around(cell: Node) -> list[Node]:
    return [(cell[0] + i, cell[1] + j) for i in _REACH for j in _REACH]


def _normalised(along: float) -> FloatArray:
    """(4,) Gaussians of the nodes of `_REACH` at a place `along` (0 to 1) the cell; they add up to 1."""
    gaussians = np.array([exp(-0.5 * ((along - node) / WIDTH_SPACINGS) ** 2) for node in _REACH])
    normalised: FloatArray = gaussians / gaussians.sum()
    return normalised
