"""What kind of fault the signals point at."""

from __future__ import annotations

from math import isfinite

import numpy as np
from numpy.typing import NDArray

from detectors.thruster.model import ThrusterModel
from detectors.thruster.sample import FaultKind

FloatArray = NDArray[np.float64]

STOPPED = -0.9  # relative change of speed from which on a thruster counts as stopped
IMPOSSIBLE = 1.5  # times the top speed
BACKWARDS = 0.2  # of the speed that is wanted, to the other side, from which on a thruster counts as reversed
FROZEN_SAMPLES = 15
FROZEN_MOVE = 0.05  # of the top speed that the commanded speed moved while the sensor did not
CURRENT_ABOVE, CURRENT_BELOW = 1.15, 0.85  # of the current that a healthy propeller takes at this speed
CURRENT_IDLE = 0.1  # of the current at top speed: less is none


def fault_kind(
    model: ThrusterModel, change: float, speed_rpm: FloatArray, command: FloatArray, current_a: FloatArray
) -> FaultKind:
    """Kind of a fault.

    Args:
        model: the healthy thruster.
        change: relative change of speed, negative = slower.
        speed_rpm: (N,) latest measured speeds, the newest last.
        command: (N,) commands as they show in these speeds.
        current_a: (N,) currents, NaN where not measured.
    """
    newest = slice(-3, None)
    wanted_rpm, newest_a = model.speed_rpm(command), float(np.mean(current_a[newest]))
    unloaded = _load(model, abs(float(wanted_rpm[-1])) / model.top_rpm, newest_a) < CURRENT_BELOW
    if _frozen(model, speed_rpm, wanted_rpm) or (_impossible(model, speed_rpm) and not unloaded):
        return FaultKind.SENSOR
    if _reversed(wanted_rpm, speed_rpm[newest]):
        return FaultKind.REVERSED
    if change <= STOPPED:
        return _stopped(model, newest_a)
    if change < 0.0:
        return FaultKind.ENTANGLED
    load = _load(model, float(np.mean(np.abs(speed_rpm[newest]))) / model.top_rpm, newest_a)
    return FaultKind.SENSOR if load > CURRENT_BELOW else FaultKind.PROPELLER_LOST


def _impossible(model: ThrusterModel, speed_rpm: FloatArray) -> bool:
    """Whether no propeller could be turned so fast; a bare shaft can, but takes hardly any current."""
    return float(np.abs(speed_rpm[-1])) > IMPOSSIBLE * model.top_rpm


def _frozen(model: ThrusterModel, speed_rpm: FloatArray, wanted_rpm: FloatArray) -> bool:
    recent, wanted = speed_rpm[-FROZEN_SAMPLES:], wanted_rpm[-FROZEN_SAMPLES:] / model.top_rpm
    frozen = len(recent) == FROZEN_SAMPLES and float(np.ptp(recent)) == 0.0 and recent[-1] != 0.0
    return bool(frozen and float(np.ptp(wanted)) > FROZEN_MOVE)


def _reversed(wanted_rpm: FloatArray, newest_rpm: FloatArray) -> bool:
    """Whether it turns against what it was told for so long that it cannot be coasting any more."""
    steady = float(wanted_rpm.min()) > 0.0 or float(wanted_rpm.max()) < 0.0
    wanted = float(wanted_rpm[-1])
    return steady and bool(np.all(newest_rpm * np.sign(wanted) < -BACKWARDS * abs(wanted)))


def _stopped(model: ThrusterModel, current_a: float) -> FaultKind:
    full = model.current_law[1]
    if not (isfinite(full) and isfinite(current_a)):
        return FaultKind.STOPPED
    return FaultKind.BLOCKED if current_a > model.current_law[0] + CURRENT_IDLE * full else FaultKind.DEAD


def _load(model: ThrusterModel, speed: float, current_a: float) -> float:
    """Current over what a healthy propeller takes at this speed; NaN where not known."""
    idle, full = model.current_law
    healthy = idle + full * speed**3
    return current_a / healthy if healthy > 0.0 else float("nan")
