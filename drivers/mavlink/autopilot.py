"""Which autopilot on the link is ours."""

from __future__ import annotations

import math
from collections import Counter

AUTOPILOT_COMPONENT = 1  # MAV_COMP_ID_AUTOPILOT1
AUTOPILOT_INVALID = 8  # MAV_AUTOPILOT_INVALID: ground stations, cameras, companions
VEHICLES = range(1, 255)  # system ids: 0 means all, and 255 is the ground station's
HEARTBEAT_LOST_S = 5.0  # heartbeats come once a second
# whoever was alone for so long is the vehicle that we are on
KNOWN_S = 10.0


class AutopilotChoice:
    """Finds the one autopilot on a link, or refuses to guess.

    Without a configured system id the first autopilot whose HEARTBEAT is heard is taken, as long as it is the only
    one: while two systems beat, none is listened to, for judging one vehicle by the other's thrusters would be worse
    than silence. But one that was alone for 10 s is ours: a second one that comes later (a neighbour's vehicle, a
    forged packet) makes us neither deaf nor dumb. When all but one have been silent for 5 s, that one is taken.

    Args:
        configured: MAVLink system id from the configuration; None: find it.
        drops: counted here: heartbeats of an "other autopilot", and of a "system id of no vehicle".

    Raises:
        ValueError: `configured` is not in 1..254.
    """

    def __init__(self, configured: int | None, drops: Counter[str]) -> None:
        if configured is not None and configured not in VEHICLES:
            raise ValueError(f"autopilot_system must lie in 1..254, got {configured}")
        self._configured = configured
        self._drops = drops
        self._heard_s: dict[int, float] = {}
        self._alone_s = math.inf  # since when the one that is taken has been the only one
        self.system_id: int | None = configured

    @property
    def rivals(self) -> tuple[int, ...]:
        """System ids of all autopilots heard of late, ascending; more than one where there is a conflict."""
        return tuple(sorted(self._heard_s))

    def heartbeat(self, system_id: int, time_s: float) -> None:
        """Take the HEARTBEAT of an autopilot and choose anew: `system_id` is None while there is a conflict."""
        if system_id not in VEHICLES:  # nobody can be asked for anything by such an id
            self._drops["system id of no vehicle"] += 1
            return
        if self._configured is not None:
            if system_id != self._configured:
                self._drops["other autopilot"] += 1
            return
        if not self._heard_s:
            self._alone_s = time_s
        self._heard_s[system_id] = time_s
        self._heard_s = {system: at_s for system, at_s in self._heard_s.items() if time_s - at_s <= HEARTBEAT_LOST_S}
        if len(self._heard_s) == 1:
            if system_id != self.system_id:
                self._alone_s = time_s
            self.system_id = system_id
            return
        known = self.system_id is not None and time_s - self._alone_s >= KNOWN_S
        if not known:
            self.system_id, self._alone_s = None, math.inf
        if system_id != self.system_id:
            self._drops["other autopilot"] += 1
