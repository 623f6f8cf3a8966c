"""What is said of judged samples: level, reason and kind."""

from __future__ import annotations

from math import isfinite

import numpy as np
from numpy.typing import NDArray

from detectors.thruster.assessment import FAST, Assessment, Fault
from detectors.thruster.config import ThrusterConfig
from detectors.thruster.history import COMMAND, CURRENT, SPEED, History
from detectors.thruster.kind import FROZEN_SAMPLES, fault_kind
from detectors.thruster.model import ThrusterModel
from detectors.thruster.sample import FaultKind
from detectors.thruster.tracking import Track
from detectors.verdict import Level

FloatArray = NDArray[np.float64]

KIND = f"U{max(map(len, FaultKind))}"
BLIND = 0.5  # relative change of speed: where the threshold is above, nothing can be said
AT_WORK = 0.15  # of the top speed
CLEAR_SHARE = 0.7  # of the fault's size from which on its kind is judged anew


def levels(
    track: Track, assessment: Assessment, faulty: NDArray[np.bool_], wear: float, config: ThrusterConfig
) -> tuple[NDArray[np.int64], NDArray[np.str_]]:
    """Level of each of N samples, and why: (N,) each.

    Args:
        faulty: (N,) whether a fault lasts.
        wear: drift from the commissioned curve, NaN while unknown.
    """
    drift = np.full(len(faulty), abs(wear) if isfinite(wear) else 0.0)
    blind = (assessment.bound > BLIND) & (np.abs(track.predicted) > AT_WORK)
    rows = (
        (faulty, Level.FAULT, "speed has changed"),
        (drift > config.wear_max, Level.FAULT, "drifted from the commissioned curve"),
        (assessment.score >= 1.0, Level.SUSPECT, "speed is off"),
        (drift > config.wear_suspect, Level.SUSPECT, "drifts from the commissioned curve"),
        (track.unknown, Level.UNKNOWN, "command not learnt yet"),
        (blind, Level.UNKNOWN, "driven too restlessly to judge"),
    )
    which = np.full(len(faulty), len(rows))
    for number in reversed(range(len(rows))):
        which[rows[number][0]] = number
    level = np.array([*(int(row[1]) for row in rows), int(Level.NORMAL)])[which]
    return level, np.array([*(row[2] for row in rows), ""])[which]


def kinds(
    track: Track,
    assessment: Assessment,
    faulty: NDArray[np.bool_],
    fault: Fault | None,
    model: ThrusterModel,
    history: History,
) -> NDArray[np.str_]:
    """(N,) kind of fault in each of the newest samples. It stays unless the fault shows nearly as large as ever."""
    if not faulty.any():
        return np.full(len(faulty), FaultKind.NONE, dtype=KIND)
    kept = FaultKind.NONE if fault is None else fault.kind
    size = np.zeros(len(faulty)) if fault is None else fault.sizes(track)
    clear = np.abs(assessment.change) >= np.maximum(assessment.bound, CLEAR_SHARE * size)
    clear &= np.isfinite(track.gain.newest_deviation[FAST])
    out = []
    for number, (at_fault, sure) in enumerate(zip(faulty, clear, strict=True)):
        stop = history.end - len(faulty) + number + 1
        if at_fault and (sure or not kept) and not (kept is FaultKind.SENSOR and _stands(history, stop)):
            kept = _kind(model, history, stop, float(assessment.change[number]))
        out.append(kept if at_fault else FaultKind.NONE)
    return np.array(out, dtype=KIND)


def with_wear(
    kind: NDArray[np.str_], level: NDArray[np.int64], wear: float, config: ThrusterConfig
) -> NDArray[np.str_]:
    """These kinds, and that of samples without a fast fault."""
    if not (isfinite(wear) and abs(wear) > config.wear_suspect):
        return kind
    return np.where((kind == FaultKind.NONE) & (level >= Level.SUSPECT), FaultKind.WORN, kind).astype(KIND)


def _stands(history: History, stop: int) -> bool:
    """Whether the newest speed before sample number `stop` is to the last bit the one before it."""
    before, now = history.row(SPEED, stop - 2, stop).tolist()
    return bool(before == now)


def _kind(model: ThrusterModel, history: History, stop: int, change: float) -> FaultKind:
    start, delay = stop - FROZEN_SAMPLES, model.response.delay
    return fault_kind(
        model,
        change,
        history.row(SPEED, start, stop),
        history.row(COMMAND, start - delay, stop - delay),
        history.row(CURRENT, start, stop),
    )
