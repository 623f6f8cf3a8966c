"""The gateway's configuration for the demonstration: a file like any other, so that it can be looked at and tried."""

from __future__ import annotations

from pathlib import Path

from gateway import config
from hil_tests.rig.dvl import DvlErrors
from hil_tests.rig.geodesy import ORIGIN_LATITUDE_DEG, ORIGIN_LONGITUDE_DEG
from hil_tests.rig.vehicle import HALF_SQRT2, MIXER, THRUSTERS

CONFIG_FILE = "demo.toml"
FINDINGS_FILE = "findings.jsonl"
STATE_FILE = "vehicle.state"
RECORDINGS = "recordings"

HEAD = """\
# What `gateway demo` ran with: a simulated BlueROV2 Heavy with DroneCAN ESCs.
[vehicle]
name = "BlueROV2 Heavy (simulated)"

[[can]]
name = "can0"
interface = "virtual"
channel = "{channel}"
protocol = "dronecan"

[mavlink]
endpoint = "udpin:127.0.0.1:{port}"

[failsafe]
thruster_fault = "hold"

# Speed of the healthy vehicle over the command, as a trial in calm water gave it. To learn it takes more minutes than
# a demonstration lasts. Of the flow nothing is known beforehand.
[speed]
curve = [[0.25, 0.75], [0.45, 1.36], [0.65, 1.81]]

# A light ROV is at speed half a second after its thrusters.
[detector.speed]
surge_time_s = 0.5

# Where it is, roughly; all else about the sensors is found out.
[navigation]
latitude_deg = {latitude_deg}
longitude_deg = {longitude_deg}
dvl_lever_arm_m = [{lever_arm_m}]

[files]
findings = "{findings}"
state = "{state}"

# Everything that came in and went out; demonstrations before this one are deleted beyond the budget.
[recording]
folder = "{recordings}"
budget_mb = 200
"""

THRUSTER = """
[[thruster]]
number = {number}
command = {{ link = "can0", esc_index = {esc_index} }}
rpm = {{ link = "can0", esc_index = {esc_index} }}
"""
DIRECTIONS = ("ahead", "right", "down")


def write_config(folder: Path, channel: str, port: int) -> config.Config:
    """Write the configuration into a folder and load it as the gateway would; what an earlier run learnt is removed.

    Args:
        folder: exists and can be written to.
        channel: of python-can's virtual bus.
        port: UDP port on which the gateway is to listen.
    """
    for name in (FINDINGS_FILE, STATE_FILE):
        (folder / name).unlink(missing_ok=True)
    head = HEAD.format(
        channel=channel,
        port=port,
        latitude_deg=ORIGIN_LATITUDE_DEG,
        longitude_deg=ORIGIN_LONGITUDE_DEG,
        lever_arm_m=", ".join(map(str, DvlErrors().lever_arm_m)),
        findings=FINDINGS_FILE,
        state=STATE_FILE,
        recordings=RECORDINGS,
    )
    (folder / CONFIG_FILE).write_text(head + "".join(map(_thruster, range(THRUSTERS))), encoding="utf-8")
    return config.load(folder / CONFIG_FILE)


def _thruster(index: int) -> str:
    ahead, right, down, _yaw = MIXER[index]
    shares = zip(DIRECTIONS, (ahead * HALF_SQRT2, right * HALF_SQRT2, down), strict=True)
    direction = "".join(f"{name} = {share:.3f}\n" for name, share in shares if share)
    return THRUSTER.format(number=index + 1, esc_index=index) + direction
