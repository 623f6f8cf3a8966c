"""How good each order and window of the default method would be, for the search (paper 000, equations 15-17).

All windows end at the newest sample, so that their normal equations are sums over the same few stretches; all orders
share them. The curves of all candidates are one batch of small equations, and their errors one matrix product.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from detectors.thruster.config import ThrusterConfig
from detectors.thruster.curve import CommandBasis
from detectors.thruster.polynomial import SPEED_FLOOR
from detectors.thruster.search import Choice

FloatArray = NDArray[np.float64]

WINDOW_STEPS = 5


class WindowCandidates:
    """Curves of every order, fitted to windows that end at the newest sample.

    The public test data of equation 17 are all samples at hand: a window that is too short to know the commands
    before it pays for it.

    Args:
        columns: (K, N) basis columns as they show in the speed, drift of the gain included.
        speed: (N,) speeds in top speeds.
        usable: (N,) samples to fit and test.
        basis: what the columns are.
        config: bounds of order and window.
        noise: standard deviation of the speed.
    """

    def __init__(
        self,
        columns: FloatArray,
        speed: FloatArray,
        usable: NDArray[np.bool_],
        basis: CommandBasis,
        config: ThrusterConfig,
        *,
        noise: float,
    ) -> None:
        self._columns, self._speed, self._basis = columns, speed, basis
        self._usable = usable.astype(np.float64)
        self._fitted = columns * (self._usable / noise**2)
        self._share = self._usable / np.maximum(np.abs(speed), SPEED_FLOOR)
        window_min, window_max, _ = config.spans
        longest = min(window_max, len(speed))
        steps = np.geomspace(min(window_min, longest), longest, WINDOW_STEPS)
        self.windows: tuple[int, ...] = tuple(sorted({round(float(step)) for step in steps}))
        self.orders: tuple[int, ...] = tuple(range(1, config.order_max + 1))
        self._found: dict[tuple[int, int], tuple[float, FloatArray]] = {}

    def fitness(self, order: int, window: int) -> float:
        """Equation 17 for one candidate."""
        if (order, window) not in self._found:
            self._solve((order,), (window,))
        return self._found[order, window][0]

    def grid(self) -> FloatArray:
        """(orders, windows) fitness of all candidates."""
        self._solve(self.orders, self.windows)
        return np.array([[self._found[order, window][0] for window in self.windows] for order in self.orders])

    def coefficients(self, choice: Choice) -> FloatArray:
        """(K,) of one candidate; 0 for the columns beyond its order."""
        self.fitness(choice.order, choice.window)
        return self._found[choice.order, choice.window][1]

    def _solve(self, orders: tuple[int, ...], windows: tuple[int, ...]) -> None:
        """Find the candidates of these orders and (increasing) windows."""
        curves = self._curves(orders, windows)
        fitness = self._fitness(curves, windows)
        for row, order in enumerate(orders):
            for column, window in enumerate(windows):
                self._found[order, window] = float(fitness[row, column]), curves[row, column]

    def _curves(self, orders: tuple[int, ...], windows: tuple[int, ...]) -> FloatArray:
        """(orders, windows, K) coefficients; equations of columns beyond the order are made to give 0."""
        normal, right = self._sums(windows)
        kept = np.array([self._basis.up_to(order) for order in orders])
        both = kept[:, None, :, None] & kept[:, None, None, :]
        prior = np.diag(self._basis.prior_deviation**-2.0)
        curves = np.linalg.solve(np.where(both, normal, 0.0) + prior, np.where(kept[:, None], right, 0.0)[..., None])
        return np.asarray(curves[..., 0])

    def _sums(self, windows: tuple[int, ...]) -> tuple[FloatArray, FloatArray]:
        """(windows, K, K) and (windows, K) sides of the normal equations."""
        normal, right = [], []
        for part in self._stretches(windows):
            normal.append(self._fitted[:, part] @ self._columns[:, part].T)
            right.append(self._fitted[:, part] @ self._speed[part])
        return np.cumsum(normal, axis=0), np.cumsum(right, axis=0)

    def _stretches(self, windows: tuple[int, ...]) -> list[slice]:
        """The samples that each window has more than the one before it."""
        starts = [len(self._speed) - window for window in windows]
        return [slice(start, stop) for start, stop in zip(starts, [len(self._speed), *starts], strict=False)]

    def _fitness(self, curves: FloatArray, windows: tuple[int, ...]) -> FloatArray:
        """(orders, windows) greater of the mean errors on the window and on all samples."""
        error = curves @ self._columns
        error -= self._speed
        np.abs(error, out=error)
        error *= self._share
        everywhere = error.sum(axis=-1) / self._usable.sum()
        within = np.empty_like(everywhere)
        for column, window in enumerate(windows):
            usable = self._usable[-window:].sum()
            within[:, column] = error[:, column, -window:].sum(axis=-1) / usable if usable else np.inf
        return np.asarray(np.maximum(within, everywhere))
