"""ESC telemetry and RPM sensors, from unpacked payloads to readings. Values are in wire order."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from typing import Any

from drivers.construction import constructor
from drivers.mavlink.esc_groups import EscGroups
from drivers.mavlink.formats import ESC_INFO, ESC_STATUS
from drivers.mavlink.freshness import Freshness
from drivers.mavlink.thrusters import (
    CELSIUS_ZERO_K,
    CURRENT_MAX_A,
    SPEED_MAX_RPM,
    TEMPERATURE_MAX_C,
    VOLTAGE_MAX_V,
    MavlinkThruster,
)
from drivers.readings import Reading, ThrusterReport

ESCS_PER_MESSAGE = 4
TEMPERATURE_UNKNOWN = 32_767  # ESC_INFO

COPIED = "ESC group with the values of the first"
# ESC_INFO.failure_flags, bit by bit: MAVLink's ESC_FAILURE_FLAGS, and what PX4 sends beyond them (EscReport.msg)
FAILURES = (
    "over current",
    "over voltage",
    "over temperature",
    "over rpm",
    "inconsistent command",
    "motor stuck",
    "generic failure",
    "motor is warm",
    "ESC is warm",
    "ESC over temperature",
)

_report = constructor(ThrusterReport)


class ThrusterSpeeds:
    """Speeds of the configured thrusters, and what else their ESCs tell.

    ArduPilot fills ESC_TELEMETRY_* with zeros for an ESC that never reported, or that fell silent beside others, and
    with the last values while nothing new came. None of these is a measurement: an ESC counts as absent until it said
    something, and one whose packet counter stands still has nothing new to say.

    Args:
        thrusters: where to look for what.
        drops: counted here by cause.
    """

    def __init__(self, thrusters: Sequence[MavlinkThruster], drops: Counter[str]) -> None:
        self._drops = drops
        self._fresh = Freshness(drops)
        self._status_groups, self._info_groups = EscGroups(), EscGroups()
        self._by_esc = {thruster.esc_index: thruster for thruster in thrusters if thruster.esc_index is not None}
        self._by_sensor = {thruster.rpm_sensor: thruster for thruster in thrusters if thruster.rpm_sensor is not None}
        self._seen: set[int] = set()  # ESCs that said something once
        self._meters: set[int] = set()  # ESCs that measured a current once: for the others 0 A means nothing
        self._last: dict[int, tuple[int, int]] = {}  # per ESC: packet counter and speed of ESC_TELEMETRY_*

    def esc_telemetry(self, group: int, values: tuple[Any, ...], time_s: float) -> list[Reading]:
        """ESC_TELEMETRY_1_TO_4 (group 0) to _29_TO_32 (group 7): cV, cA, mAh, rpm without a sign, count, degC."""
        readings: list[Reading] = []
        for place in range(ESCS_PER_MESSAGE):
            thruster = self._by_esc.get(group * ESCS_PER_MESSAGE + place)
            if thruster is None:
                continue
            centivolts, centiamperes, _charge, rpm, count, celsius = values[place::ESCS_PER_MESSAGE]
            if self._reports(thruster, (centivolts, rpm, count, celsius)) and self._advanced(thruster, count, rpm):
                kelvin = celsius + CELSIUS_ZERO_K if 0 < celsius < TEMPERATURE_MAX_C else None
                readings.append(self._report(thruster, rpm, centivolts / 100.0, centiamperes / 100.0, kelvin, time_s))
        return readings

    def esc_status(self, values: tuple[Any, ...], time_s: float) -> list[Reading]:
        """PX4's ESC_STATUS: four ESCs from `index` on, rpm with a sign, V, A."""
        time_us, index = values[0], values[13]
        if not self._fresh.accepts((ESC_STATUS.message_id, index), time_us, ticks_per_s=1_000_000, bits=64):
            return []
        speeds = values[1:5]
        if self._status_groups.is_copy(index, time_us, values[1:13], telling=any(speeds)):
            self._drops[COPIED] += 1
            return []
        readings: list[Reading] = []
        for place in range(ESCS_PER_MESSAGE):
            thruster = self._by_esc.get(index + place)
            rpm, voltage_v, current_a = values[1 + place], values[5 + place], values[9 + place]
            if thruster is not None and self._reports(thruster, (rpm, voltage_v, current_a)):
                readings.append(self._report(thruster, thruster.directed(rpm), voltage_v, current_a, None, time_s))
        return readings

    def esc_info(self, values: tuple[Any, ...], time_s: float) -> list[Reading]:
        """PX4's ESC_INFO: errors, failures and temperature (0.01 degC, 32767 = not known) of the same four ESCs."""
        time_us, index, count = values[0], values[14], values[15]
        errors, failures, temperatures = values[1:5], values[6:10], values[10:14]
        if not self._fresh.accepts((ESC_INFO.message_id, index), time_us, ticks_per_s=1_000_000, bits=64):
            return []
        measured = any(0 != temperature != TEMPERATURE_UNKNOWN for temperature in temperatures)
        if self._info_groups.is_copy(index, time_us, (*errors, *failures, *temperatures), telling=measured):
            self._drops[COPIED] += 1
            return []
        readings: list[Reading] = []
        for place in range(ESCS_PER_MESSAGE):
            thruster = self._by_esc.get(index + place)
            if thruster is not None and index + place < count:
                self._count_failures(thruster.thruster, failures[place])
                kelvin = _kelvin(temperatures[place])
                readings.append(_report(time_s, thruster.thruster, None, None, None, kelvin, errors[place]))
        return readings

    def rpm(self, values: tuple[Any, ...], time_s: float) -> list[Reading]:
        """RPM: two sensors; negative is ArduPilot's word for a sensor without a signal."""
        readings: list[Reading] = []
        for sensor, thruster in self._by_sensor.items():
            speed_rpm = values[sensor - 1]
            if speed_rpm < 0.0:
                self._drops["RPM sensor without a signal"] += 1
            elif (checked_rpm := self._speed(speed_rpm)) is not None:
                readings.append(_report(time_s, thruster.thruster, checked_rpm, None, None, None, None))
        return readings

    def _reports(self, thruster: MavlinkThruster, fields: tuple[float, ...]) -> bool:
        if thruster.thruster not in self._seen and any(field and not math.isnan(field) for field in fields):
            self._seen.add(thruster.thruster)
        if thruster.thruster not in self._seen:
            self._drops["ESC absent"] += 1
        return thruster.thruster in self._seen

    def _advanced(self, thruster: MavlinkThruster, count: int, rpm: int) -> bool:
        """Whether there is news: the counter moved, or a speed came in by a source that is not counted (DShot)."""
        last_count, last_rpm = self._last.get(thruster.thruster, (0, 0))
        self._last[thruster.thruster] = (count, rpm)
        stands_still = count != 0 and count == last_count and rpm in (0, last_rpm)
        if stands_still:
            self._drops["repeated"] += 1
        return not stands_still

    def _report(
        self,
        thruster: MavlinkThruster,
        rpm: float,
        voltage_v: float,
        current_a: float,
        temperature_k: float | None,
        time_s: float,
    ) -> ThrusterReport:
        number = thruster.thruster
        if 0.0 < abs(current_a) < CURRENT_MAX_A:
            self._meters.add(number)
        metered = number in self._meters and abs(current_a) < CURRENT_MAX_A
        return _report(
            time_s,
            number,
            self._speed(rpm),
            voltage_v if 0.0 < voltage_v < VOLTAGE_MAX_V else None,
            current_a if metered else None,
            temperature_k,
            None,
        )

    def _count_failures(self, thruster: int, failures: int) -> None:
        for place, failure in enumerate(FAILURES):
            if failures >> place & 1:
                self._drops[f"ESC of thruster {thruster} says: {failure}"] += 1

    def _speed(self, rpm: float) -> float | None:
        if abs(rpm) <= SPEED_MAX_RPM:  # False for NaN
            return float(rpm)
        self._drops["implausible speed"] += 1
        return None


def _kelvin(centidegrees: int) -> float | None:
    return None if abs(centidegrees) >= TEMPERATURE_UNKNOWN else centidegrees / 100.0 + CELSIUS_ZERO_K
