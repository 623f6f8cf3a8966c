"""What the autopilot says of the vehicle, from unpacked payloads to readings. Values are in wire order."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

from drivers.construction import constructor
from drivers.mavlink.formats import (
    ATTITUDE,
    ATTITUDE_QUATERNION,
    GLOBAL_POSITION_INT,
    LOCAL_POSITION_NED,
    MessageFormat,
)
from drivers.mavlink.freshness import NEWS_MAX, BootWatch, Freshness
from drivers.readings import (
    Attitude,
    AutopilotHeartbeat,
    AutopilotReboot,
    CommandAcknowledgement,
    GlobalPosition,
    LocalPosition,
    Reading,
)

MODE_FLAG_ARMED = 0x80  # MAV_MODE_FLAG_SAFETY_ARMED

# Nothing that an underwater vehicle does comes near these: beyond them the sender's filter has blown up.
ANGLE_MAX_RAD = 2.0 * math.pi
RATE_MAX_RADPS = 100.0
POSITION_MAX_M = 1e7
VELOCITY_MAX_MPS = 100.0
LENGTH_TOLERANCE = 0.01  # of a unit quaternion
STRAIGHT = 1.0 - 2e-7  # sine of the pitch, to 32 bits: roll and yaw are then about one axis
LATITUDE_MAX_E7 = 900_000_000
LONGITUDE_MAX_E7 = 1_800_000_000
# ATTITUDE_QUATERNION says the same again, unless ATTITUDE has not come for this long.
ATTITUDE_MISSED_S = 2.0


_attitude = constructor(Attitude)
_global_position, _local_position = constructor(GlobalPosition), constructor(LocalPosition)


def heartbeat(values: tuple[Any, ...], system_id: int, component_id: int, time_s: float) -> AutopilotHeartbeat:
    """HEARTBEAT of an autopilot."""
    custom_mode, vehicle_type, autopilot, base_mode, system_status, _version = values
    return AutopilotHeartbeat(
        time_s=time_s,
        system_id=system_id,
        component_id=component_id,
        autopilot=autopilot,
        vehicle_type=vehicle_type,
        armed=bool(base_mode & MODE_FLAG_ARMED),
        custom_mode=custom_mode,
        system_status=system_status,
    )


class VehicleTelemetry:
    """Attitude, positions, acknowledgements and restarts of one autopilot.

    Args:
        system_id: the autopilot's.
        own_component: component id under which the gateway sends commands.
        drops: counted here by cause.
    """

    def __init__(self, system_id: int, own_component: int, drops: Counter[str]) -> None:
        self._system_id = system_id
        self._own_component = own_component
        self._drops = drops
        self._fresh = Freshness(drops)
        self._boot = BootWatch()
        self._attitude_s = -math.inf

    def system_time(self, values: tuple[Any, ...], time_s: float) -> list[Reading]:
        """SYSTEM_TIME: asked for because it always carries the time since boot."""
        return self._reboot(values[1], time_s)

    def attitude(self, values: tuple[Any, ...], time_s: float) -> list[Reading]:
        """ATTITUDE; radians and radians per second on the wire too."""
        boot_ms, roll, pitch, yaw, roll_rate, pitch_rate, yaw_rate = values
        readings: list[Reading] = []
        if self._is_news(ATTITUDE, boot_ms, time_s, readings):
            self._attitude_s = time_s
            if _within(roll, pitch, yaw, ANGLE_MAX_RAD) and _within(roll_rate, pitch_rate, yaw_rate, RATE_MAX_RADPS):
                boot_s = boot_ms / 1000.0
                readings.append(_attitude(time_s, roll, pitch, yaw, roll_rate, pitch_rate, yaw_rate, boot_s))
            else:
                self._drops["implausible attitude"] += 1
        return readings

    def attitude_quaternion(self, values: tuple[Any, ...], time_s: float) -> list[Reading]:
        """ATTITUDE_QUATERNION, where there is no ATTITUDE: from the body to north-east-down, w first."""
        boot_ms, *quaternion, roll_rate, pitch_rate, yaw_rate = values[:8]
        if time_s - self._attitude_s <= ATTITUDE_MISSED_S:
            return self._reboot(boot_ms, time_s)
        readings: list[Reading] = []
        if self._is_news(ATTITUDE_QUATERNION, boot_ms, time_s, readings):
            whole = abs(math.hypot(*quaternion) - 1.0) <= LENGTH_TOLERANCE  # False for NaN
            if whole and _within(roll_rate, pitch_rate, yaw_rate, RATE_MAX_RADPS):
                roll, pitch, yaw = _euler(*quaternion)
                boot_s = boot_ms / 1000.0
                readings.append(_attitude(time_s, roll, pitch, yaw, roll_rate, pitch_rate, yaw_rate, boot_s))
            else:
                self._drops["implausible attitude"] += 1
        return readings

    def local_position(self, values: tuple[Any, ...], time_s: float) -> list[Reading]:
        """LOCAL_POSITION_NED; metres and metres per second on the wire too."""
        boot_ms, north, east, down, speed_north, speed_east, speed_down = values
        readings: list[Reading] = []
        if self._is_news(LOCAL_POSITION_NED, boot_ms, time_s, readings):
            if _within(north, east, down, POSITION_MAX_M) and _within(
                speed_north, speed_east, speed_down, VELOCITY_MAX_MPS
            ):
                position, velocity = (north, east, down), (speed_north, speed_east, speed_down)
                readings.append(_local_position(time_s, position, velocity))
            else:
                self._drops["implausible local position"] += 1
        return readings

    def global_position(self, values: tuple[Any, ...], time_s: float) -> list[Reading]:
        """GLOBAL_POSITION_INT: 1e-7 degrees, mm above sea level, cm/s."""
        boot_ms, latitude, longitude, altitude_mm, _relative_mm, north, east, down, _heading = values
        readings: list[Reading] = []
        if not self._is_news(GLOBAL_POSITION_INT, boot_ms, time_s, readings):
            return readings
        if latitude == 0 and longitude == 0:
            self._drops["no global position"] += 1  # what autopilots say before they know
        elif abs(latitude) > LATITUDE_MAX_E7 or abs(longitude) > LONGITUDE_MAX_E7:
            self._drops["implausible global position"] += 1
        else:
            readings.append(
                _global_position(
                    time_s,
                    math.radians(latitude * 1e-7),
                    math.radians(longitude * 1e-7),
                    -altitude_mm / 1000.0,
                    (north / 100.0, east / 100.0, down / 100.0),
                    boot_ms / 1000.0,
                )
            )
        return readings

    def acknowledgement(self, values: tuple[Any, ...], time_s: float) -> list[Reading]:
        """COMMAND_ACK, unless it answers somebody else; senders that name nobody (0) may mean us."""
        command, result, progress, _detail, target_system, target_component = values
        if target_system not in (0, self._system_id) or target_component not in (0, self._own_component):
            return []
        return [CommandAcknowledgement(time_s, self._system_id, 1, command, result, progress)]

    def _reboot(self, boot_ms: int, time_s: float) -> list[Reading]:
        return [AutopilotReboot(time_s, self._system_id)] if self._boot.rebooted(boot_ms) else []

    def _is_news(self, message: MessageFormat, boot_ms: int, time_s: float, readings: list[Reading]) -> bool:
        """Whether a message was not there before; a restart of the autopilot that it shows is put to the readings."""
        if 0 < boot_ms - self._boot.latest_ms < NEWS_MAX:  # newer than all before: nearly every message
            self._boot.latest_ms = self._fresh.stamps[message.message_id] = boot_ms
            return True
        readings += self._reboot(boot_ms, time_s)
        return self._fresh.accepts(message.message_id, boot_ms, ticks_per_s=1000)


def _euler(w: float, x: float, y: float, z: float) -> tuple[float, float, float]:
    """Roll, pitch and yaw of a quaternion of about unit length; straight up or down roll is in the yaw."""
    length = math.hypot(w, x, y, z)
    w, x, y, z = w / length, x / length, y / length, z / length
    up = max(-1.0, min(2.0 * (w * y - z * x), 1.0))
    if abs(up) > STRAIGHT:
        return 0.0, math.asin(up), math.copysign(2.0, -up) * math.atan2(x, w)
    return (
        math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)),
        math.asin(up),
        math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)),
    )


def _within(x: float, y: float, z: float, limit: float) -> bool:
    return abs(x) <= limit and abs(y) <= limit and abs(z) <= limit  # False for NaN
