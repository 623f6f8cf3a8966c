"""Currents that ESCs say they draw: of one that measures none, 0 A means nothing."""

from __future__ import annotations

import numpy as np

from drivers.logs.plausible import FloatArray
from drivers.mavlink.thrusters import CURRENT_MAX_A


class EscCurrents:
    """Knows which ESCs have measured a current once: from there on 0 A is one, too."""

    def __init__(self) -> None:
        self._meters: set[int] = set()

    def measured(self, thruster: int, current_a: FloatArray) -> FloatArray:
        """(N,) what the thruster's ESC says next, in the order of the log: NaN where that is no measurement."""
        measured = np.abs(current_a) < CURRENT_MAX_A
        flows = measured & (current_a != 0.0)
        if thruster not in self._meters:
            measured &= np.logical_or.accumulate(flows)
        if flows.any():
            self._meters.add(thruster)
        return np.where(measured, current_a, np.nan)
