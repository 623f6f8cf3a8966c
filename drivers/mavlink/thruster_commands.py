"""The autopilot's outputs to its thrusters, from unpacked payloads to readings. Values are in wire order."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from typing import Any

from drivers.command import CommandScale
from drivers.construction import constructor
from drivers.mavlink.formats import ACTUATOR_OUTPUT_STATUS, SERVO_OUTPUT_RAW
from drivers.mavlink.freshness import Freshness
from drivers.mavlink.thrusters import CHANNELS_PER_PORT, MavlinkThruster
from drivers.readings import Reading, ThrusterCommand

_command = constructor(ThrusterCommand)


class _Fractions(dict[int, float | None]):
    """A command scale to look up: pulses are whole, and those of a working output few."""

    def __init__(self, scale: CommandScale) -> None:
        self._scale = scale

    def __missing__(self, pulse_us: int) -> float | None:
        fraction = self._scale.fraction(pulse_us)
        if fraction is not None:  # else any of 65536, and not worth their room
            self[pulse_us] = fraction
        return fraction


class ThrusterCommands:
    """Commands of the configured thrusters.

    Args:
        thrusters: where to look for what.
        drops: counted here by cause.
    """

    def __init__(self, thrusters: Sequence[MavlinkThruster], drops: Counter[str]) -> None:
        self._drops = drops
        self._fresh = Freshness(drops)
        self._actuators: list[tuple[int, int, CommandScale]] = []  # place in the message, thruster, scale
        self._servos: defaultdict[int, list[tuple[int, int, _Fractions]]] = defaultdict(list)  # the same, by port
        for one in thrusters:
            if one.command_scale is not None and one.actuator is not None:
                self._actuators.append((one.actuator + 1, one.thruster, one.command_scale))
            elif one.command_scale is not None and one.servo_channel is not None:
                port, channel = divmod(one.servo_channel - 1, CHANNELS_PER_PORT)
                place = channel + (1 if channel < 8 else 2)  # the port stands between the eighth and the ninth
                self._servos[port].append((place, one.thruster, _Fractions(one.command_scale)))

    def servo_output(self, values: tuple[Any, ...], time_s: float) -> list[Reading]:
        """SERVO_OUTPUT_RAW: port 0 has channels 1-16, port 1 has 17-32; 0 us is a channel that is not in use."""
        time_us, port = values[0], values[9]
        if not self._fresh.accepts((SERVO_OUTPUT_RAW.message_id, port), time_us, ticks_per_s=1_000_000):
            return []
        readings: list[Reading] = []
        for place, thruster, fractions in self._servos.get(port, ()):
            if pulse_us := values[place]:
                self._add(readings, time_s, thruster, fractions[pulse_us])
        return readings

    def actuator_output(self, values: tuple[Any, ...], time_s: float) -> list[Reading]:
        """ACTUATOR_OUTPUT_STATUS: 0 is an output that is not in use, unless it lies within the scale.

        `active` is not looked at: a bit mask by the message's definition, PX4 sends the number of outputs in it.
        """
        if not self._fresh.accepts(ACTUATOR_OUTPUT_STATUS.message_id, values[0], ticks_per_s=1_000_000, bits=64):
            return []
        readings: list[Reading] = []
        for place, thruster, scale in self._actuators:
            output = values[place]
            if output or scale.minimum <= 0.0 <= scale.maximum:
                self._add(readings, time_s, thruster, scale.fraction(output))
        return readings

    def _add(self, readings: list[Reading], time_s: float, thruster: int, fraction: float | None) -> None:
        if fraction is None:
            self._drops["command out of range"] += 1
        else:
            readings.append(_command(time_s, thruster, fraction))
