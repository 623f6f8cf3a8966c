"""Thruster detectors that keep the samples which they were given."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from detectors.thruster import ThrusterConfig, ThrusterDetector, ThrusterSample, ThrusterVerdict
from detectors.thruster.detector import ThrusterVerdicts
from detectors.thruster.wear import CommissionedCurve

FloatArray: TypeAlias = NDArray[np.float64]


class KeepingDetector(ThrusterDetector):
    """Judges as `ThrusterDetector` does, and keeps the samples."""

    def __init__(self, config: ThrusterConfig, commissioned: CommissionedCurve | None = None) -> None:
        super().__init__(config, commissioned)
        self._blocks: list[FloatArray] = []

    def update(self, sample: ThrusterSample) -> ThrusterVerdict:
        """Keeps a sample and judges it."""
        volts = np.nan if sample.voltage_v is None else sample.voltage_v
        amperes = np.nan if sample.current_a is None else sample.current_a
        self._blocks.append(np.array([[sample.time_s], [sample.command], [sample.speed_rpm], [volts], [amperes]]))
        return super().update(sample)

    def run(
        self,
        time_s: ArrayLike,
        command: ArrayLike,
        speed_rpm: ArrayLike,
        voltage_v: ArrayLike | None = None,
        current_a: ArrayLike | None = None,
    ) -> ThrusterVerdicts:
        """Keeps samples and judges them."""
        time = np.asarray(time_s, dtype=np.float64)
        unmeasured = np.full(len(time), np.nan)
        given = (command, speed_rpm, voltage_v, current_a)
        self._blocks.append(np.stack([time, *(unmeasured if one is None else np.asarray(one) for one in given)]))
        return super().run(time_s, command, speed_rpm, voltage_v, current_a)

    def kept(self) -> FloatArray:
        """(5, N) time, command, speed, voltage and current of all samples so far."""
        return np.concatenate(self._blocks, axis=1) if self._blocks else np.empty((5, 0))
