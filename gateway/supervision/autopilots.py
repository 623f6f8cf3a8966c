"""What is known of the autopilot from its HEARTBEAT, and what can be asked of which autopilot.

ArduSub's commands were seen to be accepted within 8 ms from a companion (system = vehicle, component 192); PX4's are
from its sources (Commander.cpp), whose underwater vehicles have manual, altitude and position modes only. All can be
repeated without harm.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum, StrEnum, auto

from drivers.mavlink.messages import CommandLong
from drivers.readings import AutopilotHeartbeat
from gateway.supervision.actions import Action

# MAV_AUTOPILOT, MAV_TYPE, MAV_STATE
MAV_AUTOPILOT_ARDUPILOT, MAV_AUTOPILOT_PX4 = 3, 12
MAV_TYPE_SUBMARINE = 12
MAV_STATE_CRITICAL, MAV_STATE_EMERGENCY, MAV_STATE_FLIGHT_TERMINATION = 5, 6, 8
OWN_FAILSAFE = frozenset({MAV_STATE_CRITICAL, MAV_STATE_EMERGENCY, MAV_STATE_FLIGHT_TERMINATION})

# a component is lost after four to five of its heartbeats (MAVLink heartbeat service)
LOST_AFTER_S = 5.0

MAV_CMD_NAV_LAND, MAV_CMD_DO_SET_MODE, MAV_CMD_DO_FLIGHTTERMINATION, MAV_CMD_ARM_DISARM = 21, 176, 185, 400
CUSTOM_MODE_ENABLED = 1.0  # MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
FORCE_DISARM = 21196.0  # PX4 refuses to disarm "in air" without it

# ArduSub/mode.h
ARDUSUB_ALT_HOLD, ARDUSUB_SURFACE, ARDUSUB_POSHOLD, ARDUSUB_MANUAL = 2, 9, 16, 19
# PX4's main modes, as they stand in HEARTBEAT.custom_mode
PX4_MANUAL, PX4_ALTCTL, PX4_POSCTL = 1 << 16, 2 << 16, 3 << 16


class AutopilotKind(StrEnum):
    """Autopilots whose modes are known. Mode numbers differ by vehicle: only those of submarines count."""

    ARDUSUB = "ArduSub"
    PX4 = "PX4"
    OTHER = "other"


class ArmedEdge(Enum):
    """A change of the armed state."""

    NONE = auto()
    ARMED = auto()
    DISARMED = auto()


@dataclass(frozen=True, slots=True)
class Request:
    """How an action is asked for, and how HEARTBEAT shows that it came about.

    Attributes:
        command: MAV_CMD.
        parameters: its first ones.
        modes: `custom_mode` shows one of these; none: the vehicle is no longer armed.
        after: modes into which the autopilot goes on by itself.
        as_good: modes that do the same and hold the position as well.
        statuses: `system_status` shows one of these, though the vehicle may still be armed.
    """

    command: int
    parameters: tuple[float, ...]
    modes: frozenset[int] = frozenset()
    after: frozenset[int] = frozenset()
    as_good: frozenset[int] = frozenset()
    statuses: frozenset[int] = frozenset()

    def good(self, position_trusted: bool) -> frozenset[int]:
        """Modes that do it, where a position can be held or not."""
        return self.modes | self.as_good if position_trusted else self.modes

    def ended(self, heard: AutopilotHeartbeat) -> bool:
        """Whether HEARTBEAT shows what no mode shows."""
        return not heard.armed or heard.system_status in self.statuses

    def message(self, autopilot: AutopilotHeartbeat) -> CommandLong:
        """The command, as it is sent first."""
        first, second, third = (*self.parameters, 0.0, 0.0, 0.0)[:3]
        parameters = (first, second, third, 0.0, 0.0, 0.0, 0.0)
        return CommandLong(self.command, parameters, autopilot.system_id, autopilot.component_id)


def _mode(number: int, *modes: int, after: int | None = None, as_good: int | None = None) -> Request:
    return Request(
        MAV_CMD_DO_SET_MODE,
        (CUSTOM_MODE_ENABLED, float(number)),
        frozenset(modes or {number}),
        frozenset() if after is None else frozenset({after}),
        frozenset() if as_good is None else frozenset({as_good}),
    )


REQUESTS: Mapping[tuple[AutopilotKind, Action], Request] = {
    (AutopilotKind.ARDUSUB, Action.MANUAL): _mode(ARDUSUB_MANUAL),
    (AutopilotKind.ARDUSUB, Action.HOLD): _mode(ARDUSUB_ALT_HOLD, as_good=ARDUSUB_POSHOLD),
    # at the surface it goes over to ALT_HOLD by itself, within one loop: SURFACE may never be seen
    (AutopilotKind.ARDUSUB, Action.SURFACE): _mode(ARDUSUB_SURFACE, after=ARDUSUB_ALT_HOLD),
    (AutopilotKind.ARDUSUB, Action.LAND): Request(
        MAV_CMD_NAV_LAND, (), frozenset({ARDUSUB_SURFACE}), frozenset({ARDUSUB_ALT_HOLD})
    ),
    (AutopilotKind.ARDUSUB, Action.DISARM): Request(MAV_CMD_ARM_DISARM, (0.0, 0.0)),
    (AutopilotKind.ARDUSUB, Action.TERMINATE): Request(MAV_CMD_DO_FLIGHTTERMINATION, (1.0,)),
    (AutopilotKind.PX4, Action.MANUAL): _mode(1, PX4_MANUAL),
    (AutopilotKind.PX4, Action.HOLD): _mode(2, PX4_ALTCTL, as_good=PX4_POSCTL),
    (AutopilotKind.PX4, Action.DISARM): Request(MAV_CMD_ARM_DISARM, (0.0, FORCE_DISARM)),
    (AutopilotKind.PX4, Action.TERMINATE): Request(
        MAV_CMD_DO_FLIGHTTERMINATION, (1.0,), statuses=frozenset({MAV_STATE_FLIGHT_TERMINATION})
    ),
}


def kind_of(reading: AutopilotHeartbeat) -> AutopilotKind:
    """Which autopilot this HEARTBEAT is from."""
    if reading.vehicle_type != MAV_TYPE_SUBMARINE:
        return AutopilotKind.OTHER
    known = {MAV_AUTOPILOT_PX4: AutopilotKind.PX4, MAV_AUTOPILOT_ARDUPILOT: AutopilotKind.ARDUSUB}
    return known.get(reading.autopilot, AutopilotKind.OTHER)


class AutopilotWatch:
    """Remembers the newest HEARTBEAT.

    Attributes:
        ambiguous: True while several autopilots are heard: none is relied on then, nor what was heard before.
    """

    def __init__(self) -> None:
        self.ambiguous = False
        self._newest: AutopilotHeartbeat | None = None

    @property
    def armed(self) -> bool | None:
        """Armed state as last heard; None before any HEARTBEAT."""
        return None if self._newest is None else self._newest.armed

    def heartbeat(self, reading: AutopilotHeartbeat) -> ArmedEdge:
        """Takes a HEARTBEAT; the first one is no edge."""
        before, self._newest = self._newest, reading
        if before is None or before.armed == reading.armed:
            return ArmedEdge.NONE
        return ArmedEdge.ARMED if reading.armed else ArmedEdge.DISARMED

    def present(self, time_s: float) -> AutopilotHeartbeat | None:
        """The newest HEARTBEAT, None where it is too old to rely on."""
        if self._newest is None or self.ambiguous or time_s - self._newest.time_s > LOST_AFTER_S:
            return None
        return self._newest
