"""What one message tells of one thruster: its command, or what is reported of it; of one frame, or of many."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from drivers.can.messages.bit_field import BitField, Column
from drivers.can.messages.field_layout import FieldLayout
from drivers.can.messages.signal_reader import Signal, SignalReader
from drivers.can.messages.speed_reader import SpeedReader, SpeedSignal
from drivers.command import CommandScale
from drivers.construction import constructor
from drivers.reading_block import CommandColumns, ReportColumns
from drivers.readings import ThrusterCommand, ThrusterReport

FloatArray: TypeAlias = NDArray[np.float64]
IndexArray: TypeAlias = NDArray[np.intp]

_command = constructor(ThrusterCommand)
_report = constructor(ThrusterReport)


@dataclass(frozen=True, slots=True)
class CommandSignal:
    """The command of a thruster: its signal, and the scale of the signal's unit."""

    thruster: int
    signal: Signal
    scale: CommandScale


@dataclass(frozen=True, slots=True)
class ReportSignals:
    """What a message reports of a thruster; None: not in it. V, A and K."""

    thruster: int
    speed: SpeedSignal | None = None
    voltage: Signal | None = None
    current: Signal | None = None
    temperature: Signal | None = None

    def fields(self) -> list[BitField]:
        """All that its signals need."""
        speed = None if self.speed is None else self.speed.signal
        signals = (speed, self.voltage, self.current, self.temperature)
        return [field for signal in signals if signal is not None for field in signal.fields()]


class CommandReader:
    """Reads the command of one thruster.

    Args:
        command: what to read.
        layout: of its message.
        drops: where commands that are none are counted.

    Attributes:
        read: function from the numbers of one frame and its time to the reading; None where there is none.
    """

    def __init__(self, command: CommandSignal, layout: FieldLayout, drops: Counter[str]) -> None:
        self._thruster, self._scale, self._drops = command.thruster, command.scale, drops
        self._reader = SignalReader(command.signal, layout, "command", drops)
        self.read = self._compiled()

    def _compiled(self) -> Callable[[Sequence[float], float], ThrusterCommand | None]:
        thruster, value_of, fraction_of, drops = self._thruster, self._reader.read, self._scale.fraction, self._drops

        def read(numbers: Sequence[float], time_s: float) -> ThrusterCommand | None:
            value = value_of(numbers)
            if value is None:
                return None
            fraction = fraction_of(value)
            if fraction is None:
                drops["command out of range"] += 1
                return None
            return _command(time_s, thruster, fraction)

        return read

    def columns(self, columns: Sequence[Column], row: IndexArray, time_s: FloatArray) -> CommandColumns:
        """`read` of the frames at `row` (N,), received at `time_s` (N,)."""
        value = self._reader.column(columns)
        fraction = self._scale.fractions(value)
        known = ~np.isnan(fraction)
        outside = int((~known & ~np.isnan(value)).sum())
        if outside:
            self._drops["command out of range"] += outside
        return CommandColumns(self._thruster, row[known], time_s[known], fraction[known])


class ReportReader:
    """Reads what a message reports of one thruster.

    Args:
        report: what to read.
        layout: of the message.
        drops: where values that are none are counted.

    Attributes:
        read: function from the numbers of one frame and its time to the reading; None where nothing is known.
    """

    def __init__(self, report: ReportSignals, layout: FieldLayout, drops: Counter[str]) -> None:
        def reader(signal: Signal | None, quantity: str) -> SignalReader | None:
            return None if signal is None else SignalReader(signal, layout, quantity, drops)

        self._thruster = report.thruster
        self._speed = None if report.speed is None else SpeedReader(report.speed, layout, drops)
        self._voltage = reader(report.voltage, "voltage")
        self._current = reader(report.current, "current")
        self._temperature = reader(report.temperature, "temperature")
        self.read = self._compiled()

    def _compiled(self) -> Callable[[Sequence[float], float], ThrusterReport | None]:
        thruster = self._thruster
        speed = None if self._speed is None else self._speed.read
        voltage, current, temperature = (
            None if reader is None else reader.read for reader in (self._voltage, self._current, self._temperature)
        )

        def read(numbers: Sequence[float], time_s: float) -> ThrusterReport | None:
            speed_rpm = speed(numbers, time_s) if speed is not None else None
            voltage_v = voltage(numbers) if voltage is not None else None
            current_a = current(numbers) if current is not None else None
            temperature_k = temperature(numbers) if temperature is not None else None
            if speed_rpm is None and voltage_v is None and current_a is None and temperature_k is None:
                return None
            return _report(time_s, thruster, speed_rpm, voltage_v, current_a, temperature_k, None)

        return read

    def columns(self, columns: Sequence[Column], row: IndexArray, time_s: FloatArray) -> ReportColumns:
        """`read` of the frames at `row` (N,), received at `time_s` (N,)."""
        unknown = np.full(len(row), np.nan)
        speed_rpm = unknown if self._speed is None else self._speed.column(columns, time_s)
        voltage_v, current_a, temperature_k = (
            unknown if reader is None else reader.column(columns)
            for reader in (self._voltage, self._current, self._temperature)
        )
        known = ~(np.isnan(speed_rpm) & np.isnan(voltage_v) & np.isnan(current_a) & np.isnan(temperature_k))
        return ReportColumns(
            self._thruster,
            row[known],
            time_s[known],
            speed_rpm=speed_rpm[known],
            voltage_v=voltage_v[known],
            current_a=current_a[known],
            temperature_k=temperature_k[known],
            error_count=unknown[known],
        )
