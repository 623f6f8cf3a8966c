"""Bayesian least squares for the curve, its gain drift and its dependence on the supply."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from detectors.thruster.window import Prepared

FloatArray = NDArray[np.float64]

TREND_DEVIATION = 0.1  # relative drift of the gain that is expected over `TREND_SAMPLES`
SUPPLY_DEVIATION = 1.0  # of the supply exponent


@dataclass(frozen=True, slots=True, eq=False)
class Fit:
    """A solved problem: (K,) coefficients, (K, K) covariance, (N,) residual of all samples."""

    coefficients: FloatArray
    covariance: FloatArray
    residual: FloatArray


def solve(design: FloatArray, prior: FloatArray, speed: FloatArray, weight: FloatArray) -> Fit:
    """Fit (N,) speeds by the (K, N) design.

    Args:
        prior: (K,) standard deviations of the coefficients around 0 before any sample.
        weight: (N,) 1 / variance of each sample, 0 to leave it out.
    """
    weighted = design * weight
    covariance = np.linalg.inv(weighted @ design.T + np.diag(prior**-2.0))
    coefficients = covariance @ (weighted @ speed)
    residual: FloatArray = speed - coefficients @ design
    return Fit(coefficients, np.asarray(covariance), residual)


def with_drift(columns: FloatArray, curve: FloatArray, data: Prepared) -> tuple[FloatArray, FloatArray]:
    """Design and prior of coefficients, then supply exponent, then linear and quadratic drift of the gain.

    Supply and drift multiply the curve: its (N,) values by an earlier fit make their columns.
    """
    design = np.concatenate([columns, [curve * data.supply, curve * data.time, curve * data.time**2]])
    deviations = [SUPPLY_DEVIATION, TREND_DEVIATION, TREND_DEVIATION]
    return design, np.concatenate([data.basis.prior_deviation, deviations])


def whitener(covariance: FloatArray, prior: FloatArray, inflation: float) -> FloatArray:
    """W with W'W the covariance, widened by `inflation` for correlated residuals but never beyond the prior."""
    precision = np.linalg.inv(covariance) / inflation
    symmetric = 0.5 * (precision + precision.T) + np.diag(prior**-2.0)
    return np.asarray(np.linalg.inv(np.linalg.cholesky(symmetric)))
