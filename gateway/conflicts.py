"""Who else speaks on the MAVLink link: a second autopilot, or another program with our own ids."""

from __future__ import annotations

import math
from collections.abc import Iterator

from detectors.verdict import Level
from drivers.readings import AutopilotConflict, IdentityConflict
from gateway.config_sections import MAVLINK
from gateway.observation import Observation

AUTOPILOTS, IDENTITY = "link mavlink autopilots", "link mavlink identity"
# the driver says so again every 10 s while it lasts
IDENTITY_OVER_S = 30.0


class ConflictWatch:
    """Remembers conflicts until they are over: an autopilot is listened to again, the other program is not heard."""

    def __init__(self) -> None:
        self._autopilots: bool | None = None  # whether there are several now; None: there never were
        self._identity_s: float | None = None

    def take(self, reading: AutopilotConflict | IdentityConflict) -> Observation:
        """A conflict, in the terms of the supervisor."""
        if isinstance(reading, AutopilotConflict):
            self._autopilots = len(reading.system_ids) > 1
            systems = ", ".join(map(str, reading.system_ids))
            trouble = f"has several autopilots: {systems}" if self._autopilots else ""
            return _observation(reading.time_s, AUTOPILOTS, trouble)
        self._identity_s = reading.time_s
        return _observation(reading.time_s, IDENTITY, f"id {reading.system_id}/{reading.component_id} is used twice")

    def heartbeat(self, time_s: float) -> Iterator[Observation]:
        """One autopilot is listened to: where there were several, that is over, if it stays so."""
        if self._autopilots is False:
            yield _observation(time_s, AUTOPILOTS, "")

    def advance(self, time_s: float) -> Iterator[Observation]:
        """Takes a tick."""
        if self._identity_s is not None and time_s - self._identity_s > IDENTITY_OVER_S:
            yield _observation(time_s, IDENTITY, "")


def _observation(time_s: float, subject: str, trouble: str) -> Observation:
    level = Level.SUSPECT if trouble else Level.NORMAL
    return Observation(time_s, "link", subject, MAVLINK, level, math.nan, trouble)
