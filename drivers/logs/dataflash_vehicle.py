"""Attitude and positions of a dataflash log: ATT, POS, GPS, and the estimates of EKF2 (NKF1) and EKF3 (XKF1).

ATT has no rates and POS no velocity: the newest of RATE (else of the first inertial unit) and of the estimate are put
to them, as ATTITUDE and GLOBAL_POSITION_INT have them. Several estimators run side by side; AEKF in ATT says whether
EKF2's or EKF3's are used, PI in NKF4 and XKF4 which of these.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from drivers.logs.boot_clock import BootClock
from drivers.logs.damage import DamageReport
from drivers.logs.dataflash_format import Records
from drivers.logs.plausible import FloatArray, Mask, refuse, within
from drivers.logs.stamped import Newest, Stamped
from drivers.mavlink.fixes import DEPTH_MAX_M, FIX_3D, FIX_LAST
from drivers.mavlink.vehicle import ANGLE_MAX_RAD, POSITION_MAX_M, RATE_MAX_RADPS, VELOCITY_MAX_MPS
from drivers.readings import Attitude, GlobalPosition, LocalPosition, PositionFix

FILTERS = {"NKF1": 2, "XKF1": 3}  # as AEKF counts them
WANTED = ("RATE", "IMU", "NKF4", "XKF4", "ATT", "XKF1", "NKF1", "POS", "GPS")  # in the order in which they are needed
MAX_AGE_S = 0.5


class DataflashVehicle:
    """Attitude and positions.

    Args:
        clock: of the log.
        damage: told what is implausible.
    """

    def __init__(self, clock: BootClock, damage: DamageReport) -> None:
        self._clock = clock
        self._damage = damage
        self._rates = Newest(3)
        self._has_rates = False
        self._velocity = Newest(3)
        self._filter = Newest(1)
        self._core = Newest(1)
        self._default_filter = FILTERS["NKF1"]

    def take(self, records: Records) -> Iterator[Stamped]:
        """Readings of records of one type; of one part of the log, types come in the order of `WANTED`."""
        match records.format.name:
            case "RATE" if records.has("R", "P", "Y"):
                self._has_rates = True
                self._rates.take(records.boot_s, np.radians(records.columns("R", "P", "Y")))
            case "IMU" if not self._has_rates and records.has("I", "GyrX", "GyrY", "GyrZ"):
                first = records.part(records.numbers("I") == 0.0)
                self._rates.take(first.boot_s, first.columns("GyrX", "GyrY", "GyrZ"))
            case "NKF4" | "XKF4" if records.has("PI"):
                self._core.take(records.boot_s, records.columns("PI"))
            case "ATT" if records.has("Roll", "Pitch", "Yaw"):
                yield self._attitudes(records)
            case "NKF1" | "XKF1" if records.has("PN", "PE", "PD", "VN", "VE", "VD"):
                yield self._local_positions(self._of_primary(records))
            case "POS" if records.has("Lat", "Lng", "Alt"):
                yield self._global_positions(records)
            case "GPS" if records.has("Status", "Lat", "Lng", "Alt"):
                yield self._fixes(records)

    def _attitudes(self, records: Records) -> Stamped:
        if records.has("AEKF"):
            self._filter.take(records.boot_s, records.columns("AEKF"))
        angles = np.radians(records.columns("Roll", "Pitch", "Yaw"))
        angles[:, 2] = np.remainder(angles[:, 2] + np.pi, 2.0 * np.pi) - np.pi  # 0 to 360 in the log
        rates = self._rates.at(records.boot_s, MAX_AGE_S)
        unknown = np.isnan(rates[:, 0])
        good = within(angles, ANGLE_MAX_RAD) & within(rates, RATE_MAX_RADPS)
        self._refuse(records, unknown, "attitude without rates")
        self._refuse(records, ~good & ~unknown, "implausible attitude")
        kept = records.part(good)
        rows = np.column_stack([self._time_s(kept), angles[good], rates[good], kept.boot_s])
        return Stamped(rows[:, 0], kept.offset, [Attitude(*row) for row in rows.tolist()])

    def _of_primary(self, records: Records) -> Records:
        boot_s, mine = records.boot_s, FILTERS[records.format.name]
        self._default_filter = max(self._default_filter, mine)
        used = np.nan_to_num(self._filter.at(boot_s)[:, 0], nan=self._default_filter) == mine
        if records.has("C"):
            used &= records.numbers("C") == np.nan_to_num(self._core.at(boot_s)[:, 0])
        return records.part(used)

    def _local_positions(self, records: Records) -> Stamped:
        position, velocity = records.columns("PN", "PE", "PD"), records.columns("VN", "VE", "VD")
        good = within(position, POSITION_MAX_M) & within(velocity, VELOCITY_MAX_MPS)
        self._refuse(records, ~good, "implausible local position")
        kept, position, velocity = records.part(good), position[good], velocity[good]
        self._velocity.take(kept.boot_s, velocity)
        time_s = self._time_s(kept)
        rows = zip(time_s.tolist(), position.tolist(), velocity.tolist(), strict=True)
        readings = [LocalPosition(at_s, (n, e, d), (vn, ve, vd)) for at_s, (n, e, d), (vn, ve, vd) in rows]
        return Stamped(time_s, kept.offset, readings)

    def _global_positions(self, records: Records) -> Stamped:
        place, depth_m = records.columns("Lat", "Lng"), -records.numbers("Alt")
        velocity = self._velocity.at(records.boot_s, MAX_AGE_S)
        unknown = _nowhere(place)
        moving = ~np.isnan(velocity[:, 0])
        good = _on_earth(place) & (np.abs(depth_m) <= POSITION_MAX_M) & moving
        self._refuse(records, unknown, "no global position")
        self._refuse(records, ~moving & ~unknown, "global position without velocity")
        self._refuse(records, ~good & moving & ~unknown, "implausible global position")
        good &= ~unknown
        kept = records.part(good)
        rows = np.column_stack([self._time_s(kept), np.radians(place[good]), depth_m[good], velocity[good]])
        readings = [
            GlobalPosition(at_s, latitude, longitude, depth, (north, east, down), boot_s)
            for (at_s, latitude, longitude, depth, north, east, down), boot_s in zip(
                rows.tolist(), kept.boot_s.tolist(), strict=True
            )
        ]
        return Stamped(rows[:, 0], kept.offset, readings)

    def _fixes(self, records: Records) -> Stamped:
        """Of the first receiver, as GPS_RAW_INT has it; how accurate it is stands elsewhere."""
        if records.has("I"):
            records = records.part(records.numbers("I") == 0.0)
        status, place = records.numbers("Status"), records.columns("Lat", "Lng")
        fixed = (status >= FIX_3D) & (status <= FIX_LAST) & ~_nowhere(place)
        self._refuse(records, ~fixed, "no position fix")
        self._refuse(records, fixed & ~_on_earth(place), "implausible position fix")
        good = fixed & _on_earth(place)
        kept = records.part(good)
        time_s, places = self._time_s(kept), np.radians(place[good]).tolist()
        readings = [
            PositionFix(at_s, latitude, longitude, depth if abs(depth) <= DEPTH_MAX_M else None, None, "GPS_RAW_INT")
            for at_s, (latitude, longitude), depth in zip(
                time_s.tolist(), places, (-kept.numbers("Alt")).tolist(), strict=True
            )
        ]
        return Stamped(time_s, kept.offset, readings)

    def _time_s(self, records: Records) -> FloatArray:
        return records.boot_s + self._clock.offset_s

    def _refuse(self, records: Records, refused: Mask, cause: str) -> None:
        refuse(self._damage, records.offset, refused, cause)


def _on_earth(place: FloatArray) -> Mask:
    good: Mask = np.logical_and.reduce(np.abs(place) <= (90.0, 180.0), axis=1)
    return good


def _nowhere(place: FloatArray) -> Mask:
    """What senders say before they know."""
    nowhere: Mask = np.logical_and.reduce(place == 0.0, axis=1)
    return nowhere
