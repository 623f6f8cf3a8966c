"""Whether a learnt speed may be trusted, and whether it is normal (paper 002, equation 14 and Algorithm 2)."""

from __future__ import annotations

from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from detectors.speed.flow import FlowModel
from detectors.speed.learnt_flow import LearntFlow
from detectors.verdict import Level

FloatArray = NDArray[np.float64]


class Flag(IntEnum):
    """Paper 002, Algorithm 2."""

    NO_ANOMALY = 0
    ANOMALY = 1
    FALSE_ALARM = 2  # the learnt flow is far from the foreseen one: the learnt speed is not to be trusted


LEVELS = {Flag.NO_ANOMALY: Level.NORMAL, Flag.ANOMALY: Level.FAULT, Flag.FALSE_ALARM: Level.UNKNOWN}


class FlowComparison:
    """p_E of paper 002, equation 14, with its running maxima; picklable."""

    def __init__(self) -> None:
        self._greatest_mps = 0.0

    def error(self, learnt_mps: FloatArray, foreseen_mps: FloatArray) -> float:
        """p_E of the next instant: 0 where both agree, 1 where they are as far apart as can be.

        Args:
            learnt_mps, foreseen_mps: (D,) F_L and F_M.
        """
        norms = (float(np.linalg.norm(flow)) for flow in (learnt_mps, foreseen_mps))
        self._greatest_mps = max(self._greatest_mps, *norms)
        apart = float(np.linalg.norm(foreseen_mps - learnt_mps))
        # no flow at all, ever, is no difference
        return apart / (2.0 * self._greatest_mps) if self._greatest_mps > 0.0 else 0.0


class ForeseenFlow:
    """F_M: an outside model where it says something, else the flow that was learnt while the speed was normal.

    Of the latter the parameters are those of the latest normal instant, place and time those of now. Picklable.

    Args:
        model: the outside model.
    """

    def __init__(self, model: FlowModel | None = None) -> None:
        self._model = model
        self._normal: LearntFlow | None = None

    def velocity_mps(self, learnt: LearntFlow, normal: bool, time_s: float, position_m: FloatArray) -> FloatArray:
        """(D,) F_M at a place and time.

        Args:
            learnt: the flow as learnt up to now.
            normal: whether the learnt speed is in its normal range now.
        """
        if normal or self._normal is None:
            self._normal = learnt.frozen()
        foreseen = self._normal.velocity_mps(time_s, position_m)
        if self._model is None:
            return foreseen
        said = self._model.velocity_mps(time_s, position_m)
        return said if np.isfinite(said).all() else foreseen


def flag(flow_error: float, flow_error_max: float, normal: bool) -> Flag:
    """Paper 002, Algorithm 2, lines 4 to 10.

    Args:
        flow_error: p_E.
        flow_error_max: gamma_f.
        normal: whether the learnt speed is in its normal range.
    """
    if flow_error > flow_error_max:
        return Flag.FALSE_ALARM
    return Flag.NO_ANOMALY if normal else Flag.ANOMALY
