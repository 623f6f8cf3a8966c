"""A PX4 without any CAN bus of ours: its outputs and its ESCs over MAVLink are all that there is, and enough."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from drivers.readings import Reading
from gateway.config import Config, parse
from gateway.pipeline import Factories
from hil_tests.rig.commander import Commander
from hil_tests.rig.esc_messages import ESC_STATUS_ID, EscReport
from hil_tests.rig.faults import FaultType, InjectedFault
from hil_tests.rig.pilot import Pilot, Sticks
from hil_tests.rig.px4 import MainMode, Px4
from hil_tests.rig.telemetry import Telemetry
from hil_tests.rig.vehicle import HALF_SQRT2, MIXER, THRUSTERS, Vehicle, mix
from hil_tests.tests.scene import Scene
from hil_tests.tests.virtual_rig import PERIOD_S, VirtualRig

STEPS = 10  # of the vehicle, in one of the rig's
STEP_S = PERIOD_S / STEPS
ONSET_S = 55.0
WEEDS = InjectedFault(type=FaultType.ENTANGLED, onset_s=ONSET_S, ramp_s=0.5, severity=0.3)

HEAD = """
[vehicle]
name = "PX4 without a bus"

[mavlink]
endpoint = "udpin:127.0.0.1:0"

[align]
sample_rate_hz = 10

[detector.thruster]
delay_max = 4
lag_max = 4.0
order_max = 3

[failsafe]
thruster_fault = ["hold"]
delay_s = 2
"""
THRUSTER = """
[[thruster]]
number = {number}
command = {{ link = "mavlink", servo_channel = {number} }}
rpm = {{ link = "mavlink", esc_index = {esc}, signed = true }}
ahead = {ahead:.3f}
right = {right:.3f}
down = {down}
"""


class DrivenScene(Scene):
    """A vehicle that a pilot drives, as the rig simulates it; nothing of it is on a CAN bus."""

    def __init__(self) -> None:
        super().__init__()
        self._vehicle = Vehicle(STEP_S, seed=5, faults={2: [WEEDS]})
        self._pilot = Pilot(seed=5)
        self._since_s = 0.0
        self._commands = mix(Sticks())

    def step(self, period_s: float, commander: Commander) -> None:
        for _ in range(STEPS):
            self._since_s += STEP_S
            sticks = self._pilot.sticks(self._since_s)
            self._commands = mix(commander.demand(sticks, self._vehicle.hull.motion))
            self._vehicle.step(self._since_s, self._commands)

    def telemetry(self, boot_s: float) -> Telemetry:
        escs = []
        for thruster in self._vehicle.thrusters:
            measured = thruster.measure(PERIOD_S)
            escs.append(EscReport(measured.speed_rpm, self._vehicle.battery.voltage_v, measured.supply_a))
        return Telemetry(boot_s, self._vehicle.hull.motion, self._commands, escs=escs)

    def readings(self, time_s: float) -> Iterator[Reading]:
        return iter(())


def thruster(esc: int) -> str:
    """The table of one thruster."""
    ahead, right, down, _ = MIXER[esc]
    return THRUSTER.format(
        number=esc + 1, esc=esc, ahead=HALF_SQRT2 * ahead, right=HALF_SQRT2 * right, down=round(down)
    )


@pytest.fixture
def config(tmp_path: Path) -> Config:
    return parse(HEAD + "".join(map(thruster, range(THRUSTERS))), tmp_path)


def test_an_entangled_thruster_is_found_named_and_held(config):
    rig = VirtualRig(config, Px4(), scene=DrivenScene(), factories=Factories())
    rig.run(ONSET_S)
    assert rig.autopilot.interval_s(ESC_STATUS_ID) <= 0.1
    assert [text.text for text in rig.texts if text.severity <= 4] == []
    assert rig.run(20.0, lambda: rig.said("Hold done for T2"))
    assert rig.said("T2 entangled")
    assert rig.commander.mode is MainMode.ALTCTL
    assert {text.text.split()[0] for text in rig.texts if text.severity == 2} <= {"T2", "Hold"}
