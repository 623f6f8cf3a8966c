"""What Doppler velocity logs say, from unpacked payloads to readings. Values are in wire order.

There is no DVL message that drivers use. The BlueOS extensions for Water Linked and Cerulean DVLs send
VISION_POSITION_DELTA by way of mavlink2rest, with the header of a ground station (system 255, component 0) and
without a time. While there is no bottom lock, Water Linked's sends nothing at all, Cerulean's zeros with confidence
0. Others send ODOMETRY or VISION_SPEED_ESTIMATE. (The latter is north, east, down; Water Linked's extension, where it
is set to it, sends forward, right, down, which cannot be told apart: leave it at position deltas.)
"""

from __future__ import annotations

from collections import Counter
from math import cos, sin
from typing import Any

from drivers.mavlink.formats import ODOMETRY, VISION_POSITION_DELTA, VISION_SPEED_ESTIMATE
from drivers.mavlink.frames import Packet
from drivers.mavlink.freshness import Freshness
from drivers.readings import Attitude, BodyVelocity, Reading

MAV_FRAME_BODY_FRD = 12
MAV_ESTIMATOR_TYPE_AUTOPILOT = 8

# No vehicle under water is faster, over any current.
VELOCITY_MAX_MPS = 20.0
INTERVAL_MAX_US = 10_000_000
# By so much do two routes to one sender differ.
ROUTES_S = 0.02
# An attitude that is older says nothing of the present one.
ATTITUDE_MAX_AGE_S = 0.5

Vector = tuple[float, float, float]


class BodyVelocities:
    """Velocities from all senders of one vehicle.

    Args:
        drops: counted here by cause.

    Attributes:
        attitude: newest attitude of the vehicle, for velocities that come in the frame of the earth.
    """

    def __init__(self, drops: Counter[str]) -> None:
        self.attitude: Attitude | None = None
        self._drops = drops
        self._fresh = Freshness(drops)
        self._newest: dict[str, tuple[float, Vector]] = {}

    def decode(self, packet: Packet, time_s: float) -> list[Reading]:
        """What a packet says, one of VISION_POSITION_DELTA, ODOMETRY and VISION_SPEED_ESTIMATE."""
        sender = f"{packet.system_id}.{packet.component_id}"
        if packet.message_id == VISION_POSITION_DELTA.message_id:
            return self._position_delta(VISION_POSITION_DELTA.unpack(packet.payload), sender, time_s)
        if packet.message_id == ODOMETRY.message_id:
            return self._odometry(ODOMETRY.unpack(packet.payload), sender, time_s)
        return self._speed_estimate(VISION_SPEED_ESTIMATE.unpack(packet.payload), sender, time_s)

    def _position_delta(self, values: tuple[Any, ...], sender: str, time_s: float) -> list[Reading]:
        """Metres in the time since the last one, forward-right-down; the angles are not looked at."""
        time_us, interval_us, deltas_m, confidence = values[0], values[1], values[5:8], values[8]
        source = f"VISION_POSITION_DELTA {sender}"
        if not self._news(source, time_us):
            return []
        if not confidence > 0.0:
            self._drops["DVL without bottom lock"] += 1
            return []
        if not 0 < interval_us <= INTERVAL_MAX_US:
            self._drops["implausible velocity"] += 1
            return []
        interval_s = interval_us / 1e6
        velocity = (deltas_m[0] / interval_s, deltas_m[1] / interval_s, deltas_m[2] / interval_s)
        if not time_us and self._came_twice(source, velocity, time_s, interval_s):
            return []
        return self._checked(velocity, source, time_us, time_s)

    def _odometry(self, values: tuple[Any, ...], sender: str, time_s: float) -> list[Reading]:
        """Velocity in the frame of the body only. PX4 sends its own estimate in this message: that is no sensor."""
        time_us, velocity, child_frame, estimator, quality = (
            values[0],
            values[8:11],
            values[-4],
            values[-2],
            values[-1],
        )
        source = f"ODOMETRY {sender}"
        if estimator == MAV_ESTIMATOR_TYPE_AUTOPILOT:
            self._drops["autopilot's own odometry"] += 1
        elif child_frame != MAV_FRAME_BODY_FRD:
            self._drops["odometry in another frame"] += 1
        elif quality < 0:
            self._drops["DVL without bottom lock"] += 1
        elif self._news(source, time_us):
            return self._checked(velocity, source, time_us, time_s)
        return []

    def _speed_estimate(self, values: tuple[Any, ...], sender: str, time_s: float) -> list[Reading]:
        """North, east, down by definition: turned back into the frame of the body by the newest attitude."""
        time_us, velocity = values[0], values[1:4]
        source = f"VISION_SPEED_ESTIMATE {sender}"
        if not self._news(source, time_us):
            return []
        attitude = self.attitude
        if attitude is None or time_s - attitude.time_s > ATTITUDE_MAX_AGE_S:
            self._drops["velocity without attitude"] += 1
            return []
        return self._checked(_to_body(velocity, attitude), source, time_us, time_s)

    def _news(self, source: str, time_us: int) -> bool:
        return self._fresh.accepts(source, time_us, ticks_per_s=10**6, bits=64)

    def _came_twice(self, source: str, velocity: Vector, time_s: float, interval_s: float) -> bool:
        """Without a time, the same again at once came by another route; a DVL that is stuck repeats itself later."""
        before_s, before = self._newest.get(source, (-INTERVAL_MAX_US, None))
        twin = velocity == before and time_s - before_s < min(interval_s / 4.0, ROUTES_S)
        if twin:
            self._drops["repeated"] += 1
        else:
            self._newest[source] = (time_s, velocity)
        return twin

    def _checked(self, velocity: Vector, source: str, time_us: int, time_s: float) -> list[Reading]:
        if not all(abs(component) <= VELOCITY_MAX_MPS for component in velocity):  # also for NaN
            self._drops["implausible velocity"] += 1
            return []
        return [BodyVelocity(time_s, time_us / 1e6 if time_us else None, velocity, source)]


def _to_body(velocity: Vector, attitude: Attitude) -> Vector:
    """North-east-down to forward-right-down: about the heading first, then pitch, then roll."""
    north, east, down = velocity
    heading, pitch, roll = attitude.yaw_rad, attitude.pitch_rad, attitude.roll_rad
    ahead = cos(heading) * north + sin(heading) * east
    right = cos(heading) * east - sin(heading) * north
    below = sin(pitch) * ahead + cos(pitch) * down
    return (
        cos(pitch) * ahead - sin(pitch) * down,
        cos(roll) * right + sin(roll) * below,
        cos(roll) * below - sin(roll) * right,
    )
