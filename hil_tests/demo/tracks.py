"""Where the gateway took the vehicle to be, beside where it was."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from math import isfinite

import numpy as np
from numpy.typing import NDArray

from detectors.navigation import NavigationState
from hil_tests.rig.embedded import Moment
from hil_tests.rig.geodesy import place_m

FloatArray = NDArray[np.float64]
EVERY_S = 0.1
ROUNDED_S = 1e-6


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """Places over time.

    Attributes:
        time_s, north_m, east_m: (N,) each, positions as the rig counts them.
    """

    time_s: FloatArray
    north_m: FloatArray
    east_m: FloatArray

    def errors_m(self, moments: Sequence[Moment]) -> FloatArray:
        """(N,) distance from the truth; `moments` has at least one."""
        true_s = [moment.time_s for moment in moments]
        off_m = [
            places_m - np.interp(self.time_s, true_s, [getattr(moment.motion, name) for moment in moments])
            for name, places_m in (("north_m", self.north_m), ("east_m", self.east_m))
        ]
        return np.asarray(np.hypot(*off_m))

    def anchored(self, moments: Sequence[Moment], time_s: float) -> Track:
        """The same track, moved as a whole so that it goes through the true place at a time."""
        true_s = [moment.time_s for moment in moments]
        moved = {}
        for name in ("north_m", "east_m"):
            true_m = np.interp(time_s, true_s, [getattr(moment.motion, name) for moment in moments])
            places_m = getattr(self, name)
            moved[name] = places_m + true_m - np.interp(time_s, self.time_s, places_m)
        return replace(self, **moved)


def track(states: Iterable[NavigationState]) -> Track:
    """The places of states that come in order of time, ten a second; those that are not known are left out."""
    rows: list[tuple[float, float, float]] = []
    for state in states:
        if isfinite(state.latitude_rad) and (not rows or state.time_s >= rows[-1][0] + EVERY_S - ROUNDED_S):
            rows.append((state.time_s, *place_m(state.latitude_rad, state.longitude_rad)))
    columns = np.array(rows).reshape(-1, 3).T
    return Track(*columns)
