"""Thruster commands and ESC telemetry of a PX4 log: actuator_outputs, actuator_motors, esc_status.

actuator_outputs is what SERVO_OUTPUT_RAW and ACTUATOR_OUTPUT_STATUS are made of: 16 outputs an instance, in the unit
of the output's driver. In a log without it, actuator_motors stands in: motor 1 for output 1, -1 to 1, whatever
minimum, neutral and maximum the configuration has; NaN is a motor that is stopped. esc_status is published when any
of its ESCs said something: each has a time of its own, and is read where that is new.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import repeat

import numpy as np

from drivers.command import CommandScale
from drivers.logs.boot_clock import BootClock
from drivers.logs.damage import DamageReport
from drivers.logs.esc_currents import EscCurrents
from drivers.logs.plausible import Mask, between, optional, refuse_at
from drivers.logs.stamped import Stamped
from drivers.logs.ulog_topics import FloatArray, Topic
from drivers.mavlink.thrusters import (
    CELSIUS_ZERO_K,
    CHANNELS_PER_PORT,
    SPEED_MAX_RPM,
    TEMPERATURE_MAX_C,
    VOLTAGE_MAX_V,
    MavlinkThruster,
)
from drivers.readings import Reading, ThrusterCommand, ThrusterReport

OUTPUTS, MOTORS, ESCS = "actuator_outputs", "actuator_motors", "esc_status"
WANTED = (OUTPUTS, MOTORS, ESCS)


class UlogThrusters:
    """Commands and speeds of the configured thrusters.

    Args:
        thrusters: where to look for what.
        clock: of the log.
        damage: told what is implausible.
    """

    def __init__(self, thrusters: Sequence[MavlinkThruster], clock: BootClock, damage: DamageReport) -> None:
        self._thrusters = thrusters
        self._clock = clock
        self._damage = damage
        self._heard: dict[int, float] = {}  # ESCs: their own newest time
        self._currents = EscCurrents()

    def take(self, topic: Topic) -> Iterator[Stamped]:
        """Readings of one of `WANTED`."""
        for thruster in self._thrusters:
            output, scale = thruster.servo_channel or thruster.actuator, thruster.command_scale
            if topic.name == ESCS and thruster.esc_index is not None:
                yield from self._reports(topic, thruster, f"esc[{thruster.esc_index}].")
            elif topic.name == OUTPUTS and output is not None and scale is not None:
                yield from self._outputs(topic, thruster, output - 1, scale)
            elif topic.name == MOTORS and output is not None and scale is not None and topic.instance == 0:
                yield from self._motors(topic, thruster, output - 1, scale)

    def _outputs(
        self, topic: Topic, thruster: MavlinkThruster, output: int, scale: CommandScale
    ) -> Iterator[Stamped]:
        instance, place = divmod(output, CHANNELS_PER_PORT)
        column = f"output[{place}]"
        if topic.instance == instance and topic.has(column):
            value = topic.numbers(column)
            # SERVO_OUTPUT_RAW says 0 us of an output that is not in use
            used = np.isfinite(value) & ((value != 0.0) | (thruster.servo_channel is None))
            yield self._commands(topic.part(used), thruster.thruster, scale.fractions(value[used]))

    def _motors(self, topic: Topic, thruster: MavlinkThruster, motor: int, scale: CommandScale) -> Iterator[Stamped]:
        column = f"control[{motor}]"
        if topic.has(column):
            fraction = np.nan_to_num(topic.numbers(column), nan=0.0)
            yield self._commands(topic, thruster.thruster, -fraction if scale.reverse else fraction)

    def _commands(self, topic: Topic, number: int, fraction: FloatArray) -> Stamped:
        known = np.abs(fraction) <= 1.0  # False for NaN
        refuse_at(self._damage, topic.boot_s, ~known, "command out of range")
        time_s = topic.boot_s[known] + self._clock.offset_s
        return _stamped(time_s, list(map(ThrusterCommand, time_s.tolist(), repeat(number), fraction[known].tolist())))

    def _reports(self, topic: Topic, thruster: MavlinkThruster, prefix: str) -> Iterator[Stamped]:
        if not topic.has(prefix + "esc_rpm"):
            return
        said = topic.part(self._news(topic, thruster, prefix))
        time_s = said.boot_s + self._clock.offset_s
        columns = (
            self._speed(said, thruster, prefix),
            between(_column(said, prefix + "esc_voltage"), 0.0, VOLTAGE_MAX_V),
            self._currents.measured(thruster.thruster, _column(said, prefix + "esc_current")),
            between(_column(said, prefix + "esc_temperature"), 0.0, TEMPERATURE_MAX_C) + CELSIUS_ZERO_K,
        )
        errors = said.fields.get(prefix + "esc_errorcount", np.zeros(len(said), dtype=np.int64)).tolist()
        rows = zip(time_s.tolist(), *map(optional, columns), errors, strict=True)
        yield _stamped(time_s, [ThrusterReport(at_s, thruster.thruster, *rest) for at_s, *rest in rows])

    def _news(self, topic: Topic, thruster: MavlinkThruster, prefix: str) -> Mask:
        own = _column(topic, prefix + "timestamp")
        if np.isnan(own).any():
            return np.ones(len(topic), dtype=np.bool_)
        before = np.concatenate([[self._heard.get(thruster.thruster, 0.0)], own[:-1]])
        self._heard[thruster.thruster] = float(own[-1])
        news: Mask = (own != before) & (own > 0.0)
        return news

    def _speed(self, topic: Topic, thruster: MavlinkThruster, prefix: str) -> FloatArray:
        rpm = _column(topic, prefix + "esc_rpm")
        implausible = np.abs(rpm) > SPEED_MAX_RPM
        refuse_at(self._damage, topic.boot_s, implausible, "implausible speed")
        rpm[implausible] = np.nan
        return thruster.directed(rpm)


def _column(topic: Topic, name: str) -> FloatArray:
    """A field that not every version has."""
    return topic.numbers(name) if topic.has(name) else np.full(len(topic), np.nan)


def _stamped(time_s: FloatArray, readings: Sequence[Reading]) -> Stamped:
    return Stamped(time_s, np.zeros(len(time_s), dtype=np.intp), readings)
