"""Thruster commands and ESC telemetry of a dataflash log: RCOU, RCO2, RCO3, ESC and RPM.

RCOU has the servo outputs 1 to 14, RCO2 and RCO3 those beyond; 0 us is an output that is not in use. ESC has one
record for each ESC that said something new. Unlike ESC_TELEMETRY_* it may have a sign. RawRPM, where there is one, is
what the ESC said; RPM is that with its changes drawn out over time. Before ArduPilot 4.1, ESC1 to ESC8 were types of
their own. RPM is of sensors beside the ESCs; below 0 is a sensor without a signal.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import repeat

import numpy as np

from drivers.logs.boot_clock import BootClock
from drivers.logs.damage import DamageReport
from drivers.logs.dataflash_format import Records
from drivers.logs.esc_currents import EscCurrents
from drivers.logs.plausible import FloatArray, Mask, between, optional, refuse
from drivers.logs.stamped import Stamped
from drivers.mavlink.thrusters import (
    CELSIUS_ZERO_K,
    SPEED_MAX_RPM,
    TEMPERATURE_MAX_C,
    VOLTAGE_MAX_V,
    MavlinkThruster,
)
from drivers.readings import ThrusterCommand, ThrusterReport

OUTPUTS = ("RCOU", "RCO2", "RCO3")
OLD_ESCS = tuple(f"ESC{number}" for number in range(1, 9))
WANTED = (*OUTPUTS, "ESC", *OLD_ESCS, "RPM")


class DataflashThrusters:
    """Commands and speeds of the configured thrusters.

    Args:
        thrusters: where to look for what.
        clock: of the log.
        damage: told what is implausible.
    """

    def __init__(self, thrusters: Sequence[MavlinkThruster], clock: BootClock, damage: DamageReport) -> None:
        self._clock = clock
        self._damage = damage
        self._commanded = [one for one in thrusters if one.servo_channel is not None]
        self._measured = [one for one in thrusters if one.esc_index is not None]
        self._sensed = [one for one in thrusters if one.rpm_sensor is not None]
        self._currents = EscCurrents()

    def take(self, records: Records) -> Iterator[Stamped]:
        """Readings of records of one type, one of `WANTED`."""
        name = records.format.name
        if name in OUTPUTS:
            return self._outputs(records)
        return self._sensors(records) if name == "RPM" else self._escs(records)

    def _outputs(self, records: Records) -> Iterator[Stamped]:
        for thruster in self._commanded:
            column = f"C{thruster.servo_channel}"
            if thruster.command_scale is not None and records.has(column):
                pulses_us = records.numbers(column)
                used = records.part(pulses_us > 0.0)
                fraction = thruster.command_scale.fractions(pulses_us[pulses_us > 0.0])
                yield self._commands(thruster.thruster, used, fraction)

    def _commands(self, number: int, records: Records, fraction: FloatArray) -> Stamped:
        known = ~np.isnan(fraction)
        self._refuse(records, ~known, "command out of range")
        kept, fraction = records.part(known), fraction[known]
        time_s = kept.boot_s + self._clock.offset_s
        readings = list(map(ThrusterCommand, time_s.tolist(), repeat(number), fraction.tolist()))
        return Stamped(time_s, kept.offset, readings)

    def _escs(self, records: Records) -> Iterator[Stamped]:
        own = OLD_ESCS.index(records.format.name) if records.format.name in OLD_ESCS else None
        for thruster in self._measured:
            if own is None and records.has("Instance"):
                yield self._reports(thruster, records.part(records.numbers("Instance") == thruster.esc_index))
            elif own == thruster.esc_index:
                yield self._reports(thruster, records)

    def _reports(self, thruster: MavlinkThruster, records: Records) -> Stamped:
        time_s = records.boot_s + self._clock.offset_s
        columns = (
            self._speed(thruster, records),
            between(_column(records, "Volt"), 0.0, VOLTAGE_MAX_V),
            self._currents.measured(thruster.thruster, _column(records, "Curr")),
            between(_column(records, "Temp"), 0.0, TEMPERATURE_MAX_C) + CELSIUS_ZERO_K,
        )
        values = zip(*map(optional, columns), strict=True)
        readings = [
            ThrusterReport(at_s, thruster.thruster, *rest) for at_s, rest in zip(time_s.tolist(), values, strict=True)
        ]
        return Stamped(time_s, records.offset, readings)

    def _speed(self, thruster: MavlinkThruster, records: Records) -> FloatArray:
        rpm = _column(records, "RPM")
        raw_rpm = _column(records, "RawRPM")
        rpm = np.where(np.isnan(raw_rpm), rpm, raw_rpm)
        self._refuse(records, np.abs(rpm) > SPEED_MAX_RPM, "implausible speed")
        rpm[~(np.abs(rpm) <= SPEED_MAX_RPM)] = np.nan
        return thruster.directed(rpm)

    def _sensors(self, records: Records) -> Iterator[Stamped]:
        for thruster in self._sensed:
            mine, column = records, f"rpm{thruster.rpm_sensor}"
            if records.has("I", "RPM"):
                mine, column = records.part(records.numbers("I") == (thruster.rpm_sensor or 0) - 1), "RPM"
            if mine.has(column):
                yield self._sensed_speeds(thruster.thruster, mine, mine.numbers(column))

    def _sensed_speeds(self, number: int, records: Records, rpm: FloatArray) -> Stamped:
        turns = (rpm >= 0.0) & (rpm <= SPEED_MAX_RPM)
        self._refuse(records, rpm < 0.0, "RPM sensor without a signal")
        self._refuse(records, ~(rpm <= SPEED_MAX_RPM), "implausible speed")
        kept = records.part(turns)
        time_s = kept.boot_s + self._clock.offset_s
        readings = list(map(ThrusterReport, time_s.tolist(), repeat(number), rpm[turns].tolist()))
        return Stamped(time_s, kept.offset, readings)

    def _refuse(self, records: Records, refused: Mask, cause: str) -> None:
        refuse(self._damage, records.offset, refused, cause)


def _column(records: Records, name: str) -> FloatArray:
    """A field that not every version has."""
    return records.numbers(name) if records.has(name) else np.full(len(records), np.nan)
