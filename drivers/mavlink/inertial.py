"""What inertial units and barometers measure, from unpacked payloads to readings. Values are in wire order.

ArduPilot's RAW_IMU is not raw: it is SCALED_IMU, its first unit, with a finer time; SCALED_IMU2 and SCALED_IMU3 are
its second and third. PX4's HIGHRES_IMU is in SI units. All are specific force and rate in the frame of the body,
forward-right-down, calibrated.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from typing import Any

from drivers.construction import constructor
from drivers.mavlink.formats import HIGHRES_IMU, RAW_IMU, SCALED_IMUS, SCALED_PRESSURES
from drivers.mavlink.freshness import Freshness
from drivers.readings import Inertial, Reading, WaterPressure

STANDARD_GRAVITY_MPS2 = 9.80665
CELSIUS_ZERO_K = 273.15

# Nothing on a vehicle under water is near these, but a unit that is not calibrated or broken may be.
FORCE_MAX_MPS2 = 200.0
RATE_MAX_RADPS = 40.0
SATURATED = 32_767

# xacc to zgyro in HIGHRES_IMU.fields_updated
FORCE_AND_RATE_UPDATED = 0b111111

# from a mountain lake to the deepest trench
PRESSURE_MIN_PA, PRESSURE_MAX_PA = 20_000.0, 130_000_000.0
TEMPERATURE_MIN_C, TEMPERATURE_MAX_C = -50.0, 120.0


_inertial = constructor(Inertial)


class InertialUnits:
    """Inertial units of one autopilot.

    Args:
        drops: counted here by cause.
    """

    def __init__(self, drops: Counter[str]) -> None:
        self._drops = drops
        self._fresh = Freshness(drops)

    def raw(self, values: tuple[Any, ...], time_s: float) -> list[Reading]:
        """RAW_IMU as ArduPilot means it: mG and mrad/s."""
        time_us, counts, unit = values[0], values[1:7], values[10]
        if not self._fresh.accepts((RAW_IMU.message_id, unit), time_us, ticks_per_s=10**6, bits=64):
            return []
        return self._counted("RAW_IMU" + _numbered(unit), time_us / 1e6, counts, time_s)

    def scaled(self, place: int, values: tuple[Any, ...], time_s: float) -> list[Reading]:
        """SCALED_IMU (place 0) to SCALED_IMU3 (2): mG and mrad/s."""
        boot_ms, counts = values[0], values[1:7]
        if not self._fresh.accepts(SCALED_IMUS[place].message_id, boot_ms, ticks_per_s=1000):
            return []
        return self._counted(f"SCALED_IMU{place + 1 if place else ''}", boot_ms / 1000.0, counts, time_s)

    def highres(self, values: tuple[Any, ...], time_s: float) -> list[Reading]:
        """HIGHRES_IMU: m/s^2 and rad/s."""
        time_us, forces, rates, updated, unit = values[0], values[1:4], values[4:7], values[14], values[15]
        if not self._fresh.accepts((HIGHRES_IMU.message_id, unit), time_us, ticks_per_s=10**6, bits=64):
            return []
        if updated & FORCE_AND_RATE_UPDATED != FORCE_AND_RATE_UPDATED:
            self._drops["IMU without news"] += 1
            return []
        return self._checked("HIGHRES_IMU" + _numbered(unit), time_us / 1e6, forces, rates, time_s)

    def _counted(self, source: str, boot_s: float, counts: Sequence[int], time_s: float) -> list[Reading]:
        if not any(counts):  # a unit that is not there: nothing that measures is at rest and in free fall
            self._drops["IMU absent"] += 1
            return []
        if max(map(abs, counts)) >= SATURATED:
            self._drops["implausible IMU"] += 1
            return []
        milli = [_middle(count) / 1000.0 for count in counts]
        forces = [value * STANDARD_GRAVITY_MPS2 for value in milli[:3]]
        return self._checked(source, boot_s, forces, milli[3:], time_s)

    def _checked(
        self, source: str, boot_s: float, forces: Sequence[float], rates: Sequence[float], time_s: float
    ) -> list[Reading]:
        # False for NaN
        if not (
            all(abs(force) <= FORCE_MAX_MPS2 for force in forces) and all(abs(r) <= RATE_MAX_RADPS for r in rates)
        ):
            self._drops["implausible IMU"] += 1
            return []
        force, rate = (forces[0], forces[1], forces[2]), (rates[0], rates[1], rates[2])
        return [_inertial(time_s, boot_s, source, force, rate)]


class Barometers:
    """Barometers of one autopilot, of which some are in the water.

    Args:
        drops: counted here by cause.
    """

    def __init__(self, drops: Counter[str]) -> None:
        self._drops = drops
        self._fresh = Freshness(drops)

    def pressure(self, place: int, values: tuple[Any, ...], time_s: float) -> list[Reading]:
        """SCALED_PRESSURE (place 0) to SCALED_PRESSURE3 (2): hPa, 0.01 degC."""
        boot_ms, hectopascals, _difference, centidegrees = values[:4]
        if not self._fresh.accepts(SCALED_PRESSURES[place].message_id, boot_ms, ticks_per_s=1000):
            return []
        pressure_pa = hectopascals * 100.0
        if not PRESSURE_MIN_PA <= pressure_pa <= PRESSURE_MAX_PA:
            self._drops["implausible pressure"] += 1
            return []
        celsius = centidegrees / 100.0
        kelvin = celsius + CELSIUS_ZERO_K if TEMPERATURE_MIN_C <= celsius <= TEMPERATURE_MAX_C else None
        return [WaterPressure(time_s, boot_ms / 1000.0, place + 1, pressure_pa, kelvin)]


def _middle(count: int) -> float:
    """Autopilots cut the fraction off, towards zero: what was measured lies half a unit further out, on average."""
    return count + math.copysign(0.5, count) if count else 0.0


def _numbered(unit: int) -> str:
    return f" {unit}" if unit else ""
