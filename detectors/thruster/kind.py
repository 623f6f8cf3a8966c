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
    if _sensor(model, speed_rpm, command):
        return FaultKind.SENSOR
    speed = float(np.mean(np.abs(speed_rpm[newest]))) / model.top_rpm
    if change <= STOPPED:
        return _stopped(model, float(np.mean(current_a[newest])))
    load = _load(model, speed, float(np.mean(current_a[newest])))
    if change < 0.0:
        return FaultKind.ENTANGLED
    return FaultKind.SENSOR if load > CURRENT_BELOW else FaultKind.PROPELLER_LOST


def _sensor(model: ThrusterModel, speed_rpm: FloatArray, command: FloatArray) -> bool:
    if float(np.abs(speed_rpm[-1])) > IMPOSSIBLE * model.top_rpm:
        return True
    recent, wanted = speed_rpm[-FROZEN_SAMPLES:], model.speed_rpm(command[-FROZEN_SAMPLES:]) / model.top_rpm
    frozen = len(recent) == FROZEN_SAMPLES and float(np.ptp(recent)) == 0.0 and recent[-1] != 0.0
    return bool(frozen and float(np.ptp(wanted)) > FROZEN_MOVE)


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
