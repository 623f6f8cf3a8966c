"""What positioning systems say, from unpacked payloads to readings. Values are in wire order.

GPS_INPUT is what a positioning system tells the autopilot: a USBL or short-baseline system by way of its BlueOS
extension, which speaks as a component of its own (Water Linked's as 220). GPS_RAW_INT is what the autopilot's own
receiver said, or the autopilot's echo of GPS_INPUT.
"""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

from drivers.construction import constructor
from drivers.mavlink.formats import GPS_INPUT, GPS_RAW_INT
from drivers.mavlink.freshness import Freshness
from drivers.mavlink.vehicle import LATITUDE_MAX_E7, LONGITUDE_MAX_E7
from drivers.readings import PositionFix, Reading

# GPS_FIX_TYPE. Depth comes from a pressure sensor, so an acoustic fix may well call itself 2D; a receiver that has to
# guess its altitude (2D) is off by hundreds of metres.
FIX_2D, FIX_3D, FIX_LAST = 2, 3, 8
IGNORE_ALTITUDE, IGNORE_HORIZONTAL_ACCURACY = 1, 64  # GPS_INPUT_IGNORE_FLAGS

DEPTH_MAX_M = 12_000.0  # deeper than any trench, and either way: there are lakes high above the sea
ACCURACY_MAX_M = 10_000.0


_position_fix = constructor(PositionFix)


class PositionFixes:
    """Fixes from all positioning systems of one vehicle.

    Args:
        drops: counted here by cause.
    """

    def __init__(self, drops: Counter[str]) -> None:
        self._drops = drops
        self._fresh = Freshness(drops)

    def gps_input(self, component_id: int, values: tuple[Any, ...], time_s: float) -> list[Reading]:
        """GPS_INPUT of a component: 1e-7 degrees, metres."""
        time_us, _week_ms, latitude, longitude, altitude_m = values[:5]
        accuracy_m, _vertical_m, ignored, _week, gps_id, fix_type = values[11:17]
        if not self._fresh.accepts((GPS_INPUT.message_id, component_id, gps_id), time_us, ticks_per_s=10**6, bits=64):
            return []
        return self._fix(
            time_s,
            (latitude, longitude),
            FIX_2D <= fix_type <= FIX_LAST,
            depth_m=None if ignored & IGNORE_ALTITUDE else -altitude_m,
            accuracy_m=None if ignored & IGNORE_HORIZONTAL_ACCURACY else accuracy_m,
            source=f"GPS_INPUT {component_id}.{gps_id}",
        )

    def gps_raw(self, values: tuple[Any, ...], time_s: float) -> list[Reading]:
        """GPS_RAW_INT: 1e-7 degrees, mm. Its time is that of the last fix: an echo of what was heard is no news."""
        time_us, latitude, longitude, altitude_mm = values[:4]
        fix_type, accuracy_mm = values[8], values[11]
        if not self._fresh.accepts(GPS_RAW_INT.message_id, time_us, ticks_per_s=10**6, bits=64):
            return []
        return self._fix(
            time_s,
            (latitude, longitude),
            FIX_3D <= fix_type <= FIX_LAST,
            depth_m=-altitude_mm / 1000.0,
            accuracy_m=accuracy_mm / 1000.0,
            source="GPS_RAW_INT",
        )

    def _fix(
        self,
        time_s: float,
        place_e7: tuple[int, int],
        fixed: bool,
        *,
        depth_m: float | None,
        accuracy_m: float | None,
        source: str,
    ) -> list[Reading]:
        latitude, longitude = place_e7
        if not fixed or (latitude == 0 and longitude == 0):  # what senders say before they know, whatever the type
            self._drops["no position fix"] += 1
            return []
        if abs(latitude) > LATITUDE_MAX_E7 or abs(longitude) > LONGITUDE_MAX_E7:
            self._drops["implausible position fix"] += 1
            return []
        place = (math.radians(latitude * 1e-7), math.radians(longitude * 1e-7))
        depth_m = depth_m if depth_m is not None and abs(depth_m) <= DEPTH_MAX_M else None
        if accuracy_m is not None and not 0.0 < accuracy_m <= ACCURACY_MAX_M:
            accuracy_m = None  # 0 and 65535 are how senders say that they do not know
        return [_position_fix(time_s, *place, depth_m, accuracy_m, source)]
