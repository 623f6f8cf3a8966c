"""ArduPilot dataflash logs (.BIN) to readings.

What the autopilot would have said on its link, it has written down: the sources of readings are named as the
messages that carry the same, and a configuration for the link holds for the log. HEARTBEATs are made from ARM, EV
and MODE (see `heartbeats`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import BinaryIO

import numpy as np

from drivers.logs import dataflash_sensors, dataflash_thrusters, dataflash_vehicle
from drivers.logs.boot_clock import BootClock
from drivers.logs.damage import DamageReport
from drivers.logs.dataflash_format import HEAD, TIME_US, Records
from drivers.logs.dataflash_records import Formats, read_formats, read_records
from drivers.logs.dataflash_sensors import DataflashSensors
from drivers.logs.dataflash_survey import Survey, armed_changes, survey
from drivers.logs.dataflash_thrusters import DataflashThrusters
from drivers.logs.dataflash_vehicle import DataflashVehicle
from drivers.logs.heartbeats import Heartbeats, StateChange
from drivers.logs.kinds import HEAD_BYTES, looks_like
from drivers.logs.plausible import IndexArray, Mask, refuse
from drivers.logs.stamped import DISORDER_S, Stamped, TimeOrder, credible, reached_s
from drivers.mavlink.thrusters import MavlinkThruster
from drivers.readings import Reading

MAV_AUTOPILOT_ARDUPILOT = 3
STATES = ("ARM", "EV", "MODE")
STAMPS_KEPT = 2  # of the part before, to judge the first stamps of the next by


def read_dataflash(
    path: Path, thrusters: Sequence[MavlinkThruster], damage: DamageReport, navigation: bool = False
) -> Iterator[list[Reading]]:
    """Readings of a dataflash log, in the order of their times.

    Args:
        path: of the log.
        thrusters: where commands and speeds are found, as on the link.
        damage: told what was passed over, by its offset in the log.
        navigation: True where inertial units, water pressure and DVL are wanted, too.

    Returns:
        Batches of readings. `time_s` is by `dataflash_clock`.

    Raises:
        OSError: the file cannot be read.
        ValueError: it is no dataflash log.
    """
    with path.open("rb") as file:
        formats = _formats(path, file)
        yield from _Reader(_rewound(file), formats, thrusters, damage, navigation).batches()


def dataflash_clock(path: Path) -> BootClock:
    """The clock that the times of `read_dataflash` are by: unix time by GPS, or that since boot.

    Raises:
        OSError: the file cannot be read.
        ValueError: it is no dataflash log.
    """
    with path.open("rb") as file:
        formats = _formats(path, file)
        return survey(_rewound(file), formats).clock


def _formats(path: Path, file: BinaryIO) -> Formats:
    formats = read_formats(file)
    if not formats:
        head = _rewound(file).read(HEAD_BYTES)
        seen = "one without a whole FMT record" if head.startswith(HEAD) else looks_like(head)
        raise ValueError(f"{path}: want an ArduPilot dataflash log (.BIN), this is {seen}")
    return formats


def _rewound(file: BinaryIO) -> BinaryIO:
    file.seek(0)
    return file


class _Reader:
    """One log, from its beginning."""

    def __init__(
        self,
        file: BinaryIO,
        formats: Formats,
        thrusters: Sequence[MavlinkThruster],
        damage: DamageReport,
        navigation: bool,
    ) -> None:
        known: Survey = survey(file, formats)
        self._file = _rewound(file)
        self._formats = formats
        self._damage = damage
        self._offset_s = known.clock.offset_s
        self._thrusters = DataflashThrusters(thrusters, known.clock, damage)
        self._vehicle = DataflashVehicle(known.clock, damage)
        self._sensors = DataflashSensors(known.clock, damage) if navigation else None
        self._heartbeats = Heartbeats(known.system_id, MAV_AUTOPILOT_ARDUPILOT, known.vehicle_type, known.armed)
        self._order = TimeOrder(damage)
        self._stamps_s = np.empty(0)

    def batches(self) -> Iterator[list[Reading]]:
        sensors = dataflash_sensors.WANTED if self._sensors is not None else ()
        wanted = {*STATES, *dataflash_thrusters.WANTED, *dataflash_vehicle.WANTED, *sensors}
        for part in read_records(self._file, self._formats, wanted, self._damage):
            yield self._batch({one.format.name: one for one in self._steady(part)})
        yield self._order.rest()

    def _batch(self, part: dict[str, Records]) -> list[Reading]:
        boot_s = np.concatenate([np.empty(0), *(one.boot_s for one in part.values())])
        if not len(boot_s):
            return []
        until_s = reached_s(boot_s) + self._offset_s
        stamped = [*self._stamped(part), self._heartbeats.take(self._changes(part), until_s)]
        return self._order.take(stamped, until_s - DISORDER_S)

    def _stamped(self, part: dict[str, Records]) -> Iterator[Stamped]:
        for name in dataflash_vehicle.WANTED:
            if name in part:
                yield from self._vehicle.take(part[name])
        for name, records in part.items():
            if name in dataflash_thrusters.WANTED:
                yield from self._thrusters.take(records)
            if self._sensors is not None and name in dataflash_sensors.WANTED:
                yield from self._sensors.take(records)

    def _changes(self, part: dict[str, Records]) -> list[StateChange]:
        changes = []
        for name in STATES:
            if name not in part:
                continue
            records = part[name]
            time_s = dict(zip(records.offset.tolist(), (records.boot_s + self._offset_s).tolist(), strict=True))
            changes += [StateChange(time_s[place], place, armed=armed) for place, armed in armed_changes(records)]
            changes += [StateChange(time_s[place], place, custom_mode=mode) for place, mode in _modes(records)]
        return changes

    def _steady(self, part: Sequence[Records]) -> Iterator[Records]:
        """Without the records whose stamps are damaged."""
        timed = [one for one in part if one.has(TIME_US) and len(one)]
        if not timed:
            return
        offset: IndexArray = np.concatenate([one.offset for one in timed])
        order = np.argsort(offset)
        boot_s = np.concatenate([one.boot_s for one in timed])[order]
        kept = len(self._stamps_s)
        fits: Mask = np.empty(len(offset), dtype=np.bool_)
        fits[order] = credible(np.concatenate([self._stamps_s, boot_s]))[kept:]
        refuse(self._damage, offset, ~fits, "implausible time")
        self._stamps_s = boot_s[-STAMPS_KEPT:]
        begin = 0
        for one in timed:
            yield one.part(fits[begin : begin + len(one)])
            begin += len(one)


def _modes(records: Records) -> list[tuple[int, int]]:
    """(offset, mode as HEARTBEAT.custom_mode has it), as records of MODE tell it."""
    if not records.has("Mode"):
        return []
    return list(zip(records.offset.tolist(), records.integers("Mode").tolist(), strict=True))
