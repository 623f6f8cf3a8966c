"""What a vehicle's two CAN buses carry: four ESCs and their autopilot on each, and whatever else there is."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from itertools import count
from math import exp, pi, sin
from random import Random

from drivers.can.dronecan import EscStatus, encode_esc_status, encode_raw_command
from drivers.can.frame import CanFrame

THRUSTERS = 8
ESCS = 4  # on each bus
AUTOPILOT_NODE, FIRST_ESC_NODE = 10, 20
# A bus at 1 Mbit/s is full of frames with long identifiers and eight bytes
FULL_BUS_HZ = 7_500.0
FRAMES_A_PERIOD = 1 + 3 * ESCS  # commands of four fit into one frame, each status takes three
USUAL_HZ = 50.0
# an ESC speaks, frame after frame, in a moment; all that is due in one is handed over together
MOMENT_S = 0.001

FULL_RPM, LAG_S, NOISE = 3000.0, 0.06, 0.002
SLOWED = 0.7  # of its speed, for a thruster that has caught something
LEARN_S = 25.0
FAULT_EVERY_S, FAULT_S = 2.0, 0.8
UNWANTED = 1063 << 8 | 77  # gnss.Fix2, of another node


class Load(Enum):
    """How much the buses carry, in words."""

    USUAL = "8 ESCs at 50 Hz"
    FILTERED = "full buses, other frames"
    WANTED = "full buses, all of ESCs"

    @property
    def rate_hz(self) -> float:
        """Of commands and of each ESC."""
        return FULL_BUS_HZ / FRAMES_A_PERIOD if self is Load.WANTED else USUAL_HZ


@dataclass(frozen=True, slots=True)
class Fault:
    """A thruster, from 1, turns slower for `FAULT_S`; time in seconds since the start of the traffic."""

    time_s: float
    thruster: int


@dataclass(frozen=True, slots=True)
class Plan:
    """What is played.

    Attributes:
        load: of the buses.
        seconds: in which faults come and go.
        learn_s: before that.
    """

    load: Load
    seconds: float
    learn_s: float = LEARN_S

    @property
    def end_s(self) -> float:
        """Of the traffic."""
        return self.learn_s + self.seconds

    def faults(self, bus: int) -> list[Fault]:
        """Of the thrusters on a bus: of all, one has caught something after the other."""
        every = range(int(self.seconds / FAULT_EVERY_S))
        faults = [Fault(self.learn_s + number * FAULT_EVERY_S, number % THRUSTERS + 1) for number in every]
        return [fault for fault in faults if fault.thruster in thrusters_of(bus)]


def thrusters_of(bus: int) -> range:
    """Bus 0 carries thrusters 1 to 4, bus 1 the others."""
    return range(1 + ESCS * bus, 1 + ESCS * (bus + 1))


def traffic(bus: int, plan: Plan) -> Iterator[CanFrame]:
    """Frames of one bus, in order of their times."""
    escs, period_s = _Escs(bus, plan), 1.0 / plan.load.rate_hz
    others = round(FULL_BUS_HZ * period_s) - FRAMES_A_PERIOD if plan.load is Load.FILTERED else 0
    for number in count():
        time_s = number * period_s
        if time_s >= plan.end_s:
            return
        yield from escs.frames(number, time_s, period_s)
        for place in range(1, others + 1):
            yield CanFrame(_moment(time_s + place * period_s / (others + 1)), UNWANTED, bytes(8))


def is_onset(frame: CanFrame, fault: Fault) -> bool:
    """Whether it is the first frame of a status that shows a fault, or of a later one."""
    node = FIRST_ESC_NODE + fault.thruster - 1
    return frame.time_s >= _moment(fault.time_s) and frame.identifier & 0x7F == node


def _moment(time_s: float) -> float:
    return int(time_s / MOMENT_S + 1e-6) * MOMENT_S


class _Escs:
    """Four thrusters with a first-order lag behind commands that are never still."""

    def __init__(self, bus: int, plan: Plan) -> None:
        self._numbers = thrusters_of(bus)
        self._faults = plan.faults(bus)
        self._speeds_rpm = dict.fromkeys(self._numbers, 0.0)
        self._random = Random(bus)

    def frames(self, number: int, time_s: float, period_s: float) -> Iterator[CanFrame]:
        """One period: what is commanded, and what each ESC reports."""
        stamp_s = _moment(time_s)
        commands = [_command(thruster, time_s) for thruster in self._numbers]
        yield from encode_raw_command(
            [round(8191 * one) for one in commands], AUTOPILOT_NODE, number % 32, time_s=stamp_s
        )
        for index, (thruster, command) in enumerate(zip(self._numbers, commands, strict=True)):
            status = EscStatus(
                0, 16.0, 10.0 * command, 310.0, self._turned(thruster, command, time_s, period_s), 50, index
            )
            yield from encode_esc_status(status, FIRST_ESC_NODE + thruster - 1, number % 32, time_s=stamp_s)

    def _turned(self, thruster: int, command: float, time_s: float, period_s: float) -> int:
        speed_rpm = self._speeds_rpm[thruster]
        speed_rpm += (FULL_RPM * command - speed_rpm) * (1.0 - exp(-period_s / LAG_S))
        self._speeds_rpm[thruster] = speed_rpm
        slowed = any(
            fault.thruster == thruster and fault.time_s <= time_s + 1e-6 < fault.time_s + FAULT_S
            for fault in self._faults
        )
        return round(speed_rpm * (SLOWED if slowed else 1.0) * self._random.gauss(1.0, NOISE))


def _command(thruster: int, time_s: float) -> float:
    slow, fast = 2.0 * pi * 0.05 * time_s, 2.0 * pi * 0.31 * time_s
    return 0.55 + 0.2 * sin(slow + thruster) + 0.12 * sin(fast + 2.0 * thruster)
