"""The flow that is known from elsewhere, and the one that was learnt while the speed was normal (paper 002, F_M)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from detectors.speed.anomaly import FlowComparison
from detectors.speed.config import SpeedConfig

FloatArray = NDArray[np.float64]


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
        self._normal_mps: FloatArray | None = None
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

    def error(self, learnt_mps: FloatArray, said_mps: FloatArray | None, normal: bool) -> float:
        """p_E of paper 002, equation 14: how far the learnt flow is from the foreseen one, 0 to 1.

        Args:
            learnt_mps: (D,) F_L.
            said_mps: (D,) F_M of the model; None: the flow learnt while the speed was normal, carried on.
            normal: whether the speed is normal now, as far as is known.
        """
        if normal or self._normal_mps is None:
            self._normal_mps = learnt_mps
        return self._comparison.error(learnt_mps, self._normal_mps if said_mps is None else said_mps)
