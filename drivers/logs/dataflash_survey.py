"""What must be known of a dataflash log before its first reading: the time, who wrote it, and whether it was armed.

The time: GPS has the week and the time of week beside the time since boot. The median of their difference is the
clock's offset; it is wrong by what a receiver takes to say its position, 0.1 to 0.3 s. Without a fix (and under water
there is none) nobody knows the time: ArduPilot does not log its own idea of it.

Whether it was armed: ARM (since 4.1) and EV 10 and 11 tell the changes, so the first of them tells how it was before.
A log without any: with LOG_DISARMED 0 only what happens while armed is logged; else the log began at the start of the
autopilot, which is then disarmed, and nothing changed.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import BinaryIO

import numpy as np

from drivers.logs.boot_clock import BY_GPS, BootClock
from drivers.logs.damage import DamageReport
from drivers.logs.dataflash_format import TIME_US, FloatArray, Records
from drivers.logs.dataflash_records import Formats, read_records
from drivers.mavlink.fixes import FIX_3D, FIX_LAST

WANTED = ("GPS", "ARM", "EV", "MSG", "PARM")

EV_ARMED, EV_DISARMED = 10, 11
GPS_EPOCH_S = 315_964_800.0  # 1980-01-06
WEEK_S = 604_800.0
LEAP_SECONDS = 18.0  # since 2017
WEEK_MIN, WEEK_MAX = 1930, 4000  # 2017 to 2056: others are a receiver that does not know it

MAV_TYPE_GENERIC = 0
# first word of the firmware's name
VEHICLE_TYPES = {
    "ArduPlane": 1,
    "ArduCopter": 2,
    "Blimp": 7,
    "ArduRover": 10,
    "Rover": 10,
    "ArduSub": 12,
}
SYSTEM_PARAMETERS = ("SYSID_THISMAV", "MAV_SYSID")
LOG_DISARMED = "LOG_DISARMED"


@dataclass(slots=True)
class Survey:
    """What a log says of itself.

    Attributes:
        clock: of the log.
        system_id: MAVLink system id.
        vehicle_type: MAV_TYPE.
        armed: at the beginning; None: nobody knows.
    """

    clock: BootClock = field(default_factory=BootClock)
    system_id: int = 1
    vehicle_type: int = MAV_TYPE_GENERIC
    armed: bool | None = None


def survey(file: BinaryIO, formats: Formats) -> Survey:
    """Reads a log from where the file stands."""
    found: dict[str, list[Records]] = {name: [] for name in WANTED}
    for part in read_records(file, formats, WANTED, DamageReport()):
        for records in (one for one in part if one.has(TIME_US)):
            found[records.format.name].append(records)
    parameters = _parameters(found["PARM"])
    result = Survey(clock=_clock(found["GPS"]), vehicle_type=_vehicle_type(found["MSG"]))
    system_id = next((parameters[name] for name in SYSTEM_PARAMETERS if name in parameters), 1.0)
    result.system_id = int(system_id) if 1.0 <= system_id <= 255.0 else 1
    changes = [change for name in ("ARM", "EV") for records in found[name] for change in armed_changes(records)]
    if changes:
        result.armed = not min(changes)[1]
    elif LOG_DISARMED in parameters:
        result.armed = parameters[LOG_DISARMED] == 0.0
    return result


def armed_changes(records: Records) -> list[tuple[int, bool]]:
    """(offset, armed from there on) as records of ARM or EV tell it."""
    if records.has("ArmState"):
        told = records.numbers("ArmState") > 0.0
    elif records.has("Id"):
        event = records.integers("Id")
        records = records.part((event == EV_ARMED) | (event == EV_DISARMED))
        told = records.integers("Id") == EV_ARMED
    else:
        return []
    return list(zip(records.offset.tolist(), told.tolist(), strict=True))


def _clock(parts: Iterable[Records]) -> BootClock:
    offsets = [_offsets(records) for records in parts if records.has("Status", "GMS", "GWk")]
    known = np.concatenate(offsets) if offsets else np.empty(0)
    return BootClock(float(np.median(known)), BY_GPS) if len(known) else BootClock()


def _offsets(records: Records) -> FloatArray:
    status, week = records.numbers("Status"), records.numbers("GWk")
    since_s = records.numbers("GMS") * 1e-3
    known = (status >= FIX_3D) & (status <= FIX_LAST) & (since_s < WEEK_S) & (week >= WEEK_MIN) & (week <= WEEK_MAX)
    unix_s = GPS_EPOCH_S + WEEK_S * week + since_s - LEAP_SECONDS
    return unix_s[known] - records.boot_s[known]


def _vehicle_type(parts: Iterable[Records]) -> int:
    for records in parts:
        for text in records.texts("Message") if records.has_texts("Message") else ():
            kind = VEHICLE_TYPES.get(text.partition(" ")[0])
            if kind is not None:
                return kind
    return MAV_TYPE_GENERIC


def _parameters(parts: Iterable[Records]) -> dict[str, float]:
    """The first value of each, which is the one that the log began with."""
    values: dict[str, float] = {}
    for records in parts:
        if records.has("Value") and records.has_texts("Name"):
            for name, value in zip(records.texts("Name"), records.numbers("Value").tolist(), strict=True):
                values.setdefault(name, value)
    return values
