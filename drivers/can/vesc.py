"""VESC motor controllers on CAN: commands and status of thrusters.

`current_a` of their reports is the motor's, from STATUS: it is sent with the speed and as often, and it is what the
shaft's torque asks for. STATUS_4's is the supply's, which is the smaller the slower the motor turns; the two in one
series would contradict each other, so that it is not read.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import get_args

from drivers.can.frame import CanFrame
from drivers.can.frame_block import FrameBlock
from drivers.can.messages.bit_field import BitField
from drivers.can.messages.decoder import MessageDecoder, Plan
from drivers.can.messages.plan import Columns, IndexArray, MessageLayout, MessagePlan
from drivers.can.messages.signal_reader import Signal
from drivers.can.messages.speed_reader import SPEED_LIMIT_RPM, SpeedSignal
from drivers.can.messages.thruster_reader import CommandSignal, ReportSignals
from drivers.can.twins import refuse_twins
from drivers.can.vesc_messages import BRAKES, CELSIUS_K, CONTROLLER_ID_MAX, CONTROLS, Control, Packet, identifier
from drivers.command import CommandScale
from drivers.readings import Reading

__all__ = ["Control", "VescDecoder", "VescThruster"]

_COMMAND = BitField(0, 32, big_endian=True, kind="signed")
_ERPM = _COMMAND
_CURRENT = Signal(BitField(32, 16, big_endian=True, kind="signed"), scale=0.1)
# A VESC that speaks has a supply.
_VOLTAGE = Signal(BitField(32, 16, big_endian=True, kind="signed"), scale=0.1, lowest=0.05)
# What a thermistor on a board can tell, -55 to 200 degrees Celsius: outside there is none, or it has come off.
_TEMPERATURE = Signal(
    BitField(0, 16, big_endian=True, kind="signed"),
    0.1,
    CELSIUS_K,
    lowest=CELSIUS_K - 55.0,
    highest=CELSIUS_K + 200.0,
)


@dataclass(frozen=True, slots=True)
class VescThruster:
    """One thruster behind a VESC.

    Attributes:
        thruster: number of the thruster in the configuration, from 1.
        controller_id: the VESC's own ("VESC ID" in VESC Tool), 0..254.
        control: the kind of its commands; None: its commands are not on this bus.
        command_scale: of them: duty cycle or share of the full current, A, or electrical rpm; neutral is 0.
        pole_pairs: of the motor; None: its status is not read.
        signed: False: the magnitude of the speed is reported.
        reverse: True where a positive speed is astern. The command's direction is in `command_scale`.

    Raises:
        ValueError: a number out of range, one setting without the other that it needs, or nothing to read.
    """

    thruster: int
    controller_id: int
    control: Control | None = None
    command_scale: CommandScale | None = None
    pole_pairs: int | None = None
    signed: bool = True
    reverse: bool = False

    def __post_init__(self) -> None:
        if self.thruster < 1:
            raise ValueError(f"thruster must be at least 1, got {self.thruster}")
        if not 0 <= self.controller_id <= CONTROLLER_ID_MAX:
            raise ValueError(f"controller_id must lie in 0..{CONTROLLER_ID_MAX}, got {self.controller_id}")
        if self.control is not None and self.control not in get_args(Control):
            raise ValueError(f"control must be one of {', '.join(get_args(Control))}, got {self.control!r}")
        if (self.control is None) != (self.command_scale is None):
            raise ValueError("control and command_scale must be given together")
        if self.command_scale is not None and self.command_scale.neutral != 0.0:
            raise ValueError(f"neutral of a VESC is 0, got {self.command_scale.neutral}")
        if self.pole_pairs is not None and self.pole_pairs < 1:
            raise ValueError(f"pole_pairs must be at least 1, got {self.pole_pairs}")
        if self.control is None and self.pole_pairs is None:
            raise ValueError(f"thruster {self.thruster} must have control or pole_pairs")


class VescDecoder(MessageDecoder):
    """Frames of VESCs and of whoever commands them to commands and reports of thrusters.

    A brake is read as the command 0: it asks for no thrust. Causes counted in `drops`: "wrong length" (too short;
    what stands behind the numbers is let pass), "command of another kind" (than `control`: SET_RPM in place of
    SET_DUTY), "command out of range", "implausible speed", "implausible voltage", "implausible temperature".

    Args:
        thrusters: what is wired to the bus.
        speed_limit_rpm: a faster report is implausible.

    Raises:
        ValueError: two thrusters with one number or one controller_id, or a limit that is not positive.
    """

    def __init__(self, thrusters: Sequence[VescThruster], speed_limit_rpm: float = SPEED_LIMIT_RPM) -> None:
        if not speed_limit_rpm > 0.0:
            raise ValueError(f"speed_limit_rpm must be positive, got {speed_limit_rpm}")
        refuse_twins(
            thruster=[one.thruster for one in thrusters], controller_id=[one.controller_id for one in thrusters]
        )
        drops: Counter[str] = Counter()
        plans = [
            plan
            for one in thrusters
            for plan in (*_command_plans(one, drops), *_status_plans(one, speed_limit_rpm, drops))
        ]
        super().__init__(plans, drops)


def _command_plans(one: VescThruster, drops: Counter[str]) -> Iterator[Plan]:
    if one.control is None or one.command_scale is None:
        return
    wanted, factor = CONTROLS[one.control]
    command = CommandSignal(one.thruster, Signal(_COMMAND, 1.0 / factor), one.command_scale)
    yield MessagePlan(_layout(wanted, one, 4), [command], [], drops)
    released = CommandSignal(one.thruster, Signal(_COMMAND, scale=0.0), one.command_scale)
    for brake in BRAKES:
        yield MessagePlan(_layout(brake, one, 4), [released], [], drops)
    others = {packet for packet, _ in CONTROLS.values()} | {Packet.SET_POS}
    for other in sorted(others - {wanted}):
        yield _OtherControl(_layout(other, one, 4), drops)


def _status_plans(one: VescThruster, limit_rpm: float, drops: Counter[str]) -> Iterator[Plan]:
    if one.pole_pairs is None:
        return
    rpm = (-1.0 if one.reverse else 1.0) / one.pole_pairs
    speed = SpeedSignal(Signal(_ERPM), rpm, limit_rpm, one.signed)
    motion = ReportSignals(one.thruster, speed=speed, current=_CURRENT)
    yield MessagePlan(_layout(Packet.STATUS, one, 6), [], [motion], drops)
    yield MessagePlan(
        _layout(Packet.STATUS_4, one, 2), [], [ReportSignals(one.thruster, temperature=_TEMPERATURE)], drops
    )
    yield MessagePlan(_layout(Packet.STATUS_5, one, 6), [], [ReportSignals(one.thruster, voltage=_VOLTAGE)], drops)


def _layout(packet: Packet, one: VescThruster, length: int) -> MessageLayout:
    """Of a packet, of which the first `length` bytes are read."""
    return MessageLayout(identifier(packet, one.controller_id), extended=True, length=length, tail=True)


class _OtherControl:
    """Commands that the configuration does not expect: counted, or nobody would know why there are none."""

    def __init__(self, message: MessageLayout, drops: Counter[str]) -> None:
        self.message = message
        self._drops = drops

    def decode(self, _frame: CanFrame) -> Sequence[Reading]:
        self._drops["command of another kind"] += 1
        return ()

    def decode_block(self, _block: FrameBlock, row: IndexArray) -> Columns:
        if len(row):
            self._drops["command of another kind"] += len(row)
        return [], []
