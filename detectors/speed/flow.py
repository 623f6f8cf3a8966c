"""What an outside model of the flow must be able to say (paper 002, F_M)."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray


class FlowModel(Protocol):
    """A current that is known or forecast. Picklable."""

    def velocity_mps(self, time_s: float, position_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """(D,) velocity of the water, north, east (and down), at (D,) north, east (and down).

        NaN where the model says nothing.
        """
