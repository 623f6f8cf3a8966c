"""The method of paper 000 behind the same interface as the default one."""

from __future__ import annotations

from collections.abc import Iterator
from math import nan

import numpy as np
from numpy.typing import NDArray

from detectors.thruster.config import ThrusterConfig
from detectors.thruster.judgement import Judgement
from detectors.thruster.learnt import LearntCurve, curve_of_polynomial
from detectors.thruster.paper import OnlinePolynomial
from detectors.thruster.sample import FaultKind, ThrusterSample
from detectors.thruster.wear import CommissionedCurve
from detectors.verdict import Level

FloatArray = NDArray[np.float64]

REASONS = {
    Level.UNKNOWN: "learning",
    Level.SUSPECT: "speed is off",
    Level.FAULT: "speed has changed",
    Level.NORMAL: "",
}


class PublishedMethod:
    """`OnlinePolynomial`, sample by sample. It learns whatever lasts, so that there is nothing to accept."""

    commissioned: CommissionedCurve | None = None

    def __init__(self, config: ThrusterConfig) -> None:
        window_min, window_max, warmup = config.spans
        self._rule = OnlinePolynomial(
            order_max=config.order_max,
            delay_max=config.delay_max,
            window_min=window_min,
            window_max=window_max,
            warmup=warmup,
            search=config.search,
            threshold_rpm=config.threshold_rpm,
            seed=config.seed,
        )

    @property
    def learnt(self) -> LearntCurve | None:
        """The present steady curve; None while there is no model."""
        model = self._rule.model
        return None if model is None else curve_of_polynomial(model)

    def judge(self, block: FloatArray) -> Iterator[Judgement]:
        """As `Method.judge`."""
        for time_s, command, speed_rpm in block[:3].T.tolist():
            step = self._rule.step(ThrusterSample(time_s, command, speed_rpm))
            slow = step.residual_rpm * step.predicted_rpm < 0.0
            kind = FaultKind.ENTANGLED if slow else FaultKind.PROPELLER_LOST
            yield Judgement(
                level=np.array([int(step.level)]),
                score=np.array([step.score]),
                residual_rpm=np.array([step.residual_rpm]),
                predicted_rpm=np.array([step.predicted_rpm]),
                threshold_rpm=np.array([step.threshold_rpm]),
                kind=np.array([kind if step.level >= Level.SUSPECT else FaultKind.NONE]),
                reason=np.array([REASONS[step.level]]),
                order=step.order,
                window=step.window,
                delay=step.delay,
                lag_s=0.0,
                refitted=step.refitted,
                wear=nan,
            )

    def begin_dive(self) -> None:
        """Nothing to do: it learns all the time."""

    def accept(self) -> None:
        """Nothing to do: after the window is filled with the new state, it is the normal one."""
