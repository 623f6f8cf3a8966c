"""VESC's CAN messages: where their numbers lie, and frames of them for the rig.

Source: `comm_can.c` of the VESC firmware (bldc). The identifier is extended: packet number above, controller id in
the lowest byte. Everything is big endian. SET_RPM is electrical rpm as it is, whatever some documents say.
"""

from __future__ import annotations

import struct
from dataclasses import astuple, dataclass
from enum import IntEnum
from typing import ClassVar, Literal

from drivers.can.frame import CanFrame

Control = Literal["duty", "current", "rpm", "current_rel"]

CONTROLLER_ID_MAX = 254  # 255 is all of them
CELSIUS_K = 273.15


class Packet(IntEnum):
    """CAN_PACKET_ID of what controllers are told and what they report; buffers, pings and settings are not here."""

    SET_DUTY = 0
    SET_CURRENT = 1
    SET_CURRENT_BRAKE = 2
    SET_RPM = 3
    SET_POS = 4
    STATUS = 9
    SET_CURRENT_REL = 10
    SET_CURRENT_BRAKE_REL = 11
    SET_CURRENT_HANDBRAKE = 12
    SET_CURRENT_HANDBRAKE_REL = 13
    STATUS_2 = 14
    STATUS_3 = 15
    STATUS_4 = 16
    STATUS_5 = 27


# of each kind of control: its packet, and the numbers on the wire for one of its unit (1, A, ERPM, 1)
CONTROLS: dict[Control, tuple[Packet, float]] = {
    "duty": (Packet.SET_DUTY, 1e5),
    "current": (Packet.SET_CURRENT, 1e3),
    "rpm": (Packet.SET_RPM, 1.0),
    "current_rel": (Packet.SET_CURRENT_REL, 1e5),
}
BRAKES = (
    Packet.SET_CURRENT_BRAKE,
    Packet.SET_CURRENT_BRAKE_REL,
    Packet.SET_CURRENT_HANDBRAKE,
    Packet.SET_CURRENT_HANDBRAKE_REL,
)


def identifier(packet: Packet, controller_id: int) -> int:
    """Of the frames of one packet to or from one controller."""
    return packet << 8 | controller_id


class _Scaled:
    """A message whose fields, in their order, are sent as `value * factor + offset`, rounded."""

    packet: ClassVar[Packet]
    layout: ClassVar[struct.Struct]
    scales: ClassVar[tuple[tuple[float, float], ...]]

    def frame(self, controller_id: int, time_s: float = 0.0) -> CanFrame:
        """The frame that the controller sends.

        Raises:
            ValueError: a value that does not fit its field, or a controller_id out of range.
        """
        numbers = [
            round(value * factor + offset)
            for value, (factor, offset) in zip(astuple(self), self.scales, strict=True)  # type: ignore[call-overload]
        ]
        return _frame(self.packet, controller_id, self.layout, numbers, self, time_s)


@dataclass(frozen=True, slots=True)
class Status(_Scaled):
    """STATUS: electrical rpm, motor current (negative while it brakes), duty cycle -1..1."""

    erpm: float
    current_a: float
    duty: float

    packet = Packet.STATUS
    layout = struct.Struct(">ihh")
    scales = ((1.0, 0.0), (10.0, 0.0), (1000.0, 0.0))


@dataclass(frozen=True, slots=True)
class Status2(_Scaled):
    """STATUS_2: charge drawn from the supply and given back, in Ah."""

    drawn_ah: float
    returned_ah: float

    packet = Packet.STATUS_2
    layout = struct.Struct(">ii")
    scales = ((1e4, 0.0), (1e4, 0.0))


@dataclass(frozen=True, slots=True)
class Status3(_Scaled):
    """STATUS_3: energy drawn from the supply and given back, in Wh."""

    drawn_wh: float
    returned_wh: float

    packet = Packet.STATUS_3
    layout = struct.Struct(">ii")
    scales = ((1e4, 0.0), (1e4, 0.0))


@dataclass(frozen=True, slots=True)
class Status4(_Scaled):
    """STATUS_4: temperatures of the MOSFETs and of the motor, supply current, position of the position control."""

    fet_temperature_k: float
    motor_temperature_k: float
    supply_current_a: float
    position_deg: float = 0.0

    packet = Packet.STATUS_4
    layout = struct.Struct(">hhhh")
    scales = ((10.0, -10.0 * CELSIUS_K), (10.0, -10.0 * CELSIUS_K), (10.0, 0.0), (50.0, 0.0))


@dataclass(frozen=True, slots=True)
class Status5(_Scaled):
    """STATUS_5: steps of the tachometer (six in an electrical turn), supply voltage, and two bytes for later."""

    tachometer: float
    voltage_v: float
    reserved: int = 0

    packet = Packet.STATUS_5
    layout = struct.Struct(">ihh")
    scales = ((1.0, 0.0), (10.0, 0.0), (1.0, 0.0))


_COMMAND = struct.Struct(">i")


def encode_command(control: Control, value: float, controller_id: int, time_s: float = 0.0) -> CanFrame:
    """A command for the rig.

    Args:
        control: what is commanded.
        value: duty cycle or share of the full current, -1..1; current in A; or electrical rpm.
        controller_id: 0..254.
        time_s: stamp of the frame.

    Raises:
        ValueError: a value that does not fit, or a controller_id out of range.
    """
    packet, factor = CONTROLS[control]
    return _frame(packet, controller_id, _COMMAND, [round(value * factor)], value, time_s)


def _frame(
    packet: Packet, controller_id: int, layout: struct.Struct, numbers: list[int], said: object, time_s: float
) -> CanFrame:
    if not 0 <= controller_id <= CONTROLLER_ID_MAX:
        raise ValueError(f"controller_id must lie in 0..{CONTROLLER_ID_MAX}, got {controller_id}")
    try:
        data = layout.pack(*numbers)
    except struct.error as error:
        raise ValueError(f"{said} does not fit into {packet.name}: {error}") from error
    return CanFrame(time_s, identifier(packet, controller_id), data)
