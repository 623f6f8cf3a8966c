"""The steady curve of a thruster from several stretches of recordings, with how far they agree.

Each stretch gives a model of its own. At each command the speeds of all stretches that know it are averaged, weighted
by their certainty. Where they differ by more than that explains, the uncertainty grows by as much (Birge ratio).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from detectors.thruster.model import ThrusterModel
from detectors.thruster.wear import CommissionedCurve

FloatArray: TypeAlias = NDArray[np.float64]

POINTS = 25  # of each direction
SURE = 0.05  # relative standard deviation up to which a stretch has a say at a command
SLOW = 0.15  # of the top speed: slower parts do not count in comparisons
SUPPLY_MOST = 1.2  # relative change of speed over that of the supply: an idling motor has 1
COMMISSIONED = 0.02  # relative standard deviation up to which the curve is a reference for wear


@dataclass(frozen=True, slots=True)
class SteadyCurve:
    """Steady speed over command.

    Attributes:
        command: (N,) increasing.
        speed_rpm, error_rpm: (N,) at each, and the standard deviation.
        supply_v: supply voltage that it holds for, NaN where not measured.
        supply_exponent: relative change of speed over relative change of that.
    """

    command: FloatArray
    speed_rpm: FloatArray
    error_rpm: FloatArray
    supply_v: float
    supply_exponent: float

    def commissioned(self) -> CommissionedCurve | None:
        """What wear is measured against from now on; None where nothing is known well enough."""
        sure = (self.error_rpm <= COMMISSIONED * np.abs(self.speed_rpm)) & self._fast()
        if not sure.any():
            return None
        return CommissionedCurve(
            tuple(self.command[sure].tolist()), tuple(self.speed_rpm[sure].tolist()), self.supply_v
        )

    def relative_error(self) -> float:
        """Median of the relative standard deviation, where the thruster is not slow."""
        fast = self._fast()
        return float(np.median(self.error_rpm[fast] / np.abs(self.speed_rpm[fast])))

    def gain_of(self, model: ThrusterModel) -> float:
        """Relative speed of a stretch's model against this, 0.0 where equal; NaN where they share nothing."""
        shared = self._fast() & model.knows(self.command)
        if not shared.any():
            return float("nan")
        return float(np.median(at_supply(model, self.command[shared], self.supply_v) / self.speed_rpm[shared] - 1.0))

    def _fast(self) -> NDArray[np.bool_]:
        return np.asarray(np.abs(self.speed_rpm) > SLOW * np.abs(self.speed_rpm).max())


def steady_curve(models: Sequence[ThrusterModel]) -> SteadyCurve | None:
    """The curve that models of one thruster agree on; None where there is none, or none is sure of anything."""
    if not models:
        return None
    command, supply_v = _points(models), _supply_v(models)
    speeds = np.stack([at_supply(model, command, supply_v) for model in models])
    doubts = np.stack([model.doubt(command) for model in models])
    knowing = np.stack([model.knows(command) for model in models]) & (doubts < SURE) & (speeds != 0.0)
    known = knowing.any(axis=0)
    if not known.any():
        return None
    deviations = np.where(knowing, np.where(knowing, doubts, 0.0) * np.abs(speeds), np.inf)[:, known]
    mean, error = _weighted_mean(speeds[:, known], deviations)
    exponent = float(np.median([plausible_exponent(model) for model in models]))
    return SteadyCurve(command[known], mean, error, supply_v, exponent)


def at_supply(model: ThrusterModel, command: FloatArray, supply_v: float) -> FloatArray:
    """(N,) steady speeds of a model at another supply voltage than its own, where both are known."""
    change = supply_v / model.supply_v - 1.0
    return np.asarray(model.speed_rpm(command) * (1.0 + plausible_exponent(model) * np.nan_to_num(change)))


def plausible_exponent(model: ThrusterModel) -> float:
    """How the speed of a model goes with the supply: a stretch of an even voltage may say anything."""
    return float(np.clip(model.supply_exponent, 0.0, SUPPLY_MOST))


def _supply_v(models: Sequence[ThrusterModel]) -> float:
    measured = [model.supply_v for model in models if np.isfinite(model.supply_v)]
    return float(np.median(measured)) if measured else float("nan")


def _points(models: Sequence[ThrusterModel]) -> FloatArray:
    """Commands across all that was learnt."""
    ahead = max(model.learnt_ahead[1] for model in models)
    astern = max(model.learnt_astern[1] for model in models)
    sides = [np.linspace(reach / POINTS, reach, POINTS) if reach > 0.0 else np.empty(0) for reach in (astern, ahead)]
    return np.concatenate([-sides[0][::-1], sides[1]])


def _weighted_mean(values: FloatArray, deviations: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(N,) mean of (M, N) values, and its standard deviation; infinite deviations count for nothing."""
    weight = deviations**-2.0
    total = weight.sum(axis=0)
    mean = (weight * values).sum(axis=0) / total
    count = np.isfinite(deviations).sum(axis=0)
    scatter = (weight * (values - mean) ** 2).sum(axis=0) / np.maximum(count - 1, 1)
    return mean, np.sqrt(np.maximum(scatter, 1.0) / total)
