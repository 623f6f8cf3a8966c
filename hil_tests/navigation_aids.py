"""What others tell a vehicle in a trial: acoustic fixes, an autopilot's attitude, and where it begins."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from detectors.navigation import NavigationState
from gateway.navigation_data import NavigationData

FloatArray = NDArray[np.float64]

# Standard deviations of an initial state as an autopilot knows it; the reference of a simulated dive is exact.
LEVEL_ERROR_RAD, HEADING_ERROR_RAD = np.deg2rad(0.5), np.deg2rad(2.0)
VELOCITY_ERROR_MPS = 0.05
# Of a compass, calibrated on the spot: from sample to sample, and what stays.
COMPASS_NOISE_RAD, COMPASS_ERROR_RAD = np.deg2rad(1.0), np.deg2rad(0.5)
EARTH_RADIUS_M = 6_371_000.0  # turns errors of metres into angles and back; exact to a few parts in a thousand


def acoustic_fixes(data: NavigationData, seed: int, noise_m: float = 2.0, period_s: float = 5.0) -> FloatArray:
    """(F, 3) time, latitude and longitude as an acoustic system would measure them, from the reference.

    Args:
        noise_m: standard deviation of north and of east. period_s: between two fixes.

    Raises:
        ValueError: there is no reference.
    """
    reference = reference_of(data)
    rng = np.random.default_rng(seed)
    time_s = np.arange(reference[0, 0] + period_s * rng.random(), reference[-1, 0], period_s)
    off_rad = noise_m / EARTH_RADIUS_M * rng.standard_normal((len(time_s), 2))
    latitude_rad = np.interp(time_s, reference[:, 0], reference[:, 1])
    longitude_rad = np.interp(time_s, reference[:, 0], np.unwrap(reference[:, 2]))
    return np.column_stack(
        [time_s, latitude_rad + off_rad[:, 0], longitude_rad + off_rad[:, 1] / np.cos(latitude_rad)]
    )


def compass_attitudes(data: NavigationData, seed: int, period_s: float = 0.5) -> FloatArray:
    """(A, 4) time, roll, pitch and yaw as an autopilot with a compass knows them, from the reference: with noise, and
    a heading that is off all the time.

    Raises:
        ValueError: there is no reference.
    """
    reference = reference_of(data)
    rng = np.random.default_rng(seed)
    time_s = np.arange(reference[0, 0] + period_s * rng.random(), reference[-1, 0], period_s)
    true_rad = [np.interp(time_s, reference[:, 0], np.unwrap(reference[:, column])) for column in (7, 8, 9)]
    off_rad = rng.normal(0.0, (LEVEL_ERROR_RAD, LEVEL_ERROR_RAD, COMPASS_NOISE_RAD), (len(time_s), 3))
    off_rad[:, 2] += COMPASS_ERROR_RAD * rng.standard_normal()
    return np.column_stack([time_s, np.array(true_rad).T + off_rad])


def guessed(initial: NavigationState, seed: int) -> NavigationState:
    """An initial state with the errors of an autopilot's."""
    rng = np.random.default_rng(seed)
    attitude_rad = rng.normal(initial.attitude_rad, (LEVEL_ERROR_RAD, LEVEL_ERROR_RAD, HEADING_ERROR_RAD)).tolist()
    velocity_mps = rng.normal(initial.velocity_mps, VELOCITY_ERROR_MPS).tolist()
    return replace(initial, attitude_rad=tuple(attitude_rad), velocity_mps=tuple(velocity_mps))


def reference_of(data: NavigationData) -> FloatArray:
    """(R, 10) of a dive.

    Raises:
        ValueError: there is none.
    """
    if data.reference is None:
        raise ValueError(f"{data.name}: no reference: want one, to know where the vehicle was")
    return data.reference
