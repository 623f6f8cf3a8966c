"""The error-state Kalman filter itself (paper 003, equations 4 and 5): covariance of the states' errors, and gains.

The errors themselves are fed back at once, so that their estimate is 0 before every measurement.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from detectors.navigation.error_model import error_dynamics, transition
from detectors.navigation.measurement import Comparison
from detectors.navigation.sample import Vector
from detectors.navigation.strapdown import Strapdown

FloatArray = NDArray[np.float64]

STEP_S = 0.1  # longest step of the covariance
LONGEST_S = 1.0  # that a transition is computed over; a gap of the IMU brings doubt of its own


class ErrorFilter:
    """Follows the covariance, and weighs measurements by it.

    Args:
        covariance: (N, N) of the states' errors at the start.
        density: (N, N) spectral densities of the noise that drives them.
    """

    def __init__(self, covariance: FloatArray, density: FloatArray) -> None:
        self._states = len(covariance)
        # here, for it brings all of scipy.stats, for which no command that only asks or checks should wait a second
        from filterpy.kalman import KalmanFilter

        self._filter = KalmanFilter(dim_x=self._states, dim_z=3)
        self._filter.P = covariance
        self._density = density
        self._transition, self._process = np.eye(self._states), np.zeros((self._states, self._states))
        self._unpropagated_s, self._force = 0.0, np.zeros(3)

    @property
    def covariance(self) -> FloatArray:
        """(N, N) of the states' errors."""
        return np.asarray(self._filter.P)

    @property
    def step_due(self) -> bool:
        """As much time has passed as a step of the covariance may take."""
        return self._unpropagated_s >= STEP_S

    def deviation(self, state: int) -> float:
        """Standard deviation of a state's error."""
        return float(np.sqrt(max(self._filter.P[state, state], 0.0)))

    def expected(self, observation: FloatArray, noise: FloatArray) -> FloatArray:
        """(M, M) covariance of an innovation: H P H' + R, of H (M, N) and R (M, M)."""
        return np.asarray(observation @ self._filter.P @ observation.T + noise)

    def elapse(self, interval_s: float, specific_force_mps2: Vector) -> None:
        """Time passes, under a force (3,) north, east, down; `propagate` takes in what came together."""
        self._unpropagated_s += interval_s
        self._force += np.array(specific_force_mps2) * interval_s

    def propagate(self, strapdown: Strapdown) -> None:
        """Brings the covariance to the instant of the strapdown system."""
        if self._unpropagated_s <= 0.0:
            return
        force = self._force / self._unpropagated_s
        dynamics = error_dynamics(strapdown, (force[0], force[1], force[2]), self._states)
        phi, added = transition(dynamics, self._density, min(self._unpropagated_s, LONGEST_S))
        self._filter.predict(F=phi, Q=added)
        self._transition = phi @ self._transition
        self._process = phi @ self._process @ phi.T + added
        self._unpropagated_s, self._force = 0.0, np.zeros(3)

    def passed(self) -> tuple[FloatArray, FloatArray]:
        """(N, N) transition of the states, and (N, N) covariance of what came to them, since the last call."""
        passed = self._transition, self._process
        self._transition, self._process = np.eye(self._states), np.zeros((self._states, self._states))
        return passed

    def update(self, comparison: Comparison) -> tuple[FloatArray, FloatArray]:
        """Learns from a measurement.

        Args:
            comparison: innovation (M,), observation (M, N) and noise (M, M).

        Returns:
            The gain (N, M), and the states' error (N,) that is to be fed back.

        Raises:
            ValueError: the shapes do not fit together.
        """
        self._check_shapes(comparison)
        innovation, observation, noise = comparison
        size = len(innovation)
        self._filter.dim_z = size
        self._filter.update(innovation.reshape(size, 1), R=noise, H=observation)
        gain, error = np.asarray(self._filter.K), self._filter.x[:, 0].copy()
        self._filter.x[:] = 0.0
        return gain, error

    def consider(self, comparison: Comparison, considered: Sequence[int]) -> tuple[FloatArray, FloatArray]:
        """The same, but the uncertainty of some states is taken into account and left as it is (Schmidt's filter).

        Raises:
            ValueError: the shapes do not fit together.
        """
        self._check_shapes(comparison)
        innovation, observation, noise = comparison
        before = self._filter.P
        shown = before @ observation.T
        gain = shown @ np.linalg.inv(observation @ shown + noise)
        gain[considered] = 0.0
        kept = np.eye(self._states) - gain @ observation
        # Joseph's form, which holds for any gain: (I - K H) P (I - K H)' + K R K'
        self._filter.P = kept @ before @ kept.T + gain @ noise @ gain.T
        return np.asarray(gain), gain @ innovation

    def loosen(self, variances: FloatArray) -> None:
        """Something has come to the states: (N,) variances."""
        self._filter.P = self._filter.P + np.diag(variances)
        self._process = self._process + np.diag(variances)

    def add(self, covariance: FloatArray) -> None:
        """The states are less sure by this (N, N), but did not change."""
        self._filter.P = self._filter.P + covariance

    def replace(self, covariance: FloatArray) -> None:
        """From now on it is this one (N, N)."""
        self._filter.P = covariance.copy()

    def renew(self, states: slice, covariance: FloatArray) -> None:
        """Some states (n) are found otherwise: they have this covariance (n, n), and go with no others any more."""
        renewed = self._filter.P.copy()
        renewed[states, :], renewed[:, states] = 0.0, 0.0
        renewed[states, states] = covariance
        self._filter.P = renewed

    def _check_shapes(self, comparison: Comparison) -> None:
        """filterpy multiplies whatever fits, and broadcasts what does not."""
        size = len(comparison.innovation)
        shapes = tuple(one.shape for one in comparison)
        if shapes != ((size,), (size, self._states), (size, size)):
            raise ValueError(f"innovation, observation, noise {shapes}: want (M,), (M, {self._states}), (M, M)")
