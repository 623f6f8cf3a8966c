"""How good each order and window would be (paper 000, equations 15-17), for all of them at little cost.

The sums x x', x y of a window that ends at the newest sample are running sums taken backwards from it, so that
every window's normal equations are there after one pass. One elimination, done for all windows at once, then gives
the curves of all orders: its pivots are nested, as order k adds one term to the curve of order k - 1.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from detectors.thruster.polynomial import EXCITATION_MIN, CommandRange, SpeedCurve, fit, speed_floor_rpm

FloatArray = NDArray[np.float64]


class Candidates:
    """Every model that could be learnt from one stretch of aligned data.

    The paper takes the public test data of equation 17 "from" the aligned data and says no more. Here they are the
    newest `window_min` samples: common to all candidates, and what the next prediction will be like. Only with
    recent test data can the model of a fault be learnt after about `window_min` samples, as it is in the paper's
    section 6.3: with test data from all of the history, the old state would be fitted while it is remembered.

    Args:
        command: (N,) aligned commands, oldest first.
        speed_rpm: (N,) aligned speeds.
        order_max: orders 1..order_max are candidates. A degree that a window's commands do not excite is left out of
            that window's model, which then equals the one of the order below.
        window_min: shortest window, in samples; N must reach it.
        window_max: longest window; no longer than N.

    Raises:
        ValueError: bounds that contradict each other, or fewer samples than `window_min`.
    """

    def __init__(
        self, command: FloatArray, speed_rpm: FloatArray, *, order_max: int, window_min: int, window_max: int
    ) -> None:
        _check(len(command), len(speed_rpm), order_max, window_min, window_max)
        self.orders = range(1, order_max + 1)
        self.windows = np.arange(window_min, min(window_max, len(command)) + 1)
        reach = int(self.windows[-1])
        self._command, self._speed_rpm = command[-reach:], speed_rpm[-reach:]
        self._range = CommandRange.of(self._command)
        newest_first = self._speed_rpm[::-1]
        basis = self._range.basis(self._command[::-1], order_max)
        self._coefficients = _curves(_mean_products(basis, newest_first, self.windows))
        weight = 1.0 / np.maximum(np.abs(newest_first), speed_floor_rpm(self._speed_rpm))
        self._weighted_basis = basis * weight[:, None]  # so that errors come out relative to the speed
        self._weighted_speed = newest_first * weight

    def fitness(self, order: int, window: int) -> float:
        """Fitness of one candidate: the greater of its MAPE on its window and on the test data (equation 17)."""
        coefficients = self._coefficients[window - int(self.windows[0]), order]
        error = np.abs(self._weighted_basis[:window] @ coefficients - self._weighted_speed[:window])
        return max(float(error.mean()), float(error[: self.windows[0]].mean()))

    def grid(self) -> FloatArray:
        """Fitness of all candidates, (orders, windows)."""
        return np.stack([self._fitness_of_windows(order) for order in self.orders])

    def model(self, order: int, window: int) -> SpeedCurve:
        """The curve of one candidate."""
        return fit(self._command[-window:], self._speed_rpm[-window:], order, self._range)

    def _fitness_of_windows(self, order: int) -> FloatArray:
        error: FloatArray = self._coefficients[:, order] @ self._weighted_basis.T
        error -= self._weighted_speed
        np.abs(error, out=error)
        total = np.cumsum(error, axis=1, out=error)
        last = self.windows - 1
        on_window = total[np.arange(len(last)), last] / self.windows
        return np.asarray(np.maximum(on_window, total[:, last[0]] / self.windows[0]))


def _mean_products(basis: FloatArray, speed_rpm: FloatArray, windows: NDArray[np.int_]) -> FloatArray:
    """Mean of z z' over each window, where z is the basis with the speed as its last entry: (windows, z, z)."""
    z = np.column_stack((basis, speed_rpm))
    sums: FloatArray = np.cumsum(z[:, :, None] * z[:, None, :], axis=0)
    means: FloatArray = sums[windows - 1] / windows[:, None, None]
    return means


def _curves(products: FloatArray) -> FloatArray:
    """Least-squares coefficients of every window and order, (windows, order, coefficient), from the mean products.

    A Cholesky elimination, column by column for all windows together. Column k turns degree k into a unit direction
    orthogonal to the lower degrees over that window, `direction`; what the speed has along it is the last entry of
    the column, so that the curve of order k is the curve of order k - 1 plus that much of the direction.
    """
    remainder = products.copy()
    windows, degrees = len(products), products.shape[1] - 1
    columns = np.zeros((windows, degrees + 1, degrees))
    directions = np.zeros((windows, degrees, degrees))
    curve = np.zeros((windows, degrees))
    curves = np.empty((windows, degrees, degrees))
    excited = np.ones(windows, dtype=bool)
    for k in range(degrees):
        rms = np.sqrt(np.maximum(remainder[:, k, k], 0.0))
        excited &= (rms >= EXCITATION_MIN) | (k == 0)
        inverse = np.divide(1.0, rms, out=np.zeros(windows), where=excited)
        column = remainder[:, :, k] * inverse[:, None]
        remainder -= column[:, :, None] * column[:, None, :]
        direction = -np.einsum("wj,wjd->wd", columns[:, k, :k], directions[:, :k])
        direction[:, k] += 1.0
        directions[:, k] = direction * inverse[:, None]
        columns[:, :, k] = column
        curve += column[:, -1:] * directions[:, k]
        curves[:, k] = curve
    return curves


def _check(commands: int, speeds: int, order_max: int, window_min: int, window_max: int) -> None:
    if order_max < 1:
        raise ValueError(f"order_max = {order_max}: want 1 or more")
    if not 2 <= window_min <= window_max:
        raise ValueError(f"window_min = {window_min}, window_max = {window_max}: want 2 <= window_min <= window_max")
    if commands != speeds or commands < window_min:
        raise ValueError(
            f"{commands} commands, {speeds} speeds: want as many of both, at least window_min = {window_min}"
        )
