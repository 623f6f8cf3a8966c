"""Innovations made by hand."""

from __future__ import annotations

import numpy as np

from detectors.navigation.innovation import Innovation, Measurement
from detectors.navigation.installation import ALL_STATES
from detectors.navigation.sample import DepthSample, DvlSample, FixSample

NOISE_MPS, NOISE_M = 0.02, 0.05


def dvl_innovation(time_s: float, values: object, *, said: object = None, noise_mps: float = NOISE_MPS) -> Innovation:
    """Of a DVL that says this (by default what it errs by), the filter knowing all but the DVL's noise."""
    x, y, z = np.broadcast_to(np.array(values if said is None else said, dtype=float), 3).tolist()
    return innovation(DvlSample(time_s, (x, y, z)), np.broadcast_to(np.array(values, dtype=float), 3), noise_mps)


def depth_innovation(time_s: float, value: float, *, noise_m: float = NOISE_M) -> Innovation:
    return innovation(DepthSample(time_s, 20.0 + value), np.array([value]), noise_m)


def fix_innovation(time_s: float) -> Innovation:
    return innovation(FixSample(time_s, 0.5, 0.5), np.zeros(2), 3.0)


def innovation(measurement: Measurement, values: np.ndarray, noise: float) -> Innovation:
    """Nothing is corrected by it, and nothing has passed since the one before."""
    size = len(values)
    return Innovation(
        measurement=measurement,
        values=values,
        covariance=noise**2 * np.eye(size),
        observation=np.zeros((size, ALL_STATES)),
        transition=np.eye(ALL_STATES),
        process=np.zeros((ALL_STATES, ALL_STATES)),
        gain=None,
        noise=noise**2 * np.eye(size),
    )
