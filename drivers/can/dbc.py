"""Vendor messages described by a DBC file: cantools reads the file once, compiled readers decode the frames."""

from __future__ import annotations

import difflib
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar, get_args

import cantools
from cantools.database.can import Database, Message, Signal

from drivers.can.dbc_signal import SignalReader
from drivers.can.dbc_speed import POLE_PAIR_UNITS, PulseCount, SpeedReader, SpeedUnit, rpm_per_unit
from drivers.can.frame import EXTENDED_MASK, STANDARD_MASK, CanFilter, CanFrame
from drivers.command import CommandScale
from drivers.readings import Reading, ThrusterCommand, ThrusterReport

__all__ = ["DbcDecoder", "DbcThruster", "SpeedUnit"]

# No propeller in water turns nearly as fast: above are sentinels, ERPM taken for RPM, and garbage.
SPEED_LIMIT_RPM = 30_000.0


@dataclass(frozen=True, slots=True)
class DbcThruster:
    """The signals of one thruster, each "Message.signal"; None: not on this bus.

    Attributes:
        thruster: number of the thruster in the configuration, from 1.
        command: command signal.
        command_scale: its range, neutral, dead band and direction, in the unit of the signal.
        speed: speed signal.
        speed_unit: unit of the speed signal. "erpm": electrical revolutions a minute. "pulses_per_s" and
            "pulse_count": of one Hall sensor, one pulse for each pole pair in a turn; the count wraps round.
        pole_pairs: of the motor, for "erpm", "pulses_per_s" and "pulse_count".
        signed: False for a sensor that knows no direction: the magnitude is reported.
        reverse: True where the speed signal is negative ahead. The command's direction is in `command_scale`.
        voltage: supply voltage signal in volts.
        current: supply or motor current signal in amperes.

    Raises:
        ValueError: a number or unit out of range, or one setting without the other that it needs.
    """

    thruster: int
    command: str | None = None
    command_scale: CommandScale | None = None
    speed: str | None = None
    speed_unit: SpeedUnit = "rpm"
    pole_pairs: int | None = None
    signed: bool = True
    reverse: bool = False
    voltage: str | None = None
    current: str | None = None

    def __post_init__(self) -> None:
        if self.thruster < 1:
            raise ValueError(f"thruster must be at least 1, got {self.thruster}")
        if self.speed_unit not in get_args(SpeedUnit):
            raise ValueError(f"speed_unit must be one of {', '.join(get_args(SpeedUnit))}, got {self.speed_unit!r}")
        if self.pole_pairs is not None and self.pole_pairs < 1:
            raise ValueError(f"pole_pairs must be at least 1, got {self.pole_pairs}")
        if self.speed_unit in POLE_PAIR_UNITS and self.pole_pairs is None:
            raise ValueError(f"speed_unit {self.speed_unit!r} needs pole_pairs, got none")
        if (self.command is None) != (self.command_scale is None):
            raise ValueError("command and command_scale must be given together")
        if not self.references():
            raise ValueError(f"thruster {self.thruster} must name a command, speed, voltage or current signal")

    def references(self) -> dict[str, str]:
        """The signals that are given, by what they stand for."""
        every = {"command": self.command, "speed": self.speed, "voltage": self.voltage, "current": self.current}
        return {quantity: reference for quantity, reference in every.items() if reference is not None}


_Named = TypeVar("_Named", Message, Signal)
Read = Callable[[bytes, float], float | None]


@dataclass(slots=True)
class _Report:
    """What one message tells of one thruster."""

    thruster: int
    speed: Read | None = None
    voltage: Read | None = None
    current: Read | None = None

    def read(self, data: bytes, time_s: float) -> ThrusterReport | None:
        speed_rpm = self.speed(data, time_s) if self.speed else None
        voltage_v = self.voltage(data, time_s) if self.voltage else None
        current_a = self.current(data, time_s) if self.current else None
        if speed_rpm is None and voltage_v is None and current_a is None:
            return None
        return ThrusterReport(time_s, self.thruster, speed_rpm=speed_rpm, voltage_v=voltage_v, current_a=current_a)


class _Plan:
    """Everything that is read out of one message."""

    def __init__(self, message: Message) -> None:
        self.message = message
        self.commands: list[tuple[int, SignalReader, CommandScale]] = []
        self._reports: dict[int, _Report] = {}

    @property
    def reports(self) -> Iterable[_Report]:
        return self._reports.values()

    def report(self, thruster: int) -> _Report:
        return self._reports.setdefault(thruster, _Report(thruster))

    def fits(self, frame: CanFrame) -> bool:
        """True if the data have the message's length. CAN FD has no frames of 9 to 11 bytes and pads to the next."""
        length: int = self.message.length
        return len(frame.data) == length or (frame.fd and len(frame.data) > length > 8)


