"""What of a log tells its clock from that of another: commands and speeds of thrusters, stamps of the autopilot."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from drivers.reading_block import ReadingBlock
from drivers.readings import (
    Attitude,
    GlobalPosition,
    Inertial,
    Reading,
    ThrusterCommand,
    ThrusterReport,
    WaterPressure,
)

FloatArray: TypeAlias = NDArray[np.float64]

REBOOT_S = 5.0  # by which the autopilot's clock must go back; messages overtake each other by less
SESSION_MIN = 20  # stamps: fewer tell nothing


@dataclass(frozen=True, slots=True)
class Series:
    """N values, at times that rise.

    Attributes:
        time_s: (N,) by the log's clock.
        value: (N,) finite.
    """

    time_s: FloatArray
    value: FloatArray

    def __len__(self) -> int:
        return len(self.time_s)


@dataclass(frozen=True, slots=True)
class BootSession:
    """An autopilot from one start to the next, as a log has it.

    Attributes:
        boot_s: (N,) rising stamps of the autopilot.
        time_s: (N,) when each came, by the log's clock.
        attitude_rad: (N, 3) roll, pitch, yaw; NaN where the stamp was of something else.
    """

    boot_s: FloatArray
    time_s: FloatArray
    attitude_rad: FloatArray


class LogTrace:
    """Readings of one log in; what `log_clocks` compares out."""

    def __init__(self) -> None:
        self._commands: defaultdict[int, list[FloatArray]] = defaultdict(list)
        self._speeds: defaultdict[int, list[FloatArray]] = defaultdict(list)
        self._stamps: list[FloatArray] = []

    def take(self, readings: Iterable[Reading]) -> None:
        """Takes a batch of readings."""
        commands: defaultdict[int, list[tuple[float, float]]] = defaultdict(list)
        speeds: defaultdict[int, list[tuple[float, float]]] = defaultdict(list)
        stamps: list[tuple[float, ...]] = []
        for reading in readings:
            match reading:
                case ThrusterCommand():
                    commands[reading.thruster].append((reading.time_s, reading.fraction))
                case ThrusterReport(speed_rpm=float(rpm)):
                    speeds[reading.thruster].append((reading.time_s, abs(rpm)))
                case Attitude(boot_s=float(boot_s)):
                    angles = (reading.roll_rad, reading.pitch_rad, reading.yaw_rad)
                    stamps.append((boot_s, reading.time_s, *angles))
                case (
                    Inertial(boot_s=float(boot_s))
                    | GlobalPosition(boot_s=float(boot_s))
                    | WaterPressure(boot_s=float(boot_s))
                ):
                    stamps.append((boot_s, reading.time_s, np.nan, np.nan, np.nan))
        for number, points in commands.items():
            self._commands[number].append(np.array(points))
        for number, points in speeds.items():
            self._speeds[number].append(np.array(points))
        if stamps:
            self._stamps.append(np.array(stamps))

    def take_block(self, block: ReadingBlock) -> None:
        """Takes the readings of a block."""
        for command in block.commands:
            self._commands[command.thruster].append(np.column_stack([command.time_s, command.fraction]))
        for report in block.reports:
            measured = ~np.isnan(report.speed_rpm)
            rows = np.column_stack([report.time_s, np.abs(report.speed_rpm)])[measured]
            self._speeds[report.thruster].append(rows)
        self.take(reading for _, reading in block.others)

    def commands(self) -> dict[int, Series]:
        """Commands by thruster, fractions of full thrust."""
        return {number: _series(parts) for number, parts in self._commands.items()}

    def speeds(self) -> dict[int, Series]:
        """Magnitudes of speeds by thruster, rpm: of some sources the sign is not known."""
        return {number: _series(parts) for number, parts in self._speeds.items()}

    def sessions(self) -> list[BootSession]:
        """The autopilot's stamps, from one start to the next."""
        if not self._stamps:
            return []
        rows = np.concatenate(self._stamps)
        restarts = np.flatnonzero(np.diff(rows[:, 0]) < -REBOOT_S) + 1
        return [_session(part) for part in np.split(rows, restarts) if len(part) >= SESSION_MIN]


def _session(rows: FloatArray) -> BootSession:
    rows = rows[np.argsort(rows[:, 0], kind="stable")]
    return BootSession(rows[:, 0], rows[:, 1], rows[:, 2:])


def _series(parts: list[FloatArray]) -> Series:
    rows = np.concatenate(parts)
    rows = rows[np.argsort(rows[:, 0], kind="stable")]
    rows = rows[np.concatenate([[True], np.diff(rows[:, 0]) > 0.0])] if len(rows) else rows
    # side by side: they are looked into thousands of times
    return Series(np.ascontiguousarray(rows[:, 0]), np.ascontiguousarray(rows[:, 1]))
