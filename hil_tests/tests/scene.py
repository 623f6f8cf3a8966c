"""A vehicle whose trouble a test decides, and the configuration of a gateway that watches it.

Thrusters 1 and 2 drive it ahead, 3 and 4 up and down. Its detectors are stand-ins that know what is right: what is
tested with it is everything behind them.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

from drivers.can.dronecan import EscStatus, encode_esc_status, encode_raw_command
from drivers.can.frame import CanFrame
from drivers.readings import Reading, ThrusterCommand, ThrusterReport
from gateway.config import Config, parse
from gateway.pipeline import Factories
from gateway.tests.conftest import FULL_RPM, GroundSpeedDetector, ThresholdDetector
from hil_tests.rig.commander import Commander
from hil_tests.rig.esc_messages import EscReport
from hil_tests.rig.pilot import Sticks
from hil_tests.rig.telemetry import Telemetry
from hil_tests.rig.vehicle import Motion

THRUSTERS = (1, 2, 3, 4)
VERTICAL = (3, 4)
COMMAND = 0.4
DEEP_M = 8.0
VERTICAL_MPS = 1.0  # with the stick at its end
STAND_INS = Factories(thruster=ThresholdDetector, speed=GroundSpeedDetector)

HEAD = """
[vehicle]
name = "Supervised"

[[can]]
name = "can0"
interface = "virtual"
channel = "{channel}"
protocol = "dronecan"

[mavlink]
endpoint = "udpin:127.0.0.1:{port}"
{mavlink}

[align]
sample_rate_hz = {rate_hz}
"""
THRUSTER = """
[[thruster]]
number = {number}
command = {{ link = "can0", esc_index = {esc} }}
rpm = {{ link = "can0", esc_index = {esc} }}
{direction} = 1.0
"""
SPEED = """
[speed]
position = "local"
minimum_mps = 0.8
maximum_mps = 1.2
"""


def configuration(
    folder: Path,
    failsafe: str = "",
    *,
    mavlink: str = "",
    speed: bool = False,
    port: int = 0,
    channel: str = "supervision",
    rate_hz: float = 10.0,
) -> Config:
    """What a gateway that watches this vehicle runs with.

    Args:
        folder: for what it writes.
        failsafe: lines of `[failsafe]`.
        mavlink: further lines of `[mavlink]`.
        speed: watch the speed, too.
        port: UDP port for MAVLink.
        channel: of the virtual CAN bus.
        rate_hz: of commands and reports.
    """
    text = HEAD.format(channel=channel, port=port, mavlink=mavlink, rate_hz=rate_hz)
    for number in THRUSTERS:
        direction = "down" if number in VERTICAL else "ahead"
        text += THRUSTER.format(number=number, esc=number - 1, direction=direction)
    return parse(text + (SPEED if speed else "") + f"[failsafe]\n{failsafe}\n", folder)


def key_file(folder: Path, key: bytes) -> str:
    """Writes a key for signing; returns the line of the configuration that names it."""
    path = folder / "mavlink.key"
    path.write_bytes(key)
    path.chmod(0o600)
    return f'signing_key = "{path.name}"'


class Scene:
    """What is true of the vehicle.

    Args:
        depth_m: to begin with.

    Attributes:
        share: of its speed that each thruster still reaches, by number.
        speed_mps: over ground, to the north.
        motion: where it is.
    """

    def __init__(self, depth_m: float = DEEP_M) -> None:
        self.share = dict.fromkeys(THRUSTERS, 1.0)
        self.speed_mps = 1.0
        self.motion = Motion(down_m=depth_m, forward_mps=1.0)

    def entangle(self, *thrusters: int) -> None:
        """These have caught something."""
        self.share.update(dict.fromkeys(thrusters, 0.6))

    def free(self) -> None:
        """All is well again."""
        self.share = dict.fromkeys(THRUSTERS, 1.0)
        self.speed_mps = 1.0

    def step(self, period_s: float, commander: Commander) -> None:
        """Move on; it rises and sinks as its autopilot has it."""
        down_mps = VERTICAL_MPS * commander.demand(Sticks(), self.motion).down
        self.motion = replace(
            self.motion,
            north_m=self.motion.north_m + self.speed_mps * period_s,
            down_m=max(self.motion.down_m + down_mps * period_s, 0.0),
            forward_mps=self.speed_mps,
        )

    def telemetry(self, boot_s: float) -> Telemetry:
        """What its autopilot knows of it."""
        escs = [EscReport(self._speed_rpm(number), 16.0, 3.0) for number in THRUSTERS]
        return Telemetry(boot_s, self.motion, [COMMAND] * len(THRUSTERS), escs=escs)

    def readings(self, time_s: float) -> Iterator[Reading]:
        """What a gateway hears on the bus."""
        for number in THRUSTERS:
            yield ThrusterCommand(time_s, number, COMMAND)
            yield ThrusterReport(time_s, number, self._speed_rpm(number), 16.0, 3.0)

    def frames(self, n: int) -> Iterator[CanFrame]:
        """The n-th command and reports, as they are on the bus."""
        yield from encode_raw_command([round(8191 * COMMAND)] * len(THRUSTERS), 10, n % 32)
        for number in THRUSTERS:
            status = EscStatus(0, 16.0, 3.0, 300.0, round(self._speed_rpm(number)), 50, number - 1)
            yield from encode_esc_status(status, 20 + number, n % 32)

    def _speed_rpm(self, number: int) -> float:
        return self.share[number] * FULL_RPM * COMMAND
