"""What must be known of a PX4 log before its first reading: the time, who wrote it, which topics it has.

The time: GPS has UTC beside the time since boot. The median of their difference is the clock's offset; it is wrong by
what a receiver takes to say its position, 0.1 to 0.3 s.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import BinaryIO

import numpy as np

from drivers.logs.boot_clock import BY_GPS, BootClock
from drivers.logs.damage import DamageReport
from drivers.logs.stamped import credible
from drivers.logs.ulog_segments import SegmentReader
from drivers.logs.ulog_topics import FloatArray, Topic, read_topics
from drivers.mavlink.fixes import FIX_3D, FIX_LAST

GPS = ("vehicle_gps_position", "sensor_gps")
STATUS = "vehicle_status"
UTC_MIN_US = 1_483_228_800_000_000  # 2017: earlier is a receiver that does not know it

MAV_TYPE_GENERIC = 0
ID_MAX = 255


@dataclass(slots=True)
class Survey:
    """What a log says of itself.

    Attributes:
        clock: of the log.
        system_id: MAVLink system id.
        vehicle_type: MAV_TYPE.
        names: of the topics that it has.
    """

    clock: BootClock = field(default_factory=BootClock)
    system_id: int = 1
    vehicle_type: int = MAV_TYPE_GENERIC
    names: set[str] = field(default_factory=set)


def survey(file: BinaryIO) -> Survey:
    """Reads a log from its beginning."""
    result = Survey()
    offsets: dict[str, list[FloatArray]] = {name: [] for name in GPS}
    reader = SegmentReader((*GPS, STATUS), DamageReport())
    for segment in reader.segments(file):
        for topic in read_topics(segment):
            if topic.name in GPS:
                offsets[topic.name].append(_offsets(topic))
            elif result.vehicle_type == MAV_TYPE_GENERIC and topic.has("system_id", "system_type"):
                ids = topic.columns("system_id", "system_type")[0]
                if ((ids >= 0.0) & (ids <= ID_MAX)).all():  # not so for NaN
                    result.system_id, result.vehicle_type = map(int, ids)
    result.names = reader.names()
    for name in GPS:
        known = np.concatenate([*offsets[name], np.empty(0)])
        if len(known):
            result.clock = BootClock(float(np.median(known)), BY_GPS)
            break
    return result


def _offsets(topic: Topic) -> FloatArray:
    if not topic.has("time_utc_usec", "fix_type"):
        return np.empty(0)
    fixed, utc_us = topic.numbers("fix_type"), topic.numbers("time_utc_usec")
    known = (fixed >= FIX_3D) & (fixed <= FIX_LAST) & (utc_us >= UTC_MIN_US) & credible(topic.boot_s)
    offsets: FloatArray = utc_us[known] / 1e6 - topic.boot_s[known]
    return offsets
