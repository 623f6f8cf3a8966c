"""Commands and reports of thrusters in an autopilot's own log, as the messages that would have told them.

All thrusters of an instant are told together, each with what was newest. ESC_TELEMETRY_* has no sign, and says by its
counters which ESC had something new; ESC_STATUS is PX4's.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import groupby
from math import nan

from drivers.mavlink import formats
from drivers.mavlink.thruster_speeds import ESCS_PER_MESSAGE
from drivers.mavlink.thrusters import ACTUATORS, CELSIUS_ZERO_K, CHANNELS_PER_PORT, MavlinkThruster
from drivers.readings import ThrusterCommand, ThrusterReport
from hil_tests.dive_logs.telling import UINT32_MASK, Told

SERVOS_FIRST = 8  # of a port that stand before its number
UINT16_MAX, UINT8_MAX = 0xFFFF, 0xFF


class ThrusterMessages:
    """Commands and reports of an instant in, messages out.

    Args:
        thrusters: where each is found in the messages.
        px4: whose messages those of the ESCs are.
    """

    def __init__(self, thrusters: Sequence[MavlinkThruster], px4: bool) -> None:
        self._thrusters = {one.thruster: one for one in thrusters}
        self._px4 = px4
        self._servos: dict[int, int] = {}  # us, by channel from 1
        self._actuators: dict[int, float] = {}  # in the unit of the output's driver, by output from 1
        self._reports: dict[int, ThrusterReport] = {}  # by ESC index
        self._told: Counter[int] = Counter()  # reports, by ESC index
        self._sensed_rpm = [-1.0, -1.0]  # below 0: no signal

    def commands(self, commands: Sequence[ThrusterCommand], boot_s: float) -> Iterator[Told]:
        """SERVO_OUTPUT_RAW or ACTUATOR_OUTPUT_STATUS; nothing for thrusters that are commanded otherwise."""
        ports, outputs = set[int](), False
        for command in commands:
            wired = self._thrusters.get(command.thruster)
            if wired is None or wired.command_scale is None:
                continue
            value = wired.command_scale.value(command.fraction)
            if wired.servo_channel is not None:
                self._servos[wired.servo_channel] = round(value)
                ports.add((wired.servo_channel - 1) // CHANNELS_PER_PORT)
            elif wired.actuator is not None:
                self._actuators[wired.actuator] = value
                outputs = True
        yield from (self._servo_outputs(port, boot_s) for port in sorted(ports))
        if outputs:
            yield self._actuator_outputs(boot_s)

    def reports(self, reports: Sequence[ThrusterReport], boot_s: float) -> Iterator[Told]:
        """ESC_TELEMETRY_* or ESC_STATUS of the ESCs that said something, RPM of sensors of their own."""
        escs: list[int] = []
        for report in reports:
            wired = self._thrusters.get(report.thruster)
            if wired is not None and wired.esc_index is not None:
                self._reports[wired.esc_index] = report
                escs.append(wired.esc_index)
            elif wired is not None and wired.rpm_sensor is not None and report.speed_rpm is not None:
                self._sensed_rpm[wired.rpm_sensor - 1] = report.speed_rpm
                yield formats.RPM, tuple(self._sensed_rpm)
        self._told.update(escs)
        for group, _ in groupby(sorted(escs), key=lambda esc: esc // ESCS_PER_MESSAGE):
            yield self._esc_status(group, boot_s) if self._px4 else self._esc_telemetry(group)

    def _servo_outputs(self, port: int, boot_s: float) -> Told:
        first = port * CHANNELS_PER_PORT + 1
        pulses_us = [self._servos.get(channel, 0) for channel in range(first, first + CHANNELS_PER_PORT)]
        time_us = round(1e6 * boot_s) & UINT32_MASK
        return formats.SERVO_OUTPUT_RAW, (time_us, *pulses_us[:SERVOS_FIRST], port, *pulses_us[SERVOS_FIRST:])

    def _actuator_outputs(self, boot_s: float) -> Told:
        outputs = [self._actuators.get(output, 0.0) for output in range(1, ACTUATORS + 1)]
        return formats.ACTUATOR_OUTPUT_STATUS, (round(1e6 * boot_s), max(self._actuators), *outputs)

    def _esc_telemetry(self, group: int) -> Told:
        four = self._four(group)
        fields = (
            *(_unsigned(1e2 * (one.voltage_v or 0.0), UINT16_MAX) for one in four),
            *(_unsigned(1e2 * (one.current_a or 0.0), UINT16_MAX) for one in four),
            *(0 for _ in four),  # charge
            *(_unsigned(abs(one.speed_rpm or 0.0), UINT16_MAX) for one in four),
            *(self._told[esc] % (UINT16_MAX + 1) for esc in _indices(group)),
            *(_unsigned((one.temperature_k or CELSIUS_ZERO_K) - CELSIUS_ZERO_K, UINT8_MAX) for one in four),
        )
        return formats.ESC_TELEMETRY[group], fields

    def _esc_status(self, group: int, boot_s: float) -> Told:
        four = self._four(group)
        fields = (
            *(self._signed_rpm(one) for one in four),
            *(nan if one.voltage_v is None else one.voltage_v for one in four),
            *(nan if one.current_a is None else one.current_a for one in four),
        )
        return formats.ESC_STATUS, (round(1e6 * boot_s), *fields, group * ESCS_PER_MESSAGE)

    def _signed_rpm(self, report: ThrusterReport) -> int:
        rpm, wired = round(report.speed_rpm or 0.0), self._thrusters.get(report.thruster)
        return rpm if wired is None else wired.directed(rpm)

    def _four(self, group: int) -> list[ThrusterReport]:
        """What is newest of the ESCs of a group; of one that never reported, nothing."""
        return [self._reports.get(esc, ThrusterReport(0.0, 0)) for esc in _indices(group)]


def _indices(group: int) -> range:
    return range(group * ESCS_PER_MESSAGE, (group + 1) * ESCS_PER_MESSAGE)


def _unsigned(value: float, largest: int) -> int:
    return max(0, min(largest, round(value)))
