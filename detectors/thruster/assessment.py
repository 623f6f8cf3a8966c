"""Samples against their thresholds: does a fault begin, does it last, is it over?"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from detectors.thruster.config import ThrusterConfig
from detectors.thruster.evidence import CHANGE_MIN, DEVIATIONS, HEADROOM
from detectors.thruster.model import ThrusterModel
from detectors.thruster.sample import FaultKind
from detectors.thruster.tracking import SPEED_MIN, Track

FloatArray = NDArray[np.float64]

CONFIRM = 2  # successive samples over the threshold that are a fault
RECOVER = 50  # successive samples back at the old gain that end a fault
RECOVER_SHARE = 0.35  # of the fault's size within which a gain counts as the old one
FAST, SLOW = 1, 3  # scales (8 and 50 samples) that judge whether a fault is still there; the first one is shown


@dataclass(frozen=True, slots=True, eq=False)
class Assessment:
    """N samples against the thresholds.

    Attributes:
        score: (N,) change over threshold on the scale that says most.
        change: (N,) relative change of speed on that scale.
        reference: (N,) gain error that counts as healthy.
        bound: (N,) threshold of the change on the scale that is shown.
        event: first sample at which a fault begins or ends, None for none.
    """

    score: FloatArray
    change: FloatArray
    reference: FloatArray
    bound: FloatArray
    event: int | None


@dataclass(frozen=True, slots=True, eq=False)
class Fault:
    """A fault that lasts: the healthy gain that it is measured against, and its size so far.

    Attributes:
        since: number of the first sample that may belong to it.
        reference: healthy mean gain error.
        bound: (5,) threshold on each scale when it was found.
        size: largest change seen on the slow scale.
        kind: what it was called last.
        recovered: successive samples back at the old gain.
    """

    since: int
    reference: float
    bound: FloatArray
    size: float = 0.0
    kind: FaultKind = FaultKind.NONE
    recovered: int = 0

    def sizes(self, track: Track) -> FloatArray:
        """(N,) largest change of gain since the fault began, on the slow scale."""
        slow = np.abs(track.gain.newest[SLOW] - self.reference)
        return np.asarray(np.maximum(np.maximum.accumulate(slow), self.size))

    def is_back(self, track: Track) -> NDArray[np.bool_]:
        """(N,) whether the gain is surely nearer to the healthy one than to the fault's."""
        newest, doubt = track.gain.newest - self.reference, track.gain.newest_deviation
        near = np.maximum(0.5 * self.bound[SLOW], RECOVER_SHARE * self.sizes(track))
        back = np.abs(newest[SLOW]) + doubt[SLOW] < near
        back &= np.abs(newest[FAST]) < np.maximum(self.bound[FAST], near)
        return np.asarray(back & ~track.unknown)

    def after(self, track: Track, kind: FaultKind) -> Fault:
        """The fault after these samples."""
        recovered = run_length(self.is_back(track), self.recovered)
        return replace(self, size=float(self.sizes(track)[-1]), kind=kind, recovered=recovered)


def thresholds(track: Track, model: ThrusterModel, config: ThrusterConfig, largest: FloatArray) -> FloatArray:
    """(5, N) relative change of speed that is a fault, on each scale.

    Where none is fixed, it is as many standard deviations as are rare, and more where healthy samples came near that.

    Args:
        largest: (5,) statistic that healthy samples reached on each scale.
    """
    gain = track.gain
    speed = np.maximum(np.abs(track.predicted), SPEED_MIN) * model.top_rpm
    if config.threshold_rpm is not None:
        return np.broadcast_to(config.threshold_rpm / speed, gain.change.shape)
    deviations = np.maximum(config.caution * DEVIATIONS, HEADROOM * largest)[:, None]
    least = np.maximum(config.caution * CHANGE_MIN[:, None], model.resolution_rpm / speed)
    return np.asarray(np.maximum(least, deviations * gain.deviation))


def watch(track: Track, bound: FloatArray, scales: slice, over: int) -> Assessment:
    """No fault yet: one begins when the score stays over 1.

    Args:
        bound: (5, N) of `thresholds`.
        scales: those that count.
        over: successive samples over the threshold so far.
    """
    change = track.gain.change[scales]
    ratio = np.abs(change) / bound[scales]
    score, most = ratio.max(axis=0), ratio.argmax(axis=0)
    event = first_run(score >= 1.0, CONFIRM, over)
    worst = np.take_along_axis(change, most[None, :], axis=0)[0]
    return Assessment(score, worst, track.gain.reference[FAST], bound[FAST], event)


def follow(track: Track, fault: Fault) -> Assessment:
    """A fault lasts until the gain has been back for a while."""
    fast, slow = (track.gain.newest[scale] - fault.reference for scale in (FAST, SLOW))
    score = np.maximum(np.abs(fast) / fault.bound[FAST], np.abs(slow) / fault.bound[SLOW])
    event = first_run(fault.is_back(track), RECOVER, fault.recovered)
    samples = len(score)
    return Assessment(score, fast, np.full(samples, fault.reference), np.full(samples, fault.bound[FAST]), event)


def first_run(condition: NDArray[np.bool_], length: int, so_far: int) -> int | None:
    """First index at which the condition has held `length` times in a row, `so_far` of them before the first."""
    if not condition.any():
        return None
    for index, holds in enumerate(condition.tolist()):
        so_far = so_far + 1 if holds else 0
        if so_far >= length:
            return index
    return None


def run_length(condition: NDArray[np.bool_], so_far: int) -> int:
    """How many of the newest have held in a row, `so_far` before the first."""
    broken = np.flatnonzero(~condition)
    return len(condition) - 1 - int(broken[-1]) if len(broken) else so_far + len(condition)
