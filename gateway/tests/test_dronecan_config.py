"""Thrusters behind DroneCAN ESCs, from the configuration to readings: which message commands them."""

from __future__ import annotations

import pytest

from drivers.can.dronecan import encode_raw_command, encode_rpm_command
from drivers.readings import ThrusterCommand
from gateway.config import parse
from gateway.tests.test_config import ESC, ONE_CAN, problems, thruster
from gateway.wiring import can_decoder


def test_a_thruster_that_is_commanded_in_rpm(tmp_path):
    text = ONE_CAN + thruster(1, ESC(0) + ", maximum_rpm = 3000", ESC(0)) + thruster(2, ESC(1), ESC(1))
    config = parse(text, tmp_path)
    decoder = can_decoder(config.can[0], config.thruster)
    frames = [
        *encode_rpm_command([-1500, 0], 10, 0, time_s=1.0),
        *encode_raw_command([0, 8191], 10, 0, time_s=2.0),
    ]
    readings = [reading for frame in frames for reading in decoder.decode(frame)]
    assert readings == [ThrusterCommand(1.0, 1, -0.5), ThrusterCommand(2.0, 2, 1.0)]


@pytest.mark.parametrize(
    ("keys", "key", "wanted"),
    [
        ("maximum_rpm = 0", "maximum_rpm", "greater than 0"),
        ("maximum_rpm = 140_000", "maximum_rpm", "less than or equal to 131071"),
        ("maximum_rpm = 3000, bidirectional = false", "bidirectional", "means nothing with maximum_rpm"),
        ("maximum = 8191", "maximum", "means nothing on a dronecan link"),
    ],
)
def test_what_no_rpm_command_can_be(keys, key, wanted):
    found = problems(ONE_CAN + thruster(1, f"{ESC(0)}, {keys}", ESC(0)))
    assert wanted in found[f"thruster[number=1].command.{key}"]


def test_maximum_rpm_means_nothing_elsewhere():
    text = '[mavlink]\nendpoint = "udpin:127.0.0.1:1"\n' + thruster(
        1, 'link = "mavlink", servo_channel = 1, maximum_rpm = 3000', ESC(0)
    )
    assert "means nothing on a mavlink link" in problems(ONE_CAN + text)["thruster[number=1].command.maximum_rpm"]
