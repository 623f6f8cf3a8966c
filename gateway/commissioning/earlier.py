"""What an earlier run knew of a thruster: where it is another one now, the logs may be of another vehicle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from detectors.thruster.wear import CommissionedCurve
from gateway import state
from gateway.commissioning.steady_curve import SteadyCurve
from gateway.commissioning.thruster import LearntThruster

DIFFERS = 0.1  # by which wear and supply may change the speed at a command


def earlier_curves(path: Path) -> dict[str, CommissionedCurve]:
    """Commissioned curves by subject, of a state file; of one that is not there, or cannot be used, none."""
    try:
        found = state.load(path)
    except (OSError, state.StateError):
        return {}
    learnt = {} if found is None else found.learnt
    curves = {subject: getattr(one.detector, "commissioned", None) for subject, one in learnt.items()}
    return {subject: curve for subject, curve in curves.items() if isinstance(curve, CommissionedCurve)}


def compared(thrusters: Sequence[LearntThruster], path: Path) -> list[LearntThruster]:
    """The thrusters, with a remark where they are others than the state of earlier runs knows them."""
    curves = earlier_curves(path)
    return [_compared(one, curves.get(one.part.subject)) for one in thrusters]


def _compared(thruster: LearntThruster, curve: CommissionedCurve | None) -> LearntThruster:
    if curve is None or thruster.response is None:
        return thruster
    change = change_since(curve, thruster.response.curve)
    if not abs(change) > DIFFERS:
        return thruster
    remark = (
        f"it is {abs(change):.0%} {'faster' if change > 0.0 else 'slower'} at the same command than the state of"
        " earlier runs knows it: are the logs of this vehicle, and is its propeller another one, or worn?"
    )
    return replace(thruster, part=replace(thruster.part, remarks=(*thruster.part.remarks, remark)))


def change_since(before: CommissionedCurve, now: SteadyCurve) -> float:
    """Relative change of the speed, as the median over all commands that both know; NaN where there is none."""
    shared = (now.command >= before.command[0]) & (now.command <= before.command[-1])
    was = np.interp(now.command[shared], before.command, before.speed_rpm)
    fast = np.abs(was) > 0.15 * np.max(np.abs(before.speed_rpm))
    return float(np.median(now.speed_rpm[shared][fast] / was[fast] - 1.0)) if fast.any() else float("nan")
