"""The gateway's configuration for the demonstration: a file like any other, so that it can be looked at and tried."""

from __future__ import annotations

from pathlib import Path

from gateway import config
from hil_tests.rig.vehicle import THRUSTERS

CONFIG_FILE = "demo.toml"
FINDINGS_FILE = "findings.jsonl"
STATE_FILE = "thrusters.state"

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

[files]
findings = "{findings}"
state = "{state}"
"""

THRUSTER = """
[[thruster]]
number = {number}
command = {{ link = "can0", esc_index = {esc_index} }}
rpm = {{ link = "can0", esc_index = {esc_index} }}
"""


def write_config(folder: Path, channel: str, port: int) -> config.Config:
    """Write the configuration into a folder and load it as the gateway would; what an earlier run learnt is removed.

    Args:
        folder: exists and can be written to.
        channel: of python-can's virtual bus.
        port: UDP port on which the gateway is to listen.
    """
    for name in (FINDINGS_FILE, STATE_FILE):
        (folder / name).unlink(missing_ok=True)
    head = HEAD.format(channel=channel, port=port, findings=FINDINGS_FILE, state=STATE_FILE)
    thrusters = (THRUSTER.format(number=index + 1, esc_index=index) for index in range(THRUSTERS))
    (folder / CONFIG_FILE).write_text(head + "".join(thrusters), encoding="utf-8")
    return config.load(folder / CONFIG_FILE)
