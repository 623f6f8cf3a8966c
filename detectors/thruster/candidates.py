"""How good each order and window of the default method would be, for the search (paper 000, equations 15-17)."""

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
        self._columns, self._speed, self._usable, self._basis = columns, speed, usable, basis
        self._weight = usable / noise**2
        self._divisor = np.maximum(np.abs(speed), SPEED_FLOOR)
        window_min, window_max, _ = config.spans
        longest = min(window_max, len(speed))
        steps = np.geomspace(min(window_min, longest), longest, WINDOW_STEPS)
        self.windows: tuple[int, ...] = tuple(sorted({round(float(step)) for step in steps}))
        self.orders: tuple[int, ...] = tuple(range(1, config.order_max + 1))
        self._found: dict[tuple[int, int], tuple[float, FloatArray]] = {}

    def fitness(self, order: int, window: int) -> float:
        """Equation 17 for one candidate."""
        return self._solve(order, window)[0]

    def grid(self) -> FloatArray:
        """(orders, windows) fitness of all candidates."""
        return np.array([[self.fitness(order, window) for window in self.windows] for order in self.orders])

    def coefficients(self, choice: Choice) -> FloatArray:
        """(K,) of one candidate; 0 for the columns beyond its order."""
        return self._solve(choice.order, choice.window)[1]

    def _solve(self, order: int, window: int) -> tuple[float, FloatArray]:
        key = (order, window)
        if key not in self._found:
            self._found[key] = self._solve_anew(order, window)
        return self._found[key]

    def _solve_anew(self, order: int, window: int) -> tuple[float, FloatArray]:
        kept = self._basis.up_to(order)
        columns = self._columns[kept]
        weighted = columns[:, -window:] * self._weight[-window:]
        normal = weighted @ columns[:, -window:].T + np.diag(self._basis.prior_deviation[kept] ** -2.0)
        coefficients = np.zeros(self._basis.size)
        coefficients[kept] = np.linalg.solve(normal, weighted @ self._speed[-window:])
        error = np.abs(self._speed - coefficients @ self._columns) / self._divisor
        within, everywhere = self._usable[-window:], self._usable
        if not within.any():
            return np.inf, coefficients
        return float(max(error[-window:][within].mean(), error[everywhere].mean())), coefficients
