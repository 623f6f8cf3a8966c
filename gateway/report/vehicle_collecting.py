"""What the autopilot's HEARTBEATs tell over a dive: armed or not, and the modes."""

from __future__ import annotations

import numpy as np

from drivers.readings import AutopilotHeartbeat
from gateway.report.mode_names import mode_name
from gateway.report.thinning import FloatArray

# a log that flips its mode with every packet is no dive: what comes later is not drawn
CHANGES_MAX = 10_000


class VehicleCollecting:
    """Takes HEARTBEATs, in order."""

    def __init__(self) -> None:
        self._modes: list[tuple[float, str]] = []
        self._armed_since_s: float | None = None
        self._armed: list[tuple[float, float]] = []
        self._newest_s = 0.0

    def take(self, heard: AutopilotHeartbeat) -> None:
        """The next one."""
        self._newest_s = heard.time_s
        mode = mode_name(heard)
        if (not self._modes or self._modes[-1][1] != mode) and len(self._modes) < CHANGES_MAX:
            self._modes.append((heard.time_s, mode))
        if heard.armed and self._armed_since_s is None:
            self._armed_since_s = heard.time_s
        elif not heard.armed and self._armed_since_s is not None:
            self._disarmed()

    def armed(self, begin_s: float) -> FloatArray:
        """(M, 2) from and to, since `begin_s`."""
        going_on = [] if self._armed_since_s is None else [(self._armed_since_s, self._newest_s)]
        return np.array([*self._armed, *going_on]).reshape(-1, 2) - begin_s

    def modes(self, begin_s: float) -> tuple[tuple[float, str], ...]:
        """From when, since `begin_s`, and which."""
        return tuple((time_s - begin_s, mode) for time_s, mode in self._modes)

    def _disarmed(self) -> None:
        if self._armed_since_s is not None and len(self._armed) < CHANGES_MAX:
            self._armed.append((self._armed_since_s, self._newest_s))
        self._armed_since_s = None
