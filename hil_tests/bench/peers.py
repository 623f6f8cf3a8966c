"""General change and anomaly detectors, on the same runs: river's and PyOD's.

Each sees the scaled residual of a simple model of the thruster (`residual`), has its library's default settings but
for the threshold, and is calibrated on the first 800 samples, which are known to be healthy; alarms count after them.

- PageHinkley, ADWIN (river, on the residual): the threshold, or the confidence, is made more demanding step by step,
  by factors of 1.5 and 10 from the default, until the calibration passes without an alarm, and then once more by
  `MARGINS`.
- HalfSpaceTrees (river, on residual and its short mean, scaled into the unit square): scores each sample, then learns
  it, to the end. IForest and ECOD (PyOD, on the same two features): fitted to the calibration. An alarm is a score
  above the greatest of the calibration twice in a row, by the margin of `MARGINS`.

Of the margins tried on 24 other runs, each has the one with which most losses of 7 % were found, at any time but
without an earlier alarm, less the healthy runs with an alarm. Except IForest, whose scores hardly rise above those of
its calibration: from 1.15 on it finds nothing any more, hence 1.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from itertools import accumulate, repeat
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from hil_tests.bench.residual import CALIBRATION, features, scaled_residual
from hil_tests.random_runs import RandomRun

FloatArray = NDArray[np.float64]

MARGINS = {"PageHinkley": 32.0, "ADWIN": 1e160, "HalfSpaceTrees": 1.3, "IForest": 1.0, "ECOD": 5.0}
CONFIRM = 2  # successive scores above the threshold
STEPS = 40  # of the search for a threshold
FULL_SCALE = 20.0  # scaled residual at which the features of HalfSpaceTrees reach the border of the unit square
SETTLED = 250  # samples until HalfSpaceTrees have a first window of masses, and scores mean something


class _ChangeDetector(Protocol):
    """What river's change detectors share."""

    @property
    def drift_detected(self) -> bool: ...

    def update(self, x: float) -> object: ...


def page_hinkley(run: RandomRun, margin: float = MARGINS["PageHinkley"]) -> int | None:
    """First alarm of river's PageHinkley, None for none."""
    from river.drift import PageHinkley

    default = PageHinkley().threshold
    thresholds = accumulate(repeat(1.5, STEPS), lambda threshold, factor: threshold * factor, initial=default)
    return _calibrated(run, lambda threshold: PageHinkley(threshold=threshold), thresholds, margin)


def adwin(run: RandomRun, margin: float = MARGINS["ADWIN"]) -> int | None:
    """First alarm of river's ADWIN, None for none."""
    from river import drift

    make: Any = drift.ADWIN  # has no annotations
    default: float = make().delta
    deltas = accumulate(repeat(0.1, STEPS), lambda delta, factor: delta * factor, initial=default)
    return _calibrated(run, lambda delta: make(delta=delta), deltas, 1.0 / margin)


def _calibrated(
    run: RandomRun, make: Callable[[float], _ChangeDetector], settings: Iterable[float], margin: float
) -> int | None:
    """First alarm after the calibration, with the first of the settings that is silent there, times the margin."""
    residual = scaled_residual(run).tolist()
    for setting in settings:
        if _first_alarm(make(setting), residual[:CALIBRATION]) is None:
            return _first_alarm(make(setting * margin), residual)
    return None


def _first_alarm(detector: _ChangeDetector, residual: list[float]) -> int | None:
    for sample, value in enumerate(residual):
        detector.update(value)
        if detector.drift_detected:
            return sample
    return None


def half_space_trees(run: RandomRun, margin: float = MARGINS["HalfSpaceTrees"]) -> int | None:
    """First alarm of river's HalfSpaceTrees, None for none."""
    from river.anomaly import HalfSpaceTrees

    trees: Any = HalfSpaceTrees(seed=run.seed)  # has no annotations
    scores = []
    for row in np.clip(0.5 + 0.5 * features(scaled_residual(run)) / FULL_SCALE, 0.0, 1.0).tolist():
        point = {"residual": row[0], "mean": row[1]}
        scores.append(trees.score_one(point))
        trees.learn_one(point)
    return _above_calibration(np.array(scores), SETTLED, margin)


def isolation_forest(run: RandomRun, margin: float = MARGINS["IForest"]) -> int | None:
    """First alarm of PyOD's isolation forest, None for none."""
    from pyod.models.iforest import IForest

    points = features(scaled_residual(run))
    model = IForest(random_state=run.seed).fit(points[:CALIBRATION])
    return _above_calibration(model.decision_function(points), 0, margin)


def ecod(run: RandomRun, margin: float = MARGINS["ECOD"]) -> int | None:
    """First alarm of PyOD's ECOD, None for none."""
    from pyod.models.ecod import ECOD

    points = features(scaled_residual(run))
    model = ECOD().fit(points[:CALIBRATION])
    return _above_calibration(model.decision_function(points), 0, margin)


def _above_calibration(scores: FloatArray, settled: int, margin: float) -> int | None:
    """First sample after the calibration whose score is above its greatest for the second time in a row.

    Scores may be negative: the margin is in spreads, from median to greatest.
    """
    usual, greatest = np.median(scores[settled:CALIBRATION]), scores[settled:CALIBRATION].max()
    above = scores > usual + margin * (greatest - usual)
    above[:CALIBRATION] = False
    twice = np.flatnonzero(above[CONFIRM - 1 :] & above[: 1 - CONFIRM])
    return int(twice[0]) + CONFIRM - 1 if len(twice) else None
