"""The static curve of the default method: a smooth polynomial of each direction's command, known as well as it is.

Chebyshev polynomials T_0..T_q of the magnitude of the command, scaled to -1..1, once for ahead and, where the
thruster is driven astern, once more for astern: a propeller is not symmetric, and a dead band puts a kink at neutral.
The neutral command asks for no speed.

The curve is not fitted freely but with a prior (Bayesian least squares): its coefficients of degree j are expected
to be within about `SMOOTHNESS / j^2` of the top speed. What the window's commands did not excite then stays
uncertain by as much, instead of being taken for known, and that uncertainty is part of every threshold.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

SMOOTHNESS = 0.5


@dataclass(frozen=True, slots=True)
class CommandBasis:
    """The columns that a static curve is made of.

    Attributes:
        scale: greatest magnitude of the command that is mapped to 1.
        order: highest degree of each direction's polynomial.
        astern: whether there are columns for negative commands as well.
        neutral: command that asks for no speed; magnitudes and directions are meant from there.
    """

    scale: float
    order: int
    astern: bool
    neutral: float = 0.0

    @property
    def size(self) -> int:
        """Number of columns K."""
        return (self.order + 1) * (2 if self.astern else 1)

    @property
    def degrees(self) -> FloatArray:
        """(K,) degree of each column."""
        return _degrees(self.order, self.astern)

    @property
    def prior_deviation(self) -> FloatArray:
        """(K,) standard deviation that each coefficient has before any sample, in top speeds."""
        return _prior_deviation(self.order, self.astern)

    def columns(self, command: FloatArray) -> FloatArray:
        """(K, N) columns for (N,) commands. Element by element: the same whether N is 1 or 1000."""
        relative = command - self.neutral
        scaled = np.abs(relative) * (2.0 / self.scale) - 1.0
        degrees = [np.ones_like(scaled), scaled]
        for _ in range(2, self.order + 1):
            degrees.append(2.0 * scaled * degrees[-1] - degrees[-2])
        polynomials = np.stack(degrees[: self.order + 1])
        ahead = polynomials * (relative > 0.0)
        return np.concatenate([ahead, polynomials * (relative < 0.0)]) if self.astern else ahead

    def up_to(self, order: int) -> NDArray[np.bool_]:
        """(K,) which columns a curve of this lower order uses."""
        return self.degrees <= order


@cache
def _degrees(order: int, astern: bool) -> FloatArray:
    return _frozen(np.tile(np.arange(order + 1.0), 2 if astern else 1))


@cache
def _prior_deviation(order: int, astern: bool) -> FloatArray:
    degrees = _degrees(order, astern)
    return _frozen(np.where(degrees < 2, 1.0, SMOOTHNESS / np.maximum(degrees, 1.0) ** 2))


def _frozen(array: FloatArray) -> FloatArray:
    """The array, which is shared from here on."""
    array.flags.writeable = False
    return array


def combine(coefficients: FloatArray, columns: FloatArray) -> FloatArray:
    """(R, N) = (R, K) @ (K, N), summed in the order of K whatever the shapes.

    A matrix product would round differently for one sample than for a block of them; then a replay in blocks would
    not equal the live run bit for bit.
    """
    total = coefficients[:, 0, None] * columns[0]
    for k in range(1, len(columns)):
        total = total + coefficients[:, k, None] * columns[k]
    return np.asarray(total)