class DbcDecoder:
    """Frames of vendor messages to commands and reports of thrusters.

    Causes counted in `drops`: "wrong length" (data not as long as the message of the database), "command out of
    range" (of its scale: ranges of commands in the database are not looked at), "implausible speed", "implausible
    voltage", "implausible current" (outside the database's range, its mark for an invalid value, or for a speed of 16
    bits and more the end of the integer's range, such as 65535), "implausible command" (the mark for an invalid
    value), "non-finite". One bad signal costs no other signal of its message.

    Args:
        database_path: DBC file (or another format that cantools reads).
        thrusters: what is wired to the bus, and its signals.
        speed_limit_rpm: a faster report is implausible.

    Raises:
        ValueError: the file cannot be read, a message or signal is not in it (the message says which one is nearest),
            or two thrusters have one number; all problems in one go.
    """

    def __init__(
        self,
        database_path: str | Path,
        thrusters: Sequence[DbcThruster],
        speed_limit_rpm: float = SPEED_LIMIT_RPM,
    ) -> None:
        if not speed_limit_rpm > 0.0:
            raise ValueError(f"speed_limit_rpm must be positive, got {speed_limit_rpm}")
        self.drops: Counter[str] = Counter()
        self._speed_limit_rpm = speed_limit_rpm
        self._plans: dict[tuple[int, bool], _Plan] = {}
        database = _load(Path(database_path))
        problems = _twins([thruster.thruster for thruster in thrusters])
        for thruster in thrusters:
            problems += self._compile(database, thruster)
        if problems:
            raise ValueError("; ".join(problems))

    def filters(self) -> list[CanFilter]:
        """One for each message that a configured signal is in."""
        return [
            CanFilter(identifier, EXTENDED_MASK if extended else STANDARD_MASK, extended)
            for identifier, extended in self._plans
        ]

    def decode(self, frame: CanFrame) -> Sequence[Reading]:
        """Readings of the thrusters that this message tells of."""
        plan = self._plans.get((frame.identifier, frame.extended))
        if plan is None or frame.error:
            return ()
        if not plan.fits(frame):
            self.drops["wrong length"] += 1
            return ()
        data = frame.data[: plan.message.length]
        readings: list[Reading] = []
        for thruster, reader, scale in plan.commands:
            fraction = self._fraction(reader.read(data), scale)
            if fraction is not None:
                readings.append(ThrusterCommand(frame.time_s, thruster, fraction))
        reports = (report.read(data, frame.time_s) for report in plan.reports)
        readings += [report for report in reports if report is not None]
        return readings

    def _fraction(self, value: float | None, scale: CommandScale) -> float | None:
        fraction = None if value is None else scale.fraction(value)
        if value is not None and fraction is None:
            self.drops["command out of range"] += 1
        return fraction

    def _compile(self, database: Database, thruster: DbcThruster) -> list[str]:
        """Add a thruster's signals to the plans; returns what is wrong with them."""
        problems = []
        for quantity, reference in thruster.references().items():
            try:
                message, signal = _find(database, reference)
                self._add(thruster, quantity, message, signal)
            except ValueError as error:
                problems.append(f"{quantity} of thruster {thruster.thruster}: {error}")
        return problems

    def _add(self, thruster: DbcThruster, quantity: str, message: Message, signal: Signal) -> None:
        sentinels = quantity == "speed" and thruster.speed_unit != "pulse_count"
        reader = SignalReader(
            message, signal, quantity, self.drops, limits=quantity != "command", sentinels=sentinels
        )
        plan = self._plans.setdefault((message.frame_id, message.is_extended_frame), _Plan(message))
        if plan.message.name != message.name:
            raise ValueError(
                f"messages {plan.message.name} and {message.name} have one identifier: mend the database"
            )
        if quantity == "command" and thruster.command_scale is not None:
            plan.commands.append((thruster.thruster, reader, thruster.command_scale))
        elif quantity == "speed":
            plan.report(thruster.thruster).speed = self._speed(thruster, reader)
        else:
            setattr(plan.report(thruster.thruster), quantity, reader.read)

    def _speed(self, thruster: DbcThruster, reader: SignalReader) -> Read:
        read = PulseCount(reader, thruster.signed).read if thruster.speed_unit == "pulse_count" else reader.read
        factor = rpm_per_unit(thruster.speed_unit, thruster.pole_pairs or 1) * (-1.0 if thruster.reverse else 1.0)
        return SpeedReader(read, factor, self._speed_limit_rpm, thruster.signed, self.drops).read


def _load(path: Path) -> Database:
    try:
        # Not strict: signals that overlap in some message that nobody uses are no reason to refuse the vendor's file.
        database = cantools.database.load_file(path, strict=False)
    except Exception as error:  # broken files make cantools raise whatever its parser stumbles over
        raise ValueError(f"database {path} cannot be read: {error}") from error
    if not isinstance(database, Database):
        raise ValueError(
            f"database {path} describes diagnostics, want one that describes CAN messages, such as a DBC"
        )
    return database


def _find(database: Database, reference: str) -> tuple[Message, Signal]:
    """Message and signal of "Message.signal"."""
    message_name, dot, signal_name = reference.partition(".")
    if not dot:
        raise ValueError(f'want "Message.signal", got {reference!r}')
    message = _named(message_name, "message", database.messages)
    return message, _named(signal_name, f"signal of {message.name}", message.signals)


def _named(name: str, kind: str, candidates: Iterable[_Named]) -> _Named:
    by_name = {candidate.name: candidate for candidate in candidates}
    if name in by_name:
        return by_name[name]
    nearest = difflib.get_close_matches(name, by_name, n=1, cutoff=0.0)
    hint = f", nearest is {nearest[0]!r}" if nearest else ""
    raise ValueError(f"no {kind} is named {name!r}{hint}")


def _twins(numbers: list[int]) -> list[str]:
    twins = sorted(number for number, count in Counter(numbers).items() if count > 1)
    return [f"thruster must differ from thruster to thruster, got {twin} more than once" for twin in twins]
