"""Thruster commands and ESC telemetry, from unpacked payloads to readings. Values are in wire order."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from drivers.command import CommandScale
from drivers.mavlink.formats import ESC_INFO, ESC_STATUS, SERVO_OUTPUT_RAW
from drivers.mavlink.freshness import Freshness
from drivers.readings import Reading, ThrusterCommand, ThrusterReport

CHANNELS_PER_PORT = 16
ESCS_PER_MESSAGE = 4
ESC_INDEX_MAX = 63
CELSIUS_ZERO_K = 273.15

# 65535 is a saturated counter. No propeller turns nearly as fast, but a geared or bare motor's ESC may report 50000.
SPEED_MAX_RPM = 65_534
VOLTAGE_MAX_V = 655.35  # a saturated uint16 of centivolts
CURRENT_MAX_A = 655.35
TEMPERATURE_MAX_C = 200  # ArduPilot squeezes negative temperatures into a uint8 as well: they come out above this


@dataclass(frozen=True, slots=True)
class MavlinkThruster:
    """Where one thruster's command and speed are found in the autopilot's messages.

    Attributes:
        thruster: its number in the configuration, from 1.
        servo_channel: 1..32, the output in SERVO_OUTPUT_RAW; None: the command comes from elsewhere.
        command_scale: microseconds to a fraction of full thrust; given exactly where `servo_channel` is.
        esc_index: 0-based over all ESC_TELEMETRY_* (or PX4's ESC_STATUS) messages; None: no ESC telemetry.
        signed: True where ESC_STATUS carries the direction (ESC_TELEMETRY_* never does: ArduPilot sends magnitudes).
        reverse: True where a positive reported speed drives astern; only for a signed one.
        rpm_sensor: 1 or 2, the instance in RPM, for a speed sensor of its own in place of an ESC's.

    Raises:
        ValueError: out of these bounds.
    """

    thruster: int
    servo_channel: int | None = None
    command_scale: CommandScale | None = None
    esc_index: int | None = None
    signed: bool = False
    reverse: bool = False
    rpm_sensor: int | None = None

    def __post_init__(self) -> None:
        for name, value, lowest, highest in (
            ("thruster", self.thruster, 1, math.inf),
            ("servo_channel", self.servo_channel, 1, 2 * CHANNELS_PER_PORT),
            ("esc_index", self.esc_index, 0, ESC_INDEX_MAX),
            ("rpm_sensor", self.rpm_sensor, 1, 2),
        ):
            if value is not None and not lowest <= value <= highest:
                raise ValueError(f"{name} must lie in {lowest}..{highest}, got {value}")
        if (self.servo_channel is None) != (self.command_scale is None):
            raise ValueError(f"servo_channel and command_scale come together or not at all, got {self}")
        if self.esc_index is not None and self.rpm_sensor is not None:
            raise ValueError(f"one source of speed: esc_index or rpm_sensor, got {self}")


class ThrusterTelemetry:
    """Commands and speeds of the configured thrusters.

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
        self._commanded = [thruster for thruster in thrusters if thruster.servo_channel is not None]
        self._by_esc = {thruster.esc_index: thruster for thruster in thrusters if thruster.esc_index is not None}
        self._by_sensor = {thruster.rpm_sensor: thruster for thruster in thrusters if thruster.rpm_sensor is not None}
        self._seen: set[int] = set()  # ESCs that said something once
        self._meters: set[int] = set()  # ESCs that measured a current once: for the others 0 A means nothing
        self._last: dict[int, tuple[int, int]] = {}  # per ESC: packet counter and speed of ESC_TELEMETRY_*

    def servo_output(self, values: tuple[Any, ...], time_s: float) -> list[Reading]:
        """SERVO_OUTPUT_RAW: port 0 has channels 1-16, port 1 has 17-32; 0 us is a channel that is not in use."""
        time_us, port, pulses_us = values[0], values[9], values[1:9] + values[10:]
        if not self._fresh.accepts((SERVO_OUTPUT_RAW.message_id, port), time_us, ticks_per_s=1_000_000):
            return []
        first = 1 + port * CHANNELS_PER_PORT
        readings: list[Reading] = []
        for thruster in self._commanded:
            offset = (thruster.servo_channel or 0) - first
            if 0 <= offset < CHANNELS_PER_PORT and pulses_us[offset]:
                readings += self._command(thruster, pulses_us[offset], time_s)
        return readings

    def esc_telemetry(self, group: int, values: tuple[Any, ...], time_s: float) -> list[Reading]:
        """ESC_TELEMETRY_1_TO_4 (group 0) to _29_TO_32 (group 7): cV, cA, mAh, rpm without a sign, count, degC."""
        readings: list[Reading] = []
        for place in range(ESCS_PER_MESSAGE):
            thruster = self._by_esc.get(group * ESCS_PER_MESSAGE + place)
            if thruster is None:
                continue
            centivolts, centiamperes, _charge, rpm, count, celsius = values[place::ESCS_PER_MESSAGE]
            if self._reports(thruster, (centivolts, rpm, count, celsius)) and self._advanced(thruster, count, rpm):
                report = self._report(thruster, rpm, centivolts / 100.0, centiamperes / 100.0, time_s)
                readings.append(_with_temperature(report, celsius))
        return readings

    def esc_status(self, values: tuple[Any, ...], time_s: float) -> list[Reading]:
        """PX4's ESC_STATUS: four ESCs from `index` on, rpm with a sign, V, A."""
        time_us, index = values[0], values[13]
        if not self._fresh.accepts((ESC_STATUS.message_id, index), time_us, ticks_per_s=1_000_000, bits=64):
            return []
        readings: list[Reading] = []
        for place in range(ESCS_PER_MESSAGE):
            thruster = self._by_esc.get(index + place)
            rpm, voltage_v, current_a = values[1 + place], values[5 + place], values[9 + place]
            if thruster is not None and self._reports(thruster, (rpm, voltage_v, current_a)):
                readings.append(self._report(thruster, _directed(thruster, rpm), voltage_v, current_a, time_s))
        return readings

    def esc_info(self, values: tuple[Any, ...], time_s: float) -> list[Reading]:
        """PX4's ESC_INFO: errors and temperature (0.01 degC, 32767 = not known) of the same four ESCs."""
        time_us, errors, temperatures, index, count = values[0], values[1:5], values[10:14], values[14], values[15]
        if not self._fresh.accepts((ESC_INFO.message_id, index), time_us, ticks_per_s=1_000_000, bits=64):
            return []
        readings: list[Reading] = []
        for place in range(ESCS_PER_MESSAGE):
            thruster = self._by_esc.get(index + place)
            if thruster is not None and index + place < count:
                kelvin = temperatures[place] / 100.0 + CELSIUS_ZERO_K if abs(temperatures[place]) < 32767 else None
                readings.append(
                    ThrusterReport(time_s, thruster.thruster, temperature_k=kelvin, error_count=errors[place])
                )
        return readings

    def rpm(self, values: tuple[Any, ...], time_s: float) -> list[Reading]:
        """RPM: two sensors; negative is ArduPilot's word for a sensor without a signal."""
        readings: list[Reading] = []
        for sensor, thruster in self._by_sensor.items():
            speed_rpm = values[sensor - 1]
            if speed_rpm < 0.0:
                self._drops["RPM sensor without a signal"] += 1
            elif (checked_rpm := self._speed(speed_rpm)) is not None:
                readings.append(ThrusterReport(time_s, thruster.thruster, speed_rpm=checked_rpm))
        return readings

    def _command(self, thruster: MavlinkThruster, pulse_us: int, time_s: float) -> list[Reading]:
        fraction = thruster.command_scale.fraction(pulse_us) if thruster.command_scale else None
        if fraction is None:
            self._drops["command out of range"] += 1
            return []
        return [ThrusterCommand(time_s, thruster.thruster, fraction)]

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
        self, thruster: MavlinkThruster, rpm: float, voltage_v: float, current_a: float, time_s: float
    ) -> ThrusterReport:
        if 0.0 < abs(current_a) < CURRENT_MAX_A:
            self._meters.add(thruster.thruster)
        metered = thruster.thruster in self._meters and abs(current_a) < CURRENT_MAX_A
        return ThrusterReport(
            time_s=time_s,
            thruster=thruster.thruster,
            speed_rpm=self._speed(rpm),
            voltage_v=voltage_v if 0.0 < voltage_v < VOLTAGE_MAX_V else None,
            current_a=current_a if metered else None,
        )

    def _speed(self, rpm: float) -> float | None:
        if abs(rpm) <= SPEED_MAX_RPM:  # False for NaN
            return float(rpm)
        self._drops["implausible speed"] += 1
        return None


def _directed(thruster: MavlinkThruster, rpm: int) -> int:
    if not thruster.signed:
        return abs(rpm)
    return -rpm if thruster.reverse else rpm


def _with_temperature(report: ThrusterReport, celsius: int) -> ThrusterReport:
    if not 0 < celsius < TEMPERATURE_MAX_C:
        return report
    return ThrusterReport(
        report.time_s,
        report.thruster,
        report.speed_rpm,
        report.voltage_v,
        report.current_a,
        celsius + CELSIUS_ZERO_K,
    )
