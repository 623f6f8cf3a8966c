"""Speeds in rpm and commands as shares of full thrust, of one thruster, in the autopilot's messages.

All of these messages tell of several thrusters. One of which nothing comes any more is told as autopilots tell it.
"""

from __future__ import annotations

from math import nan

from drivers.command import CommandScale
from drivers.mavlink.formats import (
    ACTUATOR_OUTPUT_STATUS,
    ESC_STATUS,
    ESC_TELEMETRY,
    RPM,
    SERVO_OUTPUT_RAW,
    MessageFormat,
)
from drivers.mavlink.thruster_speeds import ESCS_PER_MESSAGE
from drivers.mavlink.thrusters import CHANNELS_PER_PORT, MavlinkThruster
from hil_tests.wires.distortion import Vector
from hil_tests.wires.mavlink.fields import Fields
from hil_tests.wires.mavlink.signal import Signal

UNUSED_US = 0  # SERVO_OUTPUT_RAW
NO_SIGNAL_RPM = -1.0  # RPM
CHANNELS_BEFORE_PORT = 8  # in SERVO_OUTPUT_RAW the port stands between the eighth channel and the ninth
PORT_PLACE = 9
RPM_PLACE, COUNT_PLACE = 12, 16  # in ESC_TELEMETRY_*
INDEX_PLACE = 13  # in ESC_STATUS


class EscTelemetry(Signal):
    """ESC_TELEMETRY_*: speeds without a sign, and counters of what the ESCs sent.

    Args:
        esc_index: over all of these messages, from 0.
    """

    def __init__(self, esc_index: int) -> None:
        group, place = divmod(esc_index, ESCS_PER_MESSAGE)
        self.message = ESC_TELEMETRY[group]
        self._speed = Fields.of(self.message, RPM_PLACE + place)
        self._count = Fields.of(self.message, COUNT_PLACE + place)

    def read(self, payload: bytes) -> Vector | None:
        """See `Signal`."""
        return self._speed.read(payload)

    def write(self, payload: bytearray, value: Vector) -> None:
        """See `Signal`."""
        self._speed.write(payload, [abs(value[0])])

    def silence(self, payload: bytearray, told: bytes) -> bool:
        """The last values again, with a counter that stands still: as ArduPilot does while nothing comes."""
        self._speed.write(payload, self._speed.read(told))
        self._count.write(payload, self._count.read(told))
        return True


class EscStatus(Signal):
    """PX4's ESC_STATUS: speeds of four ESCs from an index on.

    Args:
        esc_index: from 0.
        reverse: True where a positive speed drives astern.
    """

    message = ESC_STATUS
    _index = Fields.of(ESC_STATUS, INDEX_PLACE)
    _speeds = Fields.of(ESC_STATUS, 1, ESCS_PER_MESSAGE)

    def __init__(self, esc_index: int, reverse: bool) -> None:
        self._esc_index = esc_index
        self._sign = -1.0 if reverse else 1.0

    def read(self, payload: bytes) -> Vector | None:
        """Positive ahead; None where the payload is of other ESCs."""
        place = self._place(payload)
        return (self._sign * self._speeds.read(payload)[place],) if 0 <= place < ESCS_PER_MESSAGE else None

    def write(self, payload: bytearray, value: Vector) -> None:
        """See `Signal`."""
        speeds = list(self._speeds.read(payload))
        speeds[self._place(payload)] = self._sign * value[0]
        self._speeds.write(payload, speeds)

    def silence(self, payload: bytearray, told: bytes) -> bool:
        """The last value again: there is no word for none."""
        self.write(payload, self.read(told) or (0.0,))
        return True

    def _place(self, payload: bytes | bytearray) -> int:
        return self._esc_index - int(self._index.read(payload)[0])


class RpmSensor(Signal):
    """RPM: of two sensors.

    Args:
        sensor: 1 or 2.
    """

    message = RPM

    def __init__(self, sensor: int) -> None:
        self._speed = Fields.of(RPM, sensor - 1)

    def read(self, payload: bytes) -> Vector | None:
        """None where the sensor has no signal."""
        [speed_rpm] = self._speed.read(payload)
        return None if speed_rpm < 0.0 else (speed_rpm,)

    def write(self, payload: bytearray, value: Vector) -> None:
        """Without a sign: a negative one would be the word for no signal."""
        self._speed.write(payload, [abs(value[0])])

    def silence(self, payload: bytearray, told: bytes) -> bool:
        """No signal."""
        self._speed.write(payload, [NO_SIGNAL_RPM])
        return True


class Output(Signal):
    """An output of the autopilot to a thruster, in the unit of the wire.

    Args:
        message: that carries it.
        place: of it, see `Fields.of`.
        scale: from the unit of the wire to shares of full thrust.
        unused: what the field holds while there is no command.
        port: field of the port, and which one is meant; None: there are none.
    """

    def __init__(
        self,
        message: MessageFormat,
        place: int,
        scale: CommandScale,
        unused: float,
        port: tuple[Fields, int] | None = None,
    ) -> None:
        self.message = message
        self._fields = Fields.of(message, place)
        self._scale = scale
        self._unused = unused
        self._port = port

    def read(self, payload: bytes) -> Vector | None:
        """-1 to 1; None where it is no command."""
        if self._port is not None and self._port[0].read(payload) != (self._port[1],):
            return None
        [output] = self._fields.read(payload)
        fraction = self._scale.fraction(output)
        return None if fraction is None or output == self._unused else (fraction,)

    def write(self, payload: bytearray, value: Vector) -> None:
        """As far as the scale goes."""
        lowest, highest = _reach(self._scale)
        self._fields.write(payload, [self._scale.value(max(lowest, min(value[0], highest)))])

    def silence(self, payload: bytearray, told: bytes) -> bool:
        """An output that is not in use."""
        self._fields.write(payload, [self._unused])
        return True


def speeds(thruster: MavlinkThruster) -> list[Signal]:
    """Wherever the speed of a thruster is told."""
    found: list[Signal] = []
    if thruster.rpm_sensor is not None:
        found.append(RpmSensor(thruster.rpm_sensor))
    if thruster.esc_index is not None:
        found.append(EscStatus(thruster.esc_index, thruster.reverse))
        if thruster.esc_index < ESCS_PER_MESSAGE * len(ESC_TELEMETRY):
            found.append(EscTelemetry(thruster.esc_index))
    return found


def commands(thruster: MavlinkThruster) -> list[Signal]:
    """Wherever the command of a thruster is told."""
    if thruster.command_scale is None:
        return []
    if thruster.actuator is not None:
        return [Output(ACTUATOR_OUTPUT_STATUS, thruster.actuator + 1, thruster.command_scale, nan)]
    if thruster.servo_channel is None:
        return []
    port, channel = divmod(thruster.servo_channel - 1, CHANNELS_PER_PORT)
    place = 1 + channel if channel < CHANNELS_BEFORE_PORT else 2 + channel
    port_field = Fields.of(SERVO_OUTPUT_RAW, PORT_PLACE)
    return [Output(SERVO_OUTPUT_RAW, place, thruster.command_scale, UNUSED_US, (port_field, port))]


def _reach(scale: CommandScale) -> tuple[float, float]:
    """The least and the greatest share that a scale has."""
    above = 1.0 if scale.neutral < scale.maximum else 0.0
    below = 1.0 if scale.minimum < scale.neutral else 0.0
    return (-above, below) if scale.reverse else (-below, above)
