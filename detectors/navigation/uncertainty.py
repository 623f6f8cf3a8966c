"""How little is known of the states: at the start, and after what makes the filter doubt itself."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from detectors.navigation.config import NavigationConfig
from detectors.navigation.error_model import (
    ACCELEROMETER_BIAS,
    ATTITUDE,
    GYROSCOPE_BIAS,
    POSITION,
    VELOCITY,
    initial_covariance,
    process_noise,
)
from detectors.navigation.installation import ALL_STATES, INSTALLED, Installation, installation_noise

FloatArray = NDArray[np.float64]

# A gap of the IMU: nobody knows how the vehicle moved, so as much is added to the uncertainty, for each second.
GAP_TURN_RADPS, GAP_ACCELERATION_MPS2 = 0.3, 0.5
# Standard deviations after an inertial sensor's bias has jumped: of attitude, velocity, and the biases.
SHAKEN_RAD, SHAKEN_MPS, SHAKEN_MPS2, SHAKEN_RADPS = 0.2, 2.0, 0.3, 0.02


def covariance_at_start(config: NavigationConfig, installation: Installation) -> FloatArray:
    """(N, N) of all states."""
    covariance = initial_covariance(config, ALL_STATES)
    covariance[INSTALLED, INSTALLED] = installation.covariance
    return covariance


def noise_density(config: NavigationConfig) -> FloatArray:
    """(N, N) spectral densities of what drives all states' errors."""
    density = process_noise(config, ALL_STATES)
    density[INSTALLED, INSTALLED] = np.diag(installation_noise(config))
    return density


def variances_of_gap(gap_s: float) -> FloatArray:
    """(N,) that come to the states while no sample of the IMU does."""
    variances = np.zeros(ALL_STATES)
    variances[ATTITUDE] = (GAP_TURN_RADPS * gap_s) ** 2
    variances[VELOCITY] = (GAP_ACCELERATION_MPS2 * gap_s) ** 2
    variances[POSITION] = (GAP_ACCELERATION_MPS2 * gap_s**2) ** 2
    return variances


def variances_anew(config: NavigationConfig, *, shaken: bool) -> FloatArray:
    """(N,) of the start, but for the position, which stays.

    Args:
        config: of the start.
        shaken: an inertial sensor's bias has jumped, and may be anything.
    """
    fresh = np.diag(initial_covariance(config, ALL_STATES)).copy()
    if shaken:
        fresh[ATTITUDE], fresh[VELOCITY] = SHAKEN_RAD**2, SHAKEN_MPS**2
        fresh[ACCELEROMETER_BIAS], fresh[GYROSCOPE_BIAS] = SHAKEN_MPS2**2, SHAKEN_RADPS**2
    fresh[INSTALLED] = np.diag(Installation.of(config).covariance)
    fresh[POSITION] = 0.0
    return fresh
