"""A flow that is learnt: parameters times basis (paper 002, equation 4)."""

from __future__ import annotations

from copy import copy
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray

from detectors.speed.basis import FlowBasis

FloatArray = NDArray[np.float64]


class LearntFlow(Protocol):
    """F_L = xi phi (paper 002, equations 4 and 7), with its parameters xi; D is 2 or 3. Also a `FlowModel`.

    `frozen` is what makes F_M of it: the same parameters later on, at other places.
    """

    @property
    def dimensions(self) -> int:
        """D."""

    @property
    def finest_m(self) -> float:
        """Over a way much shorter than this the basis changes little."""

    @property
    def fastest_radps(self) -> float:
        """Greatest angular frequency in the basis; 0 where it is steady."""

    def move(self, position_m: FloatArray, time_s: float) -> None:
        """The vehicle is here now: a basis that moves with it follows."""

    def values(self, position_m: FloatArray, time_s: float) -> FloatArray:
        """(N,) phi, the basis, at a place and time."""

    def velocity_mps(self, time_s: float, position_m: FloatArray) -> FloatArray:
        """(D,) xi phi, the flow learnt, at a place and time."""

    def learn(self, values: FloatArray, amount: FloatArray) -> None:
        """Adds amount (x) phi to xi: `values` (N,) is phi as of `values`, `amount` (D,)."""

    def frozen(self) -> Self:
        """A copy that later learning does not change."""


class FixedBasisFlow:
    """xi phi over a basis that stays where it is.

    Args:
        basis: phi.
        dimensions: D.
        parameters: (D, N) xi at the start, m/s; zeros where not given.

    Raises:
        ValueError: parameters of another shape, or not finite.
    """

    def __init__(self, basis: FlowBasis, dimensions: int = 2, parameters: FloatArray | None = None) -> None:
        shape = dimensions, basis.size
        start = np.zeros(shape) if parameters is None else np.array(parameters, dtype=np.float64)
        if start.shape != shape or not np.isfinite(start).all():
            raise ValueError(f"parameters = {parameters!r}: want finite numbers of the shape {shape}")
        self._basis, self._parameters = basis, start

    @property
    def parameters(self) -> FloatArray:
        """(D, N) xi."""
        return self._parameters.copy()

    @property
    def dimensions(self) -> int:
        """As `LearntFlow.dimensions`."""
        return len(self._parameters)

    @property
    def finest_m(self) -> float:
        """As `LearntFlow.finest_m`."""
        return self._basis.finest_m

    @property
    def fastest_radps(self) -> float:
        """As `LearntFlow.fastest_radps`."""
        return self._basis.fastest_radps

    def move(self, position_m: FloatArray, time_s: float) -> None:
        """Nothing to do."""

    def values(self, position_m: FloatArray, time_s: float) -> FloatArray:
        """As `LearntFlow.values`."""
        return self._basis.values(position_m, time_s)

    def velocity_mps(self, time_s: float, position_m: FloatArray) -> FloatArray:
        """As `LearntFlow.velocity_mps`."""
        velocity: FloatArray = self._parameters @ self.values(position_m, time_s)
        return velocity

    def learn(self, values: FloatArray, amount: FloatArray) -> None:
        """As `LearntFlow.learn`."""
        # a new array, not in place: a frozen copy shares the old one
        self._parameters = self._parameters + np.multiply.outer(amount, values)

    def frozen(self) -> Self:
        """As `LearntFlow.frozen`."""
        return copy(self)
