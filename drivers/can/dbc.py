"""Vendor messages described by a database: cantools reads the file once, compiled plans read the frames.

The file may be a DBC, KCD, SYM or ARXML: all that cantools reads.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, get_args

from cantools.database.can import Database, Message

from drivers.can.dbc_database import compile_signal, find_signal, load_database, message_layout
from drivers.can.messages.decoder import MessageDecoder
from drivers.can.messages.plan import MessageLayout, MessagePlan
from drivers.can.messages.signal_reader import Signal
from drivers.can.messages.speed_reader import POLE_PAIR_UNITS, SPEED_LIMIT_RPM, SpeedSignal, SpeedUnit, rpm_per_unit
from drivers.can.messages.thruster_reader import CommandSignal, ReportSignals
from drivers.can.twins import twins
from drivers.command import CommandScale

__all__ = ["DbcDecoder", "DbcThruster", "SpeedUnit"]


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

    def speed_signal(self, signal: Signal, limit_rpm: float) -> SpeedSignal:
        """How the speed signal tells the speed."""
        rpm = rpm_per_unit(self.speed_unit, self.pole_pairs or 1)
        return SpeedSignal(
            signal, -rpm if self.reverse else rpm, limit_rpm, self.signed, self.speed_unit == "pulse_count"
        )


class DbcDecoder(MessageDecoder):
    """Frames of vendor messages to commands and reports of thrusters.

    Causes counted in `drops`: "wrong length" (data not as long as the message of the database; the padding of J1939
    and CAN FD is let pass), "command out of range" (of its scale: ranges of commands in the database are not looked
    at), "implausible speed", "implausible voltage", "implausible current" (outside the database's range, its mark for
    an invalid value, or for a speed of 16 bits and more the end of the integer's range, such as 65535), "implausible
    command" (the mark for an invalid value), "non-finite". One bad signal costs no other signal of its message.

    Args:
        database: DBC, KCD, SYM or ARXML file, or what `load_database` made of one.
        thrusters: what is wired to the bus, and its signals.
        speed_limit_rpm: a faster report is implausible.

    Raises:
        ValueError: the file cannot be read, a message or signal is not in it (the message says which one is nearest),
            or two thrusters have one number; all problems in one go.
    """

    def __init__(
        self,
        database: Database | str | Path,
        thrusters: Sequence[DbcThruster],
        speed_limit_rpm: float = SPEED_LIMIT_RPM,
    ) -> None:
        if not speed_limit_rpm > 0.0:
            raise ValueError(f"speed_limit_rpm must be positive, got {speed_limit_rpm}")
        if not isinstance(database, Database):
            database = load_database(Path(database))
        draft = _Draft(database, speed_limit_rpm)
        problems = twins("thruster", [thruster.thruster for thruster in thrusters])
        for thruster in thrusters:
            problems += draft.add(thruster)
        if problems:
            raise ValueError("; ".join(problems))
        drops: Counter[str] = Counter()
        super().__init__(draft.plans(drops), drops)


@dataclass(slots=True)
class _Wanted:
    """What is read of one message."""

    message: Message
    layout: MessageLayout
    commands: list[CommandSignal] = field(default_factory=list)
    reports: dict[int, ReportSignals] = field(default_factory=dict)

    def report(self, thruster: int, **signals: Any) -> None:
        """Takes signals of what the message reports of a thruster."""
        self.reports[thruster] = replace(self.reports.get(thruster, ReportSignals(thruster)), **signals)


class _Draft:
    """Gathers the signals of all thrusters by their messages."""

    def __init__(self, database: Database, speed_limit_rpm: float) -> None:
        self._database = database
        self._speed_limit_rpm = speed_limit_rpm
        self._wanted: dict[tuple[int, bool], _Wanted] = {}

    def add(self, thruster: DbcThruster) -> list[str]:
        """Takes a thruster's signals; returns what is wrong with them."""
        problems = []
        for quantity, reference in thruster.references().items():
            try:
                self._add_signal(thruster, quantity, reference)
            except ValueError as error:
                problems.append(f"{quantity} of thruster {thruster.thruster}: {error}")
        return problems

    def plans(self, drops: Counter[str]) -> list[MessagePlan]:
        """One for each message."""
        return [
            MessagePlan(one.layout, one.commands, list(one.reports.values()), drops) for one in self._wanted.values()
        ]

    def _add_signal(self, thruster: DbcThruster, quantity: str, reference: str) -> None:
        message, found = find_signal(self._database, reference)
        sentinels = quantity == "speed" and thruster.speed_unit != "pulse_count"
        signal = compile_signal(message, found, limits=quantity != "command", sentinels=sentinels)
        layout = message_layout(message)
        wanted = self._wanted.setdefault((layout.identifier, layout.extended), _Wanted(message, layout))
        if wanted.message.name != message.name:
            raise ValueError(
                f"messages {wanted.message.name} and {message.name} have one identifier: mend the database"
            )
        if quantity == "command" and thruster.command_scale is not None:
            wanted.commands.append(CommandSignal(thruster.thruster, signal, thruster.command_scale))
        elif quantity == "speed":
            wanted.report(thruster.thruster, speed=thruster.speed_signal(signal, self._speed_limit_rpm))
        else:
            wanted.report(thruster.thruster, **{quantity: signal})
