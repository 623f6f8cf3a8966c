"""The CAN bus of a simulated vehicle: who says what when, as it fits on the bus."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

from drivers.can.frame import CanFrame
from hil_tests.rig.bus_clock import BusClock
from hil_tests.rig.esc_messages import EscReport
from hil_tests.rig.nodes import AutopilotNode, EscNodes, nodes_of
from hil_tests.rig.physical import PhysicalFaults
from hil_tests.rig.profile import Profile
from hil_tests.rig.vehicle import Vehicle


class BusTraffic:
    """Both ends of the bus, and what they have said.

    Args:
        profile: of the vehicle.
        vehicle: whose thrusters are driven and measured.

    Attributes:
        autopilot, escs: its nodes.
        reported: what each ESC said last.
        by_autopilot, by_devices: frames that nobody has asked for yet.
    """

    def __init__(self, profile: Profile, vehicle: Vehicle) -> None:
        self.autopilot: AutopilotNode
        self.escs: EscNodes
        self.autopilot, self.escs = nodes_of(profile)
        self._vehicle = vehicle
        self._signs = [-1.0 if thruster.reverse else 1.0 for thruster in profile.thrusters]
        self._clock = BusClock(profile.bus.bitrate)
        self._command_steps = profile.steps(profile.bus.command_hz)
        self._report_steps = profile.steps(profile.bus.report_hz)
        self._window_s = 1.0 / profile.bus.report_hz
        self._turns = _turns(len(self._signs), self._report_steps, profile.step_s)
        self._restarts: dict[int, int] = {}
        self.reported = [EscReport(0.0, vehicle.battery.voltage_v, 0.0)] * len(self._signs)
        self.by_autopilot: deque[CanFrame] = deque()
        self.by_devices: deque[CanFrame] = deque()

    def command(self, step: int, time_s: float, commands: Sequence[float]) -> None:
        """The autopilot tells the ESCs, if it is time."""
        if step % self._command_steps == 0:
            raw = [sign * command for sign, command in zip(self._signs, commands, strict=True)]
            self.by_autopilot += self._clock.send(time_s, self.autopilot.publish(time_s, raw))

    def obeyed(self, time_s: float) -> list[float]:
        """What the ESCs do now, as parts of full thrust ahead."""
        return [sign * raw for sign, raw in zip(self._signs, self.escs.commands(time_s), strict=True)]

    def restart(self, faults: PhysicalFaults, since_s: float) -> frozenset[int]:
        """ESCs that restart now do so; numbers of those that are down."""
        for number, resets in faults.resets.items():
            began = sum(reset.began(since_s) for reset in resets)
            if began != self._restarts.get(number, 0):
                self._restarts[number] = began
                self.escs.restart(number - 1)
        return faults.down(since_s)

    def report(self, step: int, time_s: float, down: frozenset[int]) -> None:
        """ESCs report whose turn it is: each at its own place in the period; they do not all speak at once."""
        for place, later_s in self._turns[step % self._report_steps]:
            if place + 1 not in down:
                report = self._measured(place)
                frames = self.escs.report(time_s + later_s, place, report)
                self.reported[place] = report
                self.by_devices += self._clock.send(time_s + later_s, frames)

    def _measured(self, place: int) -> EscReport:
        measured = self._vehicle.thrusters[place].measure(self._window_s)
        return EscReport(self._signs[place] * measured.speed_rpm, self._vehicle.battery.voltage_v, measured.supply_a)


def _turns(count: int, steps: int, step_s: float) -> list[list[tuple[int, float]]]:
    """Who of so many reports in which step of a period, and how much later than the step begins."""
    turns: list[list[tuple[int, float]]] = [[] for _ in range(steps)]
    for place in range(count):
        after = (place + 0.5) * steps / count
        turns[int(after)].append((place, (after - int(after)) * step_s))
    return turns


def taken(frames: deque[CanFrame], by_s: float) -> list[CanFrame]:
    """Takes out those of the frames that have been on the bus by a time."""
    gone = []
    while frames and frames[0].time_s <= by_s:
        gone.append(frames.popleft())
    return gone
