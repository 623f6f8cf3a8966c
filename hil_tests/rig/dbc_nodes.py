"""Simulated nodes that speak a vendor's own messages, as a DBC database describes them, through the cantools package.

Each thruster has a message of its own for its command, and one for its report. Where a message has the signals
`AliveCounter` and `Checksum`, they are filled in, and an ESC obeys no command whose checksum is wrong.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import reduce
from math import inf
from operator import xor
from pathlib import Path
from typing import cast

import cantools
from cantools.database.can import Message
from crccheck.crc import Crc8SaeJ1850

from drivers.can.frame import CanFrame
from hil_tests.rig.bus_clock import Unsent
from hil_tests.rig.dronecan_nodes import HOLD_S
from hil_tests.rig.esc_messages import EscReport
from hil_tests.rig.profile_sections import Thruster

TOLD = ("speed", "voltage", "current")
COUNTER, CHECKSUM = "AliveCounter", "Checksum"
CHECKSUMS: dict[str, Callable[[bytes], int]] = {
    "crc8_sae_j1850": Crc8SaeJ1850.calc,
    "sum8": lambda data: sum(data) % 256,
    "xor8": lambda data: reduce(xor, data, 0),
}


class DbcMessage:
    """One message of a database, sent or received.

    Args:
        message: of cantools.
        checksum: name of the algorithm, over all bytes but the checksum's own.

    Raises:
        ValueError: the checksum is no byte of its own.
    """

    def __init__(self, message: Message, checksum: str) -> None:
        self._message = message
        self._checksum = CHECKSUMS[checksum]
        signals = {signal.name: signal for signal in message.signals}
        self._rest = dict.fromkeys(signals, 0.0)
        self._counts = 2 ** signals[COUNTER].length if COUNTER in signals else 0
        self._byte = signals[CHECKSUM].start // 8 if CHECKSUM in signals else None
        if self._byte is not None and (signals[CHECKSUM].length, signals[CHECKSUM].start % 8) != (8, 0):
            raise ValueError(f"{message.name}.{CHECKSUM}: want a byte of its own, little endian")
        self._count = 0

    @property
    def identifier(self) -> int:
        """On the bus."""
        return int(self._message.frame_id)

    def restart(self) -> None:
        """It is counted from 0 again."""
        self._count = 0

    def frame(self, values: dict[str, float]) -> Unsent:
        """With values by the names of signals; signals are limited to what the database says they can have."""
        limited = {name: self._within(name, value) for name, value in values.items()}
        if self._counts:
            limited[COUNTER] = self._count
            self._count = (self._count + 1) % self._counts
        data = bytearray(self._message.encode(self._rest | limited))
        if self._byte is not None:
            data[self._byte] = self._sealed(data)
        return Unsent(self.identifier, bytes(data), bool(self._message.is_extended_frame))

    def value(self, frame: CanFrame, signal: str) -> float | None:
        """Of a signal; None where the frame is broken."""
        if len(frame.data) < self._message.length:
            return None
        if self._byte is not None and frame.data[self._byte] != self._sealed(frame.data):
            return None
        decoded = self._message.decode(frame.data, decode_choices=False, decode_containers=False)
        return float(cast("dict[str, float]", decoded)[signal])

    def _sealed(self, data: bytes | bytearray) -> int:
        rest = bytes(byte for place, byte in enumerate(data) if place != self._byte)
        return self._checksum(rest)

    def _within(self, name: str, value: float) -> float:
        signal = self._message.get_signal_by_name(name)
        least = -inf if signal.minimum is None else float(signal.minimum)
        most = inf if signal.maximum is None else float(signal.maximum)
        return max(least, min(most, value))


class Database:
    """Where the signals of a vehicle's thrusters are.

    Args:
        path: of the file.
        checksum: as `DbcMessage` takes it.

    Raises:
        ValueError: it cannot be read, or lacks a signal that is asked for.
    """

    def __init__(self, path: Path, checksum: str) -> None:
        self._path, self._checksum = path, checksum
        database = cantools.database.load_file(path)
        if not isinstance(database, cantools.database.Database):
            raise ValueError(f"{path}: want a database of CAN messages")
        self._database = database

    def message(self, signals: Iterable[str]) -> DbcMessage:
        """The one that has these signals, "Message.signal" each."""
        names = {name.partition(".")[0] for name in signals}
        if len(names) != 1:
            raise ValueError(f"{', '.join(sorted(signals))}: want signals of one message")
        [name] = names
        try:
            message = self._database.get_message_by_name(name)
        except KeyError as error:
            raise ValueError(f"{name}: {self._path.name} has no such message") from error
        missing = {one.partition(".")[2] for one in signals} - {signal.name for signal in message.signals}
        if missing:
            raise ValueError(f"{name}.{min(missing)}: {self._path.name} has no such signal")
        return DbcMessage(message, self._checksum)


class DbcCommander:
    """The autopilot's node: one message for each thruster.

    Args:
        database: of the bus.
        thrusters: whose commands they are.
    """

    def __init__(self, database: Database, thrusters: Sequence[Thruster]) -> None:
        self._commands = [
            (database.message([one.command]), one.command.partition(".")[2], one.full_scale)
            for one in thrusters
            if one.command is not None
        ]

    def publish(self, _: float, commands: Sequence[float]) -> list[Unsent]:
        """One command of -1 to 1 per thruster."""
        return [
            message.frame({signal: full_scale * command})
            for (message, signal, full_scale), command in zip(self._commands, commands, strict=True)
        ]

    def restart(self) -> None:
        """The autopilot has rebooted."""
        for message, _, _ in self._commands:
            message.restart()


class DbcEscs:
    """ESCs: each obeys the newest command of its own, and reports what it has signals for.

    Args:
        database: of the bus.
        thrusters: whose they are.
        hold_s: how long a command is good for.

    Attributes:
        dropped: commands that were broken.
    """

    def __init__(self, database: Database, thrusters: Sequence[Thruster], hold_s: float = HOLD_S) -> None:
        self._hold_s = hold_s
        self._heard: dict[int, tuple[int, DbcMessage, str, float]] = {}
        self._reports: list[tuple[DbcMessage, dict[str, str]]] = []
        for place, one in enumerate(thrusters):
            if one.command is not None:
                message = database.message([one.command])
                signal = one.command.partition(".")[2]
                self._heard[message.identifier] = place, message, signal, one.full_scale
            told = {name: text for name in TOLD if (text := getattr(one, name)) is not None}
            signals = {name: text.partition(".")[2] for name, text in told.items()}
            self._reports.append((database.message(told.values()), signals))
        self._commands = [0.0] * len(thrusters)
        self._commanded_s = [-inf] * len(thrusters)
        self.dropped = 0

    def take(self, time_s: float, frames: Iterable[CanFrame]) -> None:
        """Frames have come."""
        for frame in frames:
            if frame.identifier in self._heard and not frame.error:
                self._obey(time_s, frame)

    def commands(self, time_s: float) -> list[float]:
        """What they apply now, -1 to 1 each."""
        return [
            command if time_s - commanded_s <= self._hold_s else 0.0
            for command, commanded_s in zip(self._commands, self._commanded_s, strict=True)
        ]

    def report(self, _: float, place: int, report: EscReport) -> list[Unsent]:
        """What the ESC at a place from 0 says."""
        message, signals = self._reports[place]
        measured = {"speed": report.speed_rpm, "voltage": report.voltage_v, "current": report.current_a}
        return [message.frame({signal: measured[name] for name, signal in signals.items()})]

    def restart(self, place: int) -> None:
        """One of them restarts."""
        self._reports[place][0].restart()

    def _obey(self, time_s: float, frame: CanFrame) -> None:
        place, message, signal, full_scale = self._heard[frame.identifier]
        value = message.value(frame, signal)
        if value is None:
            self.dropped += 1
            return
        self._commands[place] = max(-1.0, min(1.0, value / full_scale))
        self._commanded_s[place] = time_s
