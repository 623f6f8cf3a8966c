"""How far a healthy vehicle's speed, as the speed watch sees it, is off the curve: what its tolerance is set by."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import ceil, hypot
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from detectors.speed import PoseSample, SpeedConfig, SpeedCurve, SpeedDetector
from detectors.speed.evidence import FAST, MODEL_ERROR, NOTHING_AT
from detectors.verdict import Level
from gateway.commissioning.peaks import Tail, block_maxima
from gateway.commissioning.peaks import tail as tail_of

FloatArray: TypeAlias = NDArray[np.float64]

TOLERANCE_MIN, TOLERANCE_MAX = 0.1, 0.6
WIDE = 0.95  # a tolerance at which nothing is found
SUSTAINED = 4  # estimates in a row, one a second: fewer are no fault yet


@dataclass(frozen=True, slots=True, eq=False)
class Normal:
    """What is normal: a curve over the command, or one speed where no command is known.

    Attributes:
        speed: SpeedCurve, or m/s.
        surge_time_s: with which the speed follows the command.
    """

    speed: SpeedCurve | float
    surge_time_s: float

    def settings(self, config: SpeedConfig, tolerance: float) -> SpeedConfig:
        """Of a detector that knows this, with all else as configured."""
        estimator = "interacting" if config.estimator == "published" else config.estimator
        base = replace(
            config,
            estimator=estimator,
            tolerance=tolerance,
            surge_time_s=self.surge_time_s,
            range_command=None,
            speed_curve=None,
            speed_min_mps=None,
            speed_max_mps=None,
        )
        if isinstance(self.speed, SpeedCurve):
            return replace(base, speed_curve=self.speed)
        low_mps, high_mps = (1.0 - tolerance) * self.speed, (1.0 + tolerance) * self.speed
        return replace(base, speed_min_mps=low_mps, speed_max_mps=high_mps)


@dataclass(frozen=True, slots=True, eq=False)
class Watched:
    """What the watch saw of one dive, once a second where it knew something.

    Attributes:
        time_s: (N,)
        command: (N,) NaN: not known.
        speed_mps: (N,)
        ratio, error: (N,) speed and its standard deviation, as shares of the normal speed.
    """

    time_s: FloatArray
    command: FloatArray
    speed_mps: FloatArray
    ratio: FloatArray
    error: FloatArray

    @property
    def needed(self) -> FloatArray:
        """(N,) the tolerance at which the watch would not have held anything against the vehicle; below 0: any."""
        spread = np.hypot(self.error, MODEL_ERROR)
        slow = 1.0 - self.ratio - NOTHING_AT * spread
        fast = self.ratio - 1.0 - NOTHING_AT * FAST * spread
        off = np.maximum(slow, fast)
        doubtful = (spread > TOLERANCE_MIN) & (off < spread)  # no range that fits into the doubt is judged by
        off[doubtful] = np.minimum(off[doubtful], 0.0)
        before = np.pad(off, (SUSTAINED - 1, 0), mode="edge") if len(off) else np.zeros(SUSTAINED)
        return np.asarray(np.lib.stride_tricks.sliding_window_view(before, SUSTAINED).min(axis=1)[: len(off)])


def watched(samples: Sequence[PoseSample], normal: Normal, config: SpeedConfig) -> Watched:
    """What the detector makes of a dive, given what is normal."""
    detector = SpeedDetector(normal.settings(config, WIDE))
    rows, newest_s = [], -np.inf
    for sample in samples:
        verdict = detector.update(sample)
        usual_mps = verdict.speed_max_mps / (1.0 + WIDE)
        if verdict.reason or not np.isfinite(usual_mps) or usual_mps == 0.0 or sample.time_s - newest_s < 1.0:
            continue
        newest_s = sample.time_s
        command = np.nan if sample.command is None else sample.command
        ratio, error = verdict.speed_mps / usual_mps, verdict.speed_error_mps / abs(usual_mps)
        rows.append((sample.time_s, command, verdict.speed_mps, ratio, error))
    return Watched(*np.array(rows, dtype=np.float64).reshape(-1, 5).T)


def tail(courses: Sequence[Watched]) -> Tail | None:
    """How often which tolerance, plus 1, is needed; None: too few seconds that the watch could judge.

    Plus 1, for a vehicle that keeps its speed well needs less than none, and only what is above 0 is a peak.
    """
    return tail_of(np.concatenate([*(block_maxima(one.time_s, 1.0 + one.needed)[1] for one in courses), np.empty(0)]))


def judged_hours(courses: Sequence[Watched]) -> float:
    """In which the watch knew something."""
    return sum(len(course.time_s) for course in courses) / 3600.0


def tolerance_for(law: Tail, false_alarms_per_hour: float, curve_error: float) -> float:
    """The tolerance that is needed so often, in hundredths, within sensible bounds.

    Args:
        law: of what healthy dives needed.
        false_alarms_per_hour: that are wanted.
        curve_error: standard deviation of the normal speed, as a share of it: the next dive shows it as an offset.
    """
    fitted = law.threshold(false_alarms_per_hour)
    doubt = hypot(law.sure_threshold(false_alarms_per_hour) - fitted, curve_error)
    wanted = ceil(100.0 * (fitted - 1.0 + doubt) - 1e-9) / 100.0
    return min(max(wanted, TOLERANCE_MIN), TOLERANCE_MAX)


def false_alarms(samples: Sequence[PoseSample], normal: Normal, config: SpeedConfig, tolerance: float) -> int:
    """FAULTs of the real detector that begin in a healthy dive."""
    detector = SpeedDetector(normal.settings(config, tolerance))
    faulty = [detector.update(sample).level is Level.FAULT for sample in samples]
    return sum(now and not before for before, now in zip([False, *faulty], faulty, strict=False))
