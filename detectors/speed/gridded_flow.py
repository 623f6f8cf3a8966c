"""A current forecast on a grid, as an outside model of the flow (paper 002, F_M)."""

from __future__ import annotations

from dataclasses import dataclass
from math import nan

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Place = tuple[int, float]  # node below, and the share of the way to the next one

AXES = ("time_s", "down_m", "north_m", "east_m")
NODES_MIN = (1, 1, 2, 2)
UNKNOWN = np.full(2, nan)


@dataclass(frozen=True, slots=True, eq=False)
class GriddedFlow:
    """Velocities at the nodes of a grid in time and space, linear between them.

    Outside the grid nothing is known: NaN. Land is NaN at its nodes, and so is every place whose value would take
    from one of them, however little: the coast is never guessed. A water node itself is known, and so is the line
    between two of them along land. Above the uppermost level, that level's current holds. A single time is a steady
    current, a single level a current of all depths.

    Attributes:
        time_s: (T,) rising.
        down_m: (Z,) depths, rising.
        north_m: (Y,) rising.
        east_m: (X,) rising.
        grid_mps: (T, Z, Y, X, 2) north and east, or (T, Z, Y, X, 3) with down; NaN over land.

    Raises:
        ValueError: an axis that does not rise, or a shape or a number that does not fit.
    """

    time_s: FloatArray
    down_m: FloatArray
    north_m: FloatArray
    east_m: FloatArray
    grid_mps: FloatArray

    def __post_init__(self) -> None:
        for name, nodes_min in zip(AXES, NODES_MIN, strict=True):
            axis = np.asarray(getattr(self, name), dtype=float)
            if (
                axis.ndim != 1
                or len(axis) < nodes_min
                or not np.all(np.diff(axis) > 0)
                or not np.isfinite(axis).all()
            ):
                raise ValueError(f"{name} = {axis!r}: want {nodes_min} or more finite numbers that rise")
            object.__setattr__(self, name, axis)
        grid = np.ascontiguousarray(self.grid_mps, dtype=float)
        nodes = tuple(len(getattr(self, name)) for name in AXES)
        if grid.shape not in {(*nodes, 2), (*nodes, 3)}:
            raise ValueError(f"grid_mps has the shape {grid.shape}: want {nodes} and then 2 or 3 components")
        if np.isinf(grid).any():
            raise ValueError("grid_mps has infinite velocities: want finite ones, and NaN over land")
        object.__setattr__(self, "grid_mps", grid)

    def velocity_mps(self, time_s: float, position_m: FloatArray) -> FloatArray:
        """(D,) velocity of the water; NaN where nothing is known; none up or down where the grid has two components.

        Without a depth in `position_m` the uppermost level's.
        """
        top = self.down_m[0]
        depth = max(top, position_m[2]) if len(position_m) > 2 else top
        values = (time_s, depth, position_m[0], position_m[1])
        places = [_place(getattr(self, name), value) for name, value in zip(AXES, values, strict=True)]
        known = [place for place in places if place is not None]
        velocity = self._between(known) if len(known) == len(places) else UNKNOWN
        if np.isnan(velocity).any():
            return np.full(len(position_m), nan)
        return np.append(velocity, 0.0)[: len(position_m)]

    def _between(self, places: list[Place]) -> FloatArray:
        velocity = self.grid_mps[tuple(slice(lower, lower + 2) for lower, _ in places)]
        for _, share in places:
            velocity = _mixed(velocity, share)
        return velocity


def _place(axis: FloatArray, value: float) -> Place | None:
    """Where a value stands on an axis; None beside it."""
    if len(axis) == 1:
        return 0, 0.0
    if not axis[0] <= value <= axis[-1]:
        return None
    lower = min(int(np.searchsorted(axis, value, side="right")), len(axis) - 1) - 1
    return lower, float((value - axis[lower]) / (axis[lower + 1] - axis[lower]))


def _mixed(pair: FloatArray, share: float) -> FloatArray:
    """Between the two nodes along the first axis; a node that has no share in it may be land."""
    before: FloatArray = pair[0]
    if share == 0.0:
        return before
    after: FloatArray = pair[1]
    return after if share == 1.0 else (1.0 - share) * before + share * after
