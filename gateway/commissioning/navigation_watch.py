"""How far healthy dives reach towards the navigation watch's threshold: what that is set by."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from math import exp
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from detectors.navigation import DepthSample, DvlSample, NavigationConfig, NavigationDetector, NavigationSample
from detectors.navigation.thresholds import ONCE_AN_HOUR, PER_E_FOLD, ratio_threshold
from gateway.commissioning.peaks import BLOCK_S, Tail, block_maxima
from gateway.commissioning.peaks import tail as tail_of
from gateway.config_sections import Navigation
from gateway.sensor_watch import SensorWatch

FloatArray: TypeAlias = NDArray[np.float64]

# where a method's threshold stands in the settings; the default's follows from the rate
THRESHOLDS = {
    "chi_square": "chi_square_threshold",
    "cusum": "cusum_threshold_mps",
    "lstm": "lstm_threshold",
    "ratio": "false_alarms_per_hour",
}
RATE_LEAST, RATE_MOST = 1e-6, 10.0  # of that setting


@dataclass(frozen=True, slots=True, eq=False)
class Watched:
    """One dive.

    Attributes:
        time_s: (N,) of samples of DVL and depth sensor, while sensors were judged.
        share: (N,) the method's statistic, as a share of its threshold.
    """

    time_s: FloatArray
    share: FloatArray

    @property
    def peaks(self) -> FloatArray:
        """(B,) the greatest of each block of time."""
        return block_maxima(self.time_s, self.share)[1]


def watched(
    samples: Iterable[NavigationSample],
    navigation: Navigation,
    settings: NavigationConfig,
) -> Watched:
    """What the watch makes of a dive, without ever leaving a sensor out."""
    watch = SensorWatch(navigation, replace(settings, isolate=False), NavigationDetector)
    rows = []
    for sample in samples:
        verdict = watch.judge(sample).verdict
        if isinstance(sample, DvlSample | DepthSample) and settings.method in verdict.statistics:
            rows.append((sample.time_s, verdict.statistics[settings.method]))
    return Watched(*np.array(rows).reshape(-1, 2).T)


def tail(dives: Sequence[Watched]) -> Tail | None:
    """How often which share of the threshold is reached; None: too short."""
    return tail_of(np.concatenate([*(one.peaks for one in dives), np.empty(0)]))


def scaled(settings: NavigationConfig, share: float) -> float:
    """The setting of the method's threshold that makes it so many times what it is."""
    if settings.method != "ratio":
        return share * float(getattr(settings, THRESHOLDS[settings.method]))
    threshold = share * ratio_threshold(settings.false_alarms_per_hour)
    return min(max(exp((ONCE_AN_HOUR - threshold) / PER_E_FOLD), RATE_LEAST), RATE_MOST)


def blocks_over(dives: Sequence[Watched], share: float) -> int:
    """Blocks of time in which a share of the threshold was exceeded."""
    return sum(int((one.peaks > share).sum()) for one in dives)


def hours(dives: Sequence[Watched]) -> float:
    """That were judged."""
    return sum(len(one.peaks) for one in dives) * BLOCK_S / 3600.0
