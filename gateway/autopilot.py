"""What is known of the autopilot from its HEARTBEAT: which one it is, and whether it is armed."""

from __future__ import annotations

from enum import Enum, StrEnum, auto

from drivers.readings import AutopilotHeartbeat

# MAV_AUTOPILOT, MAV_TYPE, MAV_STATE
MAV_AUTOPILOT_ARDUPILOT, MAV_AUTOPILOT_PX4 = 3, 12
MAV_TYPE_SUBMARINE = 12
MAV_STATE_CRITICAL, MAV_STATE_EMERGENCY = 5, 6

# a component is lost after four to five of its heartbeats (MAVLink heartbeat service)
LOST_AFTER_S = 5.0


class AutopilotKind(StrEnum):
    """Autopilots whose modes are known. ArduPilot's mode numbers differ by vehicle: only ArduSub's count."""

    ARDUSUB = "ArduSub"
    PX4 = "PX4"
    OTHER = "other"


class ArmedEdge(Enum):
    """A change of the armed state."""

    NONE = auto()
    ARMED = auto()
    DISARMED = auto()


def kind_of(reading: AutopilotHeartbeat) -> AutopilotKind:
    """Which autopilot this HEARTBEAT is from."""
    if reading.autopilot == MAV_AUTOPILOT_PX4:
        return AutopilotKind.PX4
    if reading.autopilot == MAV_AUTOPILOT_ARDUPILOT and reading.vehicle_type == MAV_TYPE_SUBMARINE:
        return AutopilotKind.ARDUSUB
    return AutopilotKind.OTHER


class AutopilotWatch:
    """Remembers the newest HEARTBEAT."""

    def __init__(self) -> None:
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
        if self._newest is None or time_s - self._newest.time_s > LOST_AFTER_S:
            return None
        return self._newest
