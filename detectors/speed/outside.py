"""The flow that is known from elsewhere, and the one that was learnt while the speed was normal (paper 002, F_M)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from detectors.speed.anomaly import FlowComparison, ForeseenFlow
from detectors.speed.config import SpeedConfig
from detectors.speed.learnt_flow import LearntFlow

FloatArray = NDArray[np.float64]

CONTRADICTED = 2.5  # standard deviations of a model's error


class OutsideFlow:
    """The outside model of the settings, if there is one. Picklable.

    The interacting filters learn only how far the water differs from the model, the other estimators the whole flow.

    Args:
        config: settings.
    """

    def __init__(self, config: SpeedConfig) -> None:
        self._model = config.flow_model
        self._taken_off = config.estimator == "interacting"
        self._still = np.zeros(config.dimensions)
        self._error_mps = config.flow_model_error_mps
        self._normal_mps: FloatArray | None = None
        self._foreseen = ForeseenFlow(config.flow_model)
        self._comparison = FlowComparison()

    def said_mps(self, time_s: float, position_m: FloatArray, down_m: float) -> FloatArray | None:
        """(D,) what the model says at a (D,) position and a depth; None where it says nothing."""
        if self._model is None:
            return None
        said = self._model.velocity_mps(time_s, np.array((position_m[0], position_m[1], down_m)))
        if not np.isfinite(said).all():
            return None
        flow_mps = self._still.copy()
        count = min(len(said), len(flow_mps))
        flow_mps[:count] = said[:count]
        return flow_mps

    def taken_off_mps(self, time_s: float, position_m: FloatArray, down_m: float) -> FloatArray:
        """(D,) the part of the flow that the estimator need not learn."""
        if not self._taken_off:
            return self._still
        said = self.said_mps(time_s, position_m, down_m)
        return self._still if said is None else said

    def contradicted(self, learnt_mps: FloatArray, said_mps: FloatArray | None) -> bool:
        """Whether the learnt flow is farther from the model than the model's error allows."""
        if said_mps is None or not self._taken_off:
            return False
        return float(np.abs(learnt_mps - said_mps).max()) > CONTRADICTED * self._error_mps

    def error(self, learnt_mps: FloatArray, said_mps: FloatArray | None, normal: bool) -> float:
        """p_E of paper 002, equation 14: how far the learnt flow is from the foreseen one, 0 to 1.

        Args:
            learnt_mps: (D,) F_L, of an estimator that knows it only where the vehicle is.
            said_mps: (D,) F_M of the model; None: the flow learnt while the speed was normal, as it was.
            normal: whether the speed is normal now, as far as is known.
        """
        if normal or self._normal_mps is None:
            self._normal_mps = learnt_mps
        return self._comparison.error(learnt_mps, self._normal_mps if said_mps is None else said_mps)

    def error_of_field(self, learnt: LearntFlow, normal: bool, time_s: float, position_m: FloatArray) -> float:
        """The same of a flow over place and time, which is carried on, frozen, from where the speed was normal last.

        Args:
            learnt: F_L.
            normal: see `error`.
            time_s, position_m: now, and the (D,) position.
        """
        foreseen_mps = self._foreseen.velocity_mps(learnt, normal, time_s, position_m)
        return self._comparison.error(learnt.velocity_mps(time_s, position_m), foreseen_mps)
