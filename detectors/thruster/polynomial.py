"""The curve from command to speed: a polynomial by least squares (paper 000, equations 4-7), and its error (16).

The paper's powers of the command (equation 6) are replaced by Chebyshev polynomials of the command scaled to -1..1.
They span the same curves, so that the least-squares prediction is the same, but stay well conditioned.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

# A degree whose part that lower degrees do not explain has an rms below this (of the 1 that it could have) over the
# window's commands is not excited: its coefficient would be made of noise, and is left out.
EXCITATION_MIN = 1e-3
# Percentage errors divide by the speed; speeds below this part of the top speed count as this (`speed_floor_rpm`).
SPEED_FLOOR = 0.05
_NORMAL_QUANTILE_90 = 1.6449  # 90 % of |x| of a standard normal lie below


@dataclass(frozen=True, slots=True)
class CommandRange:
    """The commands that are scaled to -1..1: those within `centre` +- `half_range`."""

    centre: float
    half_range: float

    def __post_init__(self) -> None:
        if not (np.isfinite(self.centre) and 0.0 < self.half_range < np.inf):
            raise ValueError(f"command range {self.centre} +- {self.half_range}: want finite, half range above 0")

    @classmethod
    def of(cls, command: FloatArray) -> CommandRange:
        """The range that these commands span; a lone command gets a half range of 1."""
        low, high = float(command.min()), float(command.max())
        return cls(0.5 * (low + high), 0.5 * (high - low) or 1.0)

    def basis(self, command: FloatArray | float, order: int) -> FloatArray:
        """T_0 .. T_order of the scaled command: (N, order + 1), for a single command (order + 1,)."""
        scaled = (np.asarray(command, dtype=np.float64) - self.centre) / self.half_range
        basis = np.asarray(chebyshev.chebvander(scaled, order), dtype=np.float64)
        return basis.reshape(*scaled.shape, order + 1)


@dataclass(frozen=True, slots=True, eq=False)
class SpeedCurve:
    """A fitted polynomial with what is needed to say how well it is known.

    Attributes:
        range: the scaling of its commands.
        coefficients: (order + 1,) of the Chebyshev polynomials, rpm.
        whitener: (order + 1, order + 1) lower triangular W with W'W = (X'X)^-1.
        noise_rpm: standard deviation of its fit residuals, tolerant of one outlier in ten.
        window: number of samples that it was fitted to.
    """

    range: CommandRange
    coefficients: FloatArray
    whitener: FloatArray
    noise_rpm: float
    window: int

    @property
    def order(self) -> int:
        """Degree that was fitted: 0, a constant, where the commands did not change."""
        return len(self.coefficients) - 1

    def predict(self, command: FloatArray | float) -> FloatArray:
        """Speed in rpm at these commands (equation 4), of the shape of `command`."""
        return np.asarray(self.range.basis(command, self.order) @ self.coefficients)

    def leverage(self, command: float) -> float:
        """Variance of the curve at this command over that of one measurement: x'(X'X)^-1 x.

        Infinite where a constant is asked about a command other than the one that it was fitted to.
        """
        if self.order == 0 and abs(command - self.range.centre) > EXCITATION_MIN * self.range.half_range:
            return float("inf")
        white = self.whitener @ self.range.basis(command, self.order)
        return float(white @ white)


def fit(command: FloatArray, speed_rpm: FloatArray, order: int, within: CommandRange | None = None) -> SpeedCurve:
    """The polynomial of at most this order that is nearest to the speeds in the least-squares sense (equation 5).

    The order is lowered to what the commands excite: with m distinct commands to m - 1 at most.

    Args:
        command: (w,) commands, aligned with the speeds.
        speed_rpm: (w,) speeds.
        order: highest degree.
        within: scaling of the commands; theirs by default.

    Raises:
        ValueError: shapes differ, no samples, or a negative order.
    """
    if command.ndim != 1 or command.shape != speed_rpm.shape or not len(command):
        raise ValueError(
            f"command {command.shape} and speed_rpm {speed_rpm.shape}: want two series of one length > 0"
        )
    if order < 0:
        raise ValueError(f"order = {order}: want 0 or more")
    within = within or CommandRange.of(command)
    # X = QR; the leading k columns of Q and R are the factors for order k - 1
    q, r = np.linalg.qr(within.basis(command, min(order, len(command) - 1)))
    excited = excited_degrees(np.abs(np.diag(r)) / np.sqrt(len(command)))
    whitener = np.linalg.inv(r[:excited, :excited]).T
    coefficients = whitener.T @ (q[:, :excited].T @ speed_rpm)
    residual = speed_rpm - within.basis(command, excited - 1) @ coefficients
    if excited == 1:  # remember where the constant holds
        within = CommandRange(float(command.mean()), within.half_range)
    return SpeedCurve(within, coefficients, whitener, noise(residual), len(command))


def excited_degrees(rms: FloatArray) -> int:
    """How many leading degrees are excited, the constant always; `rms`: of each degree's part beyond lower ones."""
    unexcited = rms < EXCITATION_MIN
    return max(1, int(np.argmax(unexcited))) if unexcited.any() else len(rms)


def noise(residual: FloatArray) -> float:
    """Standard deviation, from the 90 % quantile of the magnitude.

    Not the median: a static curve errs while the motor speeds up or down, and its noise must own up to that. Not the
    root mean square: the first samples of a fault would widen their own threshold.
    """
    return float(np.quantile(np.abs(residual), 0.9)) / _NORMAL_QUANTILE_90


def speed_floor_rpm(speed_rpm: FloatArray) -> float:
    """Speed below which percentage errors are taken of this speed instead: 5 % of the greatest magnitude.

    Equation 16 divides by the measured speed, which is zero at a standstill; 1 rpm where all are zero.
    """
    return SPEED_FLOOR * float(np.abs(speed_rpm).max()) or 1.0


def mape(measured_rpm: FloatArray, predicted_rpm: FloatArray, floor_rpm: float) -> float:
    """Mean absolute percentage error, as a fraction (equation 16), with the floor of `speed_floor_rpm`."""
    return float(np.mean(np.abs(measured_rpm - predicted_rpm) / np.maximum(np.abs(measured_rpm), floor_rpm)))
