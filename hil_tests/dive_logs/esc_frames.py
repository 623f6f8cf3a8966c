"""Commands and reports of thrusters in an ArduPilot's own log, as DroneCAN frames of the bus that its ESCs are on.

ArduPilot numbers ESCs on DroneCAN as its servo outputs: output 1 is ESC index 0, in esc.RawCommand as in its log.
Which node an ESC is, and what else it said of itself, is not logged: nodes are numbered on from `FIRST_ESC_NODE`, and
tell that they are well.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from math import nan

from drivers.can.dronecan import (
    COMMAND_MAX,
    EscStatus,
    NodeStatus,
    encode_esc_status,
    encode_node_status,
    encode_raw_command,
    encode_rpm_command,
)
from drivers.can.frame import CanFrame
from drivers.command import CommandScale
from drivers.mavlink.thrusters import MavlinkThruster
from drivers.readings import ThrusterCommand, ThrusterReport
from gateway.config_sections import CanBus, Thruster
from gateway.wiring import PWM_DEAD_BAND_US, PWM_MAXIMUM_US, PWM_MINIMUM_US, PWM_NEUTRAL_US

AUTOPILOT_NODE = 10
FIRST_ESC_NODE = 11
NODE_STATUS_PERIOD_S = 1.0
PULSES = CommandScale(PWM_MINIMUM_US, PWM_NEUTRAL_US, PWM_MAXIMUM_US, PWM_DEAD_BAND_US)


def as_servos(thrusters: Sequence[Thruster], bus: CanBus) -> Iterator[MavlinkThruster]:
    """Where in the log the thrusters of a bus are found."""
    for one in thrusters:
        commanded = one.command.esc_index if one.command.link == bus.name else None
        measured = one.rpm.esc_index if one.rpm.link == bus.name else None
        if commanded is not None or measured is not None:
            yield MavlinkThruster(
                one.number,
                servo_channel=None if commanded is None else commanded + 1,
                command_scale=None if commanded is None else PULSES,
                esc_index=measured,
                signed=True,
            )


class EscFrames:
    """Commands and reports of an instant in, frames out.

    Args:
        thrusters: of the configuration.
        bus: that of these frames.
    """

    def __init__(self, thrusters: Sequence[Thruster], bus: CanBus) -> None:
        self._commanded = {one.number: one for one in thrusters if one.command.link == bus.name}
        self._measured = {one.number: one for one in thrusters if one.rpm.link == bus.name}
        self._fractions: dict[int, float] = {}  # by ESC index
        self._transfers: Counter[tuple[str, int]] = Counter()
        self._started_s: dict[int, float] = {}
        self._alive_s: dict[int, float] = {}

    def commands(self, commands: Sequence[ThrusterCommand], time_s: float) -> Iterator[CanFrame]:
        """esc.RawCommand, or esc.RPMCommand where the configuration reads that."""
        ours = [(self._commanded[one.thruster].command, one) for one in commands if one.thruster in self._commanded]
        for source, command in ours:
            self._fractions[source.esc_index or 0] = -command.fraction if source.reverse else command.fraction
        if not ours:
            return
        fractions = [self._fractions.get(index, 0.0) for index in range(max(self._fractions) + 1)]
        maximum_rpm, transfer_id = ours[0][0].maximum_rpm, self._transfer("command", AUTOPILOT_NODE)
        if maximum_rpm is None:
            numbers = [round(COMMAND_MAX * fraction) for fraction in fractions]
            yield from encode_raw_command(numbers, AUTOPILOT_NODE, transfer_id, time_s=time_s)
        else:
            numbers = [round(maximum_rpm * fraction) for fraction in fractions]
            yield from encode_rpm_command(numbers, AUTOPILOT_NODE, transfer_id, time_s=time_s)
        yield from self._alive(AUTOPILOT_NODE, time_s)

    def reports(self, reports: Sequence[ThrusterReport], time_s: float) -> Iterator[CanFrame]:
        """esc.Status of each."""
        for report in reports:
            thruster = self._measured.get(report.thruster)
            if thruster is not None:
                index = thruster.rpm.esc_index or 0
                node = thruster.rpm.node_id or FIRST_ESC_NODE + index
                yield from self._alive(node, time_s)
                status = _esc_status(report, index, thruster.rpm.reverse)
                yield from encode_esc_status(status, node, self._transfer("report", node), time_s=time_s)

    def _alive(self, node: int, time_s: float) -> Iterator[CanFrame]:
        """NodeStatus, where it is time."""
        if time_s - self._alive_s.get(node, -NODE_STATUS_PERIOD_S) >= NODE_STATUS_PERIOD_S:
            self._alive_s[node] = time_s
            uptime_s = int(time_s - self._started_s.setdefault(node, time_s))
            yield from encode_node_status(NodeStatus(uptime_s), node, self._transfer("status", node), time_s=time_s)

    def _transfer(self, kind: str, node: int) -> int:
        self._transfers[kind, node] += 1
        return self._transfers[kind, node] % 32


def _esc_status(report: ThrusterReport, index: int, reverse: bool) -> EscStatus:
    rpm = report.speed_rpm or 0.0
    return EscStatus(
        error_count=report.error_count or 0,
        voltage_v=nan if report.voltage_v is None else report.voltage_v,
        current_a=nan if report.current_a is None else report.current_a,
        temperature_k=nan if report.temperature_k is None else report.temperature_k,
        speed_rpm=round(-rpm if reverse else rpm),
        power_percent=0,
        esc_index=index,
    )
