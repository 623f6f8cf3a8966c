"""Messages of fixed layout, of a database or of VESCs, changed on their way: bit by bit, all else as it was."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf

from drivers.can.messages.plan import MessageLayout
from drivers.can.messages.pulse_count import INTERVAL_MAX_S, INTERVAL_MIN_S
from drivers.can.messages.signal_reader import Signal
from drivers.can.messages.speed_reader import SpeedSignal
from drivers.can.messages.thruster_reader import CommandSignal
from hil_tests.wires.bit_writer import raw_number, with_number
from hil_tests.wires.frame_faults import Due
from hil_tests.wires.protection import Protection, Seal
from hil_tests.wires.thruster_values import ThrusterValue
from hil_tests.wires.transfer_edits import wire_value
from hil_tests.wires.way import Towards

# from the true value to what is said instead; None: nothing
Says = Callable[[float], float | None]


@dataclass(frozen=True, slots=True)
class EditedMessage:
    """What can be changed in one message.

    Attributes:
        layout: of its frames.
        commands: of thrusters.
        speeds: of thrusters, by number.
        protection: its counter and checksum; None: it has neither.
    """

    layout: MessageLayout
    commands: tuple[CommandSignal, ...] = ()
    speeds: tuple[tuple[int, SpeedSignal], ...] = ()
    protection: Protection | None = None


class Slot(ABC):
    """A value among the bits of a message."""

    renumbers = False  # whether it is another than came in, without a fault that is active

    @abstractmethod
    def edited(self, time_s: float, data: bytes, says: Says) -> bytes | None:
        """The data with what is said instead, themselves where that is the same; None: nothing is said."""


class PlainSlot(Slot):
    """A signal that stands for a value by itself.

    Args:
        signal: where it is.
        value: from what the signal tells to the value; None: it is none.
        told: back.
    """

    def __init__(
        self, signal: Signal, value: Callable[[float], float | None], told: Callable[[float], float]
    ) -> None:
        self._signal = signal
        self._value = value
        self._told = told

    @classmethod
    def of_speed(cls, speed: SpeedSignal) -> PlainSlot:
        """rpm, positive ahead; of a sensor that knows no direction the magnitude."""
        if not speed.signed:
            return cls(speed.signal, lambda told: abs(told * speed.rpm), lambda rpm: abs(rpm / speed.rpm))
        return cls(speed.signal, lambda told: told * speed.rpm, lambda rpm: rpm / speed.rpm)

    @classmethod
    def of_command(cls, command: CommandSignal) -> PlainSlot:
        """Share of full thrust."""
        return cls(command.signal, command.scale.fraction, lambda said: wire_value(command.scale, said))

    def edited(self, time_s: float, data: bytes, says: Says) -> bytes | None:
        told = reading(self._signal, data)
        true = None if told is None else self._value(told)
        if true is None:
            return data
        said = says(true)
        return None if said is None else data if said == true else self.written(data, said)

    def written(self, data: bytes, said: float) -> bytes:
        """The data with a value in them."""
        return with_number(data, self._signal.field, raw_number(self._signal, self._told(said)))


class CountSlot(Slot):
    """A count of pulses that runs on: a speed that is changed makes it run faster or slower from there on.

    Args:
        speed: a signal that counts.
    """

    def __init__(self, speed: SpeedSignal) -> None:
        self._speed = speed
        self._span = 1 << speed.signal.field.bits
        self._newest, self._newest_s = 0, -inf
        self._ahead = 0.0  # of the true count, in counts

    @property
    def renumbers(self) -> bool:  # type: ignore[override]
        """Whether the count is no longer the one that came in."""
        return round(self._ahead) % self._span != 0

    def edited(self, time_s: float, data: bytes, says: Says) -> bytes | None:
        field = self._speed.signal.field
        count = int(field.reader(len(data))(data))
        interval_s = time_s - self._newest_s
        said_rpm: float | None = 0.0  # of the first frame nothing is known yet
        if INTERVAL_MIN_S <= interval_s <= INTERVAL_MAX_S:
            per_count = self._speed.rpm * self._speed.signal.scale / interval_s
            true_rpm = self._since(count) * per_count
            said_rpm = says(true_rpm)
            if said_rpm is not None and said_rpm != true_rpm:
                self._ahead += self._signed(said_rpm) / per_count - self._since(count)
        self._newest, self._newest_s = count, time_s
        if said_rpm is None:
            return None
        return with_number(data, field, (count + round(self._ahead)) % self._span) if self.renumbers else data

    def written(self, data: bytes, said: float) -> bytes:
        """The data of a count that stands still."""
        return with_number(data, self._speed.signal.field, 0)

    def _signed(self, said_rpm: float) -> float:
        """A sensor that knows no direction counts up, whichever way the shaft turns."""
        return said_rpm if self._speed.signed else abs(said_rpm) if self._speed.rpm > 0.0 else -abs(said_rpm)

    def _since(self, count: int) -> int:
        steps = (count - self._newest) % self._span
        return steps - self._span if self._speed.signed and steps >= self._span // 2 else steps


def slot_of_speed(speed: SpeedSignal) -> PlainSlot | CountSlot:
    """Where a speed is."""
    return CountSlot(speed) if speed.counts else PlainSlot.of_speed(speed)


def reading(signal: Signal, data: bytes) -> float | None:
    """What a signal tells; None where the frame does not have it, or its number is no value."""
    for selector, wanted in signal.selectors:
        if selector.reader(len(data))(data) not in wanted:
            return None
    raw = signal.field.reader(len(data))(data)
    value = raw * signal.scale + signal.offset
    plausible = signal.lowest <= value <= signal.highest and raw not in signal.not_available
    return value if plausible else None


class MessageEdits:
    """All messages of a bus, one frame after the other.

    Args:
        messages: that can be changed.
        speeds, commands: by thruster; those that have faults.
        counts: what cannot be made right is counted here.
    """

    def __init__(
        self,
        messages: Sequence[EditedMessage],
        speeds: Mapping[int, ThrusterValue],
        commands: Mapping[int, ThrusterValue],
        counts: Counter[str],
    ) -> None:
        self._messages: dict[tuple[Towards, int, bool], _Message] = {}
        for one in messages:
            slots: dict[Towards, list[tuple[Slot, ThrusterValue]]] = {
                Towards.AUTOPILOT: [
                    (slot_of_speed(at), speeds[number]) for number, at in one.speeds if number in speeds
                ],
                Towards.DEVICES: [
                    (PlainSlot.of_command(at), commands[at.thruster])
                    for at in one.commands
                    if at.thruster in commands
                ],
            }
            thrusters = {number for number, _ in one.speeds} | {at.thruster for at in one.commands}
            for towards, found in slots.items():
                if found:
                    key = towards, one.layout.identifier, one.layout.extended
                    self._messages[key] = _Message(one, found, len(thrusters) == 1, counts)

    @property
    def renumbers(self) -> bool:
        """Whether counters are no longer those that came in."""
        return any(message.renumbers for message in self._messages.values())

    def take(self, since_s: float, due: Due) -> list[Due]:
        """What goes on when a frame comes: itself, another in its place, or none."""
        frame = due.frame
        message = self._messages.get((due.towards, frame.identifier, frame.extended))
        if message is None or frame.error:
            return [due]
        data = message.edited(since_s, frame.data)
        if data is None:
            return []
        return [due] if data is frame.data else [due._replace(frame=replace(frame, data=data))]


class _Message:
    """One message towards one end, with what is changed in it."""

    def __init__(
        self,
        message: EditedMessage,
        slots: Sequence[tuple[Slot, ThrusterValue]],
        alone: bool,
        counts: Counter[str],
    ) -> None:
        self._length = message.layout.length
        self._slots = slots
        self._alone = alone  # nobody else's values are in it: it may stay away
        self._seal = None if message.protection is None else Seal(message.protection, counts)

    @property
    def renumbers(self) -> bool:
        sealed = self._seal is not None and self._seal.renumbers
        return sealed or any(slot.renumbers for slot, _ in self._slots)

    def edited(self, since_s: float, data: bytes) -> bytes | None:
        if len(data) < self._length:
            return data
        if self._seal is not None:
            self._seal.watch(data)
        edited: bytes | None = data
        for slot, value in self._slots:
            edited = None if edited is None else slot.edited(since_s, edited, self._says(since_s, value))
        return self._protected(edited, data)

    def _says(self, since_s: float, value: ThrusterValue) -> Says:
        told = value.said if self._alone else value.said_among_others
        return lambda true: told(since_s, true)

    def _protected(self, edited: bytes | None, data: bytes) -> bytes | None:
        if self._seal is None:
            return edited
        if edited is None:
            self._seal.withheld += 1
            return None
        return self._seal.sealed(edited, changed=edited != data)
