"""Navigation sensors of a dataflash log: IMU, BARO, and VISO, which is what a DVL said in VISION_POSITION_DELTA.

Sources are named as the message that has the same on the link: the first inertial unit is RAW_IMU's.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from drivers.logs.boot_clock import BootClock
from drivers.logs.damage import DamageReport
from drivers.logs.dataflash_format import Records
from drivers.logs.plausible import FloatArray, Mask, optional, refuse, within
from drivers.logs.stamped import Stamped
from drivers.mavlink.inertial import (
    CELSIUS_ZERO_K,
    FORCE_MAX_MPS2,
    PRESSURE_MAX_PA,
    PRESSURE_MIN_PA,
    RATE_MAX_RADPS,
    TEMPERATURE_MAX_C,
    TEMPERATURE_MIN_C,
)
from drivers.mavlink.velocities import INTERVAL_MAX_US, VELOCITY_MAX_MPS
from drivers.readings import BodyVelocity, Inertial, WaterPressure

WANTED = ("IMU", "BARO", "VISO")
UNITS = ("RAW_IMU", "SCALED_IMU2", "SCALED_IMU3")
BAROMETERS = 3
DVL = "VISION_POSITION_DELTA dataflash"
INTERVAL_MAX_S = INTERVAL_MAX_US * 1e-6


class DataflashSensors:
    """Inertial units, barometers, DVL.

    Args:
        clock: of the log.
        damage: told what is implausible.
    """

    def __init__(self, clock: BootClock, damage: DamageReport) -> None:
        self._clock = clock
        self._damage = damage

    def take(self, records: Records) -> Iterator[Stamped]:
        """Readings of records of one type, one of `WANTED`."""
        match records.format.name:
            case "IMU" if records.has("I", "GyrX", "GyrY", "GyrZ", "AccX", "AccY", "AccZ"):
                for instance, source in enumerate(UNITS):
                    yield self._inertial(records.part(records.numbers("I") == instance), source)
            case "BARO" if records.has("Press"):
                yield self._pressures(records)
            case "VISO" if records.has("dt", "PosDX", "PosDY", "PosDZ", "conf"):
                yield self._velocities(records)

    def _inertial(self, records: Records, source: str) -> Stamped:
        forces, rates = records.columns("AccX", "AccY", "AccZ"), records.columns("GyrX", "GyrY", "GyrZ")
        good = within(forces, FORCE_MAX_MPS2) & within(rates, RATE_MAX_RADPS)
        self._refuse(records, ~good, "implausible IMU")
        kept, forces, rates = records.part(good), forces[good], rates[good]
        boot_s = kept.boot_s
        time_s = boot_s + self._clock.offset_s
        readings = [
            Inertial(at_s, since_s, source, (force[0], force[1], force[2]), (rate[0], rate[1], rate[2]))
            for at_s, since_s, force, rate in zip(
                time_s.tolist(), boot_s.tolist(), forces.tolist(), rates.tolist(), strict=True
            )
        ]
        return Stamped(time_s, kept.offset, readings)

    def _pressures(self, records: Records) -> Stamped:
        pressure_pa = records.numbers("Press")
        instance = records.numbers("I") if records.has("I") else np.zeros(len(records))
        known = instance < BAROMETERS
        if records.has("Health"):
            known &= records.numbers("Health") > 0.0
        good = (pressure_pa >= PRESSURE_MIN_PA) & (pressure_pa <= PRESSURE_MAX_PA)
        self._refuse(records, ~known, "barometer not healthy")
        self._refuse(records, known & ~good, "implausible pressure")
        good &= known
        kept = records.part(good)
        boot_s, kelvin = kept.boot_s, _kelvin(kept)
        time_s = boot_s + self._clock.offset_s
        columns = (time_s, boot_s, (instance[good] + 1.0).astype(np.int64), pressure_pa[good])
        readings = list(map(WaterPressure, *(column.tolist() for column in columns), optional(kelvin)))
        return Stamped(time_s, kept.offset, readings)

    def _velocities(self, records: Records) -> Stamped:
        """Metres forward, right, down in `dt` seconds, whatever FMTU says of it; no confidence: no bottom lock."""
        interval_s, deltas_m = records.numbers("dt"), records.columns("PosDX", "PosDY", "PosDZ")
        lost = ~(records.numbers("conf") > 0.0)
        timed = (interval_s > 0.0) & (interval_s <= INTERVAL_MAX_S)
        velocity = np.full(deltas_m.shape, np.nan)
        np.divide(deltas_m, interval_s[:, np.newaxis], out=velocity, where=timed[:, np.newaxis])
        good = within(velocity, VELOCITY_MAX_MPS) & ~lost
        self._refuse(records, lost, "DVL without bottom lock")
        self._refuse(records, ~good & ~lost, "implausible velocity")
        kept = records.part(good)
        time_s = kept.boot_s + self._clock.offset_s
        readings = [
            BodyVelocity(at_s, None, (ahead, right, down), DVL)
            for at_s, (ahead, right, down) in zip(time_s.tolist(), velocity[good].tolist(), strict=True)
        ]
        return Stamped(time_s, kept.offset, readings)

    def _refuse(self, records: Records, refused: Mask, cause: str) -> None:
        refuse(self._damage, records.offset, refused, cause)


def _kelvin(records: Records) -> FloatArray:
    if not records.has("Temp"):
        return np.full(len(records), np.nan)
    celsius = records.numbers("Temp")
    known = (celsius >= TEMPERATURE_MIN_C) & (celsius <= TEMPERATURE_MAX_C)
    return np.where(known, celsius + CELSIUS_ZERO_K, np.nan)
