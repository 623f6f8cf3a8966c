"""The commissioned curve, and how far today's has drifted from it.

A model that always adapts follows a slow loss for ever, and would hide it (the paper's method does). So the curve
that was learnt first is kept, and the drift away from it is a finding of its own.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, nan

import numpy as np

from detectors.thruster.model import ThrusterModel

POINTS = 33
SLOWEST = 0.15  # of the top speed: slower parts of the curve are not compared
DOUBT_MAX = 0.02  # relative standard deviation up to which the model is sure of a speed
OVERLAP_MIN = 0.2  # share of the commissioned points that today's model must know


@dataclass(frozen=True, slots=True)
class CommissionedCurve:
    """Steady speed over command of the thruster as it was commissioned.

    Attributes:
        command: commands of the points, in the unit of the samples, increasing.
        speed_rpm: steady speed at each.
        supply_v: supply voltage that it holds for, NaN where not measured.

    Raises:
        ValueError: the two differ in length, are not finite, or the commands do not increase.
    """

    command: tuple[float, ...]
    speed_rpm: tuple[float, ...]
    supply_v: float = nan

    def __post_init__(self) -> None:
        if len(self.command) != len(self.speed_rpm) or not self.command:
            raise ValueError(
                f"{len(self.command)} commands, {len(self.speed_rpm)} speeds: want as many, at least one"
            )
        if not all(map(isfinite, (*self.command, *self.speed_rpm))):
            raise ValueError("commissioned curve holds values that are not finite")
        if any(b <= a for a, b in zip(self.command, self.command[1:], strict=False)):
            raise ValueError("commands of the commissioned curve do not increase")


def commission(model: ThrusterModel, earlier: CommissionedCurve | None = None) -> CommissionedCurve | None:
    """Today's curve as the commissioned one; an earlier one hands its wear on.

    Only what the model is sure of is commissioned; the earlier curve stays if there is nothing.
    """
    command = model.learnt_commands(POINTS)
    healthy = 1.0
    if earlier is not None:
        drift = wear(model, earlier)
        healthy = 1.0 + (drift if isfinite(drift) else 0.0)
    sure = model.doubt(command) < DOUBT_MAX
    if not sure.any():
        return earlier
    command = command[sure]
    speed_rpm = model.speed_rpm(command) / healthy
    return CommissionedCurve(tuple(command.tolist()), tuple(speed_rpm.tolist()), model.supply_v)


def wider(model: ThrusterModel, curve: CommissionedCurve) -> bool:
    """Whether the model knows clearly more of the commands than the curve does."""
    spans = [max(high - low, 0.0) for low, high in (model.learnt_ahead, model.learnt_astern)]
    known = np.array(curve.command) - model.basis.neutral
    had = [float(np.ptp(side)) if len(side) else 0.0 for side in (known[known > 0], known[known < 0])]
    return sum(spans) > 1.1 * sum(had)


def wear(model: ThrusterModel, curve: CommissionedCurve) -> float:
    """Relative drift of today's curve from the commissioned one, negative = slower; NaN where too little overlaps."""
    command, was = np.array(curve.command), np.array(curve.speed_rpm)
    shared = model.knows(command) & (np.abs(was) > SLOWEST * np.abs(was).max())
    shared &= model.doubt(command) < DOUBT_MAX
    if np.count_nonzero(shared) < OVERLAP_MIN * len(command):
        return nan
    supply = curve.supply_v / model.supply_v - 1.0 if isfinite(curve.supply_v) and isfinite(model.supply_v) else 0.0
    now = model.speed_rpm(command[shared]) * (1.0 + model.supply_exponent * supply)
    return float(np.median(now / was[shared] - 1.0))
