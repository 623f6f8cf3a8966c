"""What a detector has learnt of its thruster, to be looked at."""

from __future__ import annotations

from dataclasses import dataclass
from math import nan

import numpy as np
from numpy.typing import NDArray

from detectors.thruster.model import ThrusterModel
from detectors.thruster.modelling import OnlineModel

FloatArray = NDArray[np.float64]

POINTS = 33  # of each direction


@dataclass(frozen=True, slots=True, eq=False)
class LearntCurve:
    """Steady speed over command, at the commands that were learnt.

    Attributes:
        command: (N,) increasing, in the unit of the samples.
        speed_rpm: (N,) steady speed at each.
        deviation_rpm: (N,) standard deviation of the curve there.
        supply_v: supply voltage that it holds for, NaN where not measured.
    """

    command: FloatArray
    speed_rpm: FloatArray
    deviation_rpm: FloatArray
    supply_v: float


def curve_of_model(model: ThrusterModel) -> LearntCurve:
    """Of the default method's model."""
    command = model.learnt_commands(POINTS)
    return LearntCurve(command, model.speed_rpm(command), model.deviation_rpm(command), model.supply_v)


def curve_of_polynomial(model: OnlineModel) -> LearntCurve:
    """Of the paper's model."""
    curve = model.curve
    command = curve.range.centre + curve.range.half_range * np.linspace(-1.0, 1.0, POINTS)
    leverage = np.array([curve.leverage(one) for one in command.tolist()])
    return LearntCurve(command, curve.predict(command), curve.noise_rpm * np.sqrt(leverage), nan)
