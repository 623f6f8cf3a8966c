"""PX4 logs (.ulg) to readings.

As with dataflash logs, a configuration for the link holds for the log. HEARTBEATs are made from vehicle_status (see
`heartbeats`), with modes as PX4 puts them into HEARTBEAT.custom_mode.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import BinaryIO

import numpy as np

from drivers.logs import ulog_thrusters, ulog_vehicle
from drivers.logs.boot_clock import BootClock
from drivers.logs.damage import DamageReport
from drivers.logs.heartbeats import Heartbeats, StateChange
from drivers.logs.kinds import HEAD_BYTES, looks_like
from drivers.logs.plausible import refuse_at
from drivers.logs.stamped import DISORDER_S, Stamped, TimeOrder, credible, reached_s
from drivers.logs.ulog_format import MAGIC
from drivers.logs.ulog_segments import SegmentReader, UnreadableLogError
from drivers.logs.ulog_survey import STATUS, Survey, survey
from drivers.logs.ulog_thrusters import UlogThrusters
from drivers.logs.ulog_topics import Topic, read_topics
from drivers.logs.ulog_vehicle import UlogVehicle
from drivers.mavlink.thrusters import MavlinkThruster
from drivers.readings import Reading

MAV_AUTOPILOT_PX4 = 12
ARMED = 2  # vehicle_status.arming_state

# nav_state of vehicle_status: main and sub mode of HEARTBEAT.custom_mode (PX4, commander/px4_custom_mode.h)
_MODES = {
    0: (1, 0),  # MANUAL
    1: (2, 0),  # ALTCTL
    2: (3, 0),  # POSCTL
    3: (4, 4),  # AUTO_MISSION
    4: (4, 3),  # AUTO_LOITER
    5: (4, 5),  # AUTO_RTL
    10: (5, 0),  # ACRO
    12: (4, 6),  # DESCEND
    13: (1, 0),  # TERMINATION
    14: (6, 0),  # OFFBOARD
    15: (7, 0),  # STAB
    17: (4, 2),  # AUTO_TAKEOFF
    18: (4, 6),  # AUTO_LAND
    19: (4, 8),  # AUTO_FOLLOW_TARGET
    20: (4, 9),  # AUTO_PRECLAND
    21: (3, 1),  # ORBIT
}


def read_ulog(
    path: Path, thrusters: Sequence[MavlinkThruster], damage: DamageReport, navigation: bool = False
) -> Iterator[list[Reading]]:
    """Readings of a PX4 log, in the order of their times.

    Args:
        path: of the log.
        thrusters: where commands and speeds are found, as on the link.
        damage: told what was passed over, by its offset in the log, or its time since the autopilot's start.
        navigation: True where inertial unit and DVL are wanted, too.

    Returns:
        Batches of readings. `time_s` is by `ulog_clock`.

    Raises:
        OSError: the file cannot be read.
        ValueError: it is no PX4 log, or a newer one that nobody here knows how to read.
    """
    with path.open("rb") as file:
        yield from _Reader(_surveyed(path, file), thrusters, damage, navigation).batches(_rewound(file))


def ulog_clock(path: Path) -> BootClock:
    """The clock that the times of `read_ulog` are by: unix time by GPS, or that since boot.

    Raises:
        OSError, ValueError: as `read_ulog`.
    """
    with path.open("rb") as file:
        return _surveyed(path, file).clock


def _surveyed(path: Path, file: BinaryIO) -> Survey:
    head = file.read(HEAD_BYTES)
    if not head.startswith(MAGIC):
        raise ValueError(f"{path}: want a PX4 log (.ulg), this is {looks_like(head)}")
    try:
        return survey(_rewound(file))
    except UnreadableLogError as error:
        raise ValueError(f"{path}: {error}") from error


def _rewound(file: BinaryIO) -> BinaryIO:
    file.seek(0)
    return file


class _Reader:
    """One log."""

    def __init__(
        self, known: Survey, thrusters: Sequence[MavlinkThruster], damage: DamageReport, navigation: bool
    ) -> None:
        self._damage = damage
        self._offset_s = known.clock.offset_s
        self._unwanted = {ulog_thrusters.MOTORS} if ulog_thrusters.OUTPUTS in known.names else set()
        self._thrusters = UlogThrusters(thrusters, known.clock, damage)
        has_rates = "vehicle_angular_velocity" in known.names
        self._vehicle = UlogVehicle(known.clock, damage, navigation, has_rates)
        self._heartbeats = Heartbeats(known.system_id, MAV_AUTOPILOT_PX4, known.vehicle_type)
        self._order = TimeOrder(damage)

    def batches(self, file: BinaryIO) -> Iterator[list[Reading]]:
        wanted = {*ulog_thrusters.WANTED, *ulog_vehicle.WANTED, STATUS} - self._unwanted
        for segment in SegmentReader(wanted, self._damage).segments(file):
            self._damage.bytes_read = file.tell()
            yield self._batch([self._steady(topic) for topic in read_topics(segment)])
        yield self._order.rest()

    def _batch(self, topics: Sequence[Topic]) -> list[Reading]:
        boot_s = np.concatenate([np.empty(0), *(topic.boot_s for topic in topics)])
        if not len(boot_s):
            return []
        until_s = reached_s(boot_s) + self._offset_s
        stamped = [*self._stamped(topics), self._heartbeats.take(self._changes(topics), until_s)]
        return self._order.take(stamped, until_s - DISORDER_S)

    def _stamped(self, topics: Sequence[Topic]) -> Iterator[Stamped]:
        for name in ulog_vehicle.WANTED:
            for topic in topics:
                if topic.name == name and topic.instance == 0 and len(topic):
                    yield from self._vehicle.take(topic)
        for topic in topics:
            if topic.name in ulog_thrusters.WANTED and len(topic):
                yield from self._thrusters.take(topic)

    def _changes(self, topics: Iterable[Topic]) -> list[StateChange]:
        return [
            change
            for topic in topics
            if topic.name == STATUS and topic.has("arming_state", "nav_state")
            for change in _states(topic, self._offset_s)
        ]

    def _steady(self, topic: Topic) -> Topic:
        """Without the messages whose times are damaged."""
        fits = credible(topic.boot_s)
        refuse_at(self._damage, topic.boot_s, ~fits, "implausible time")
        return topic.part(fits)


def _states(topic: Topic, offset_s: float) -> Iterator[StateChange]:
    failsafe = topic.fields.get("failsafe", np.zeros(len(topic), dtype=np.bool_))
    columns = (topic.boot_s + offset_s, topic.fields["arming_state"], topic.fields["nav_state"], failsafe)
    for at_s, arming, state, failing in zip(*(column.tolist() for column in columns), strict=True):
        main, sub = _MODES.get(state, (0, 0))
        yield StateChange(at_s, 0, arming == ARMED, main << 16 | sub << 24, bool(failing))
