"""Servo outputs of a real autopilot in, frames of its commands out, as it would send them to ESCs on a bus."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from drivers.can.frame import CanFrame
from drivers.mavlink import formats
from drivers.mavlink.thrusters import MavlinkThruster
from drivers.readings import ThrusterCommand
from gateway.config import Config
from gateway.wiring import mavlink_thrusters
from hil_tests.dive_logs.esc_frames import PULSES
from hil_tests.rig.bus_clock import BusClock
from hil_tests.rig.nodes import nodes_of
from hil_tests.rig.profile import Profile


class ServoOutputs:
    """See the module's text.

    Args:
        config: of the gateway.
        profile: of the vehicle.

    Attributes:
        messages: ids of those that tell the outputs.
        wired: at which output each thruster is: where the configuration says so there, else in their order.
    """

    def __init__(self, config: Config, profile: Profile) -> None:
        own = {one.thruster: one for one in mavlink_thrusters(config.thruster) if one.command_scale is not None}
        self.wired = [
            _outputs(own.get(number, MavlinkThruster(number, servo_channel=number, command_scale=PULSES)))
            for number in range(1, len(profile.thrusters) + 1)
        ]
        self.messages = [
            message.message_id
            for message, used in (
                (formats.SERVO_OUTPUT_RAW, any(one.servo_channel is not None for one in self.wired)),
                (formats.ACTUATOR_OUTPUT_STATUS, any(one.actuator is not None for one in self.wired)),
            )
            if used
        ]
        self._node, _ = nodes_of(profile)
        self._clock = BusClock(profile.bus.bitrate)
        self._raw = [0.0] * len(self.wired)

    def frames(self, time_s: float, commands: Sequence[ThrusterCommand]) -> list[CanFrame]:
        """What tells these commands, and the newest ones of all other thrusters."""
        for command in commands:
            self._raw[command.thruster - 1] = command.fraction
        return self._clock.send(time_s, self._node.publish(time_s, self._raw))


def _outputs(one: MavlinkThruster) -> MavlinkThruster:
    """The thruster's output as it is on the wire: which way is ahead, ESC and profile know."""
    scale = one.command_scale and replace(one.command_scale, reverse=False)
    return MavlinkThruster(one.thruster, servo_channel=one.servo_channel, actuator=one.actuator, command_scale=scale)
