"""HEARTBEATs of a log that has none, from what it says of arming and modes.

One each second, as autopilots send them, and one at each change. They begin once both armed state and mode are known.
MAV_STATE is STANDBY while not armed; while armed ACTIVE, or CRITICAL where the log tells of a failsafe (dataflash
logs do not).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np

from drivers.logs.stamped import Stamped
from drivers.readings import AutopilotHeartbeat

PERIOD_S = 1.0
GAP_MAX_S = 3600.0  # nobody wants a day of them
MAV_STATE_STANDBY, MAV_STATE_ACTIVE, MAV_STATE_CRITICAL = 3, 4, 5
AUTOPILOT_COMPONENT = 1


@dataclass(frozen=True, slots=True)
class StateChange:
    """From a time on the autopilot is armed or not, in a mode, in a failsafe; None: this did not change.

    Attributes:
        time_s: when.
        place: in the log.
        armed, custom_mode, failsafe: what is new.
    """

    time_s: float
    place: int
    armed: bool | None = None
    custom_mode: int | None = None
    failsafe: bool | None = None


@dataclass(frozen=True, slots=True)
class _State:
    """What is known of the autopilot."""

    armed: bool | None = None
    custom_mode: int | None = None
    failsafe: bool = False

    @property
    def is_known(self) -> bool:
        return self.armed is not None and self.custom_mode is not None

    @property
    def status(self) -> int:
        """MAV_STATE."""
        if not self.armed:
            return MAV_STATE_STANDBY
        return MAV_STATE_CRITICAL if self.failsafe else MAV_STATE_ACTIVE

    def after(self, change: StateChange) -> _State:
        return _State(
            self.armed if change.armed is None else change.armed,
            self.custom_mode if change.custom_mode is None else change.custom_mode,
            self.failsafe if change.failsafe is None else change.failsafe,
        )


class Heartbeats:
    """Changes of state in, heartbeats out.

    Args:
        system_id: MAVLink system id.
        autopilot: MAV_AUTOPILOT.
        vehicle_type: MAV_TYPE.
        armed: at the beginning; None: not known.
    """

    def __init__(self, system_id: int, autopilot: int, vehicle_type: int, armed: bool | None = None) -> None:
        self._system_id = system_id
        self._autopilot = autopilot
        self._vehicle_type = vehicle_type
        self._now = _State(armed)
        self._next_s = -np.inf

    def take(self, changes: Sequence[StateChange], until_s: float) -> Stamped:
        """Heartbeats up to a time, by changes not older than those before."""
        beats: list[tuple[int, AutopilotHeartbeat]] = []
        for change in sorted(changes, key=lambda one: (one.time_s, one.place)):
            beats += self._beats_until(change.time_s)
            before, self._now = self._now, self._now.after(change)
            if before != self._now and self._now.is_known:
                beats.append((change.place, self._beat(change.time_s)))
                self._next_s = change.time_s + PERIOD_S
        beats += self._beats_until(until_s)
        return Stamped(
            np.array([beat.time_s for _, beat in beats]),
            np.array([place for place, _ in beats], dtype=np.intp),
            [beat for _, beat in beats],
        )

    def _beats_until(self, until_s: float) -> list[tuple[int, AutopilotHeartbeat]]:
        if not self._now.is_known or not until_s - self._next_s <= GAP_MAX_S:
            self._next_s = max(self._next_s, until_s)
            return []
        count = max(0, ceil((until_s - self._next_s) / PERIOD_S))
        beats = [(-1, self._beat(self._next_s + number * PERIOD_S)) for number in range(count)]
        self._next_s += count * PERIOD_S
        return beats

    def _beat(self, time_s: float) -> AutopilotHeartbeat:
        return AutopilotHeartbeat(
            time_s=time_s,
            system_id=self._system_id,
            component_id=AUTOPILOT_COMPONENT,
            autopilot=self._autopilot,
            vehicle_type=self._vehicle_type,
            armed=bool(self._now.armed),
            custom_mode=self._now.custom_mode or 0,
            system_status=self._now.status,
        )
