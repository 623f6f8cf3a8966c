"""Runs the navigation filter over healthy dives, to learn what its innovations look like."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from detectors.navigation import ImuSample, NavigationConfig, NavigationSample, NavigationState
from detectors.navigation.alignment import Alignment
from detectors.navigation.integration import IntegratedFilter
from detectors.navigation.published import Residual, Residuals
from gateway.navigation_data import NavigationData
from gateway.training.records import InnovationRecord


def innovations(dive: NavigationData, config: NavigationConfig | None = None) -> InnovationRecord:
    """The innovations of a dive in which all sensors were well.

    Args:
        dive: it begins where its reference says, or, without one, once its first seconds have aligned the filter.
        config: settings of the filter; None: the defaults.

    Raises:
        ValueError: nothing to be learnt from: too short, or no IMU samples between those of the DVL.
    """
    config = NavigationConfig() if config is None else config
    samples = dive.samples()
    initial = dive.initial if dive.reference is not None else _aligned(dive.name, samples, config)
    times, residuals = [], []
    for time_s, residual in _residuals(IntegratedFilter(config, initial), samples):
        if residual.features is not None:
            times.append(time_s)
            residuals.append((residual.features, residual.values, np.diag(residual.covariance)))
    if not times:
        raise ValueError(f"{dive.name}: no sample of the DVL with samples of the IMU before it: want some")
    features, values, variances = (np.array(column) for column in zip(*residuals, strict=True))
    return InnovationRecord(dive.name, np.array(times), features, values, variances)


def _residuals(filter_: IntegratedFilter, samples: Iterator[NavigationSample]) -> Iterator[tuple[float, Residual]]:
    residuals = Residuals()
    for sample in samples:
        if not isinstance(sample, ImuSample):
            filter_.measure(sample)
            continue
        for innovation in filter_.advance(sample):
            if (residual := residuals.take(innovation)) is not None:
                yield innovation.time_s, residual


def _aligned(name: str, samples: Iterator[NavigationSample], config: NavigationConfig) -> NavigationState:
    """Takes as many samples as it needs."""
    alignment = Alignment(config)
    for sample in samples:
        if (state := alignment.update(sample)) is not None:
            return state
    raise ValueError(f"{name}: no reference, and cannot be aligned ({alignment.reason}): want a longer recording")
