"""Which end of a bus a frame of a log came from."""

from __future__ import annotations

from pathlib import Path

import pytest

from drivers.can.dronecan import NodeStatus, encode_node_status
from drivers.can.frame import CanFrame
from gateway.config import parse
from gateway.tests.recorded_dives import BUSES, settings
from hil_tests.dive_logs.senders import side_of
from hil_tests.wires.way import Towards


@pytest.mark.parametrize(("protocol", "frames_of_commands"), [("dronecan", 1), ("vesc", 2), ("dbc", 2)])
def test_commands_are_the_autopilots_and_reports_the_devices(protocol, frames_of_commands):
    config = parse(settings(protocol), Path())
    side = side_of(config.can[0], config)
    frames = list(BUSES[protocol][0](0.02))
    ways = [side(frame) for frame in frames]
    assert ways[:frames_of_commands] == [Towards.DEVICES] * frames_of_commands
    assert set(ways[frames_of_commands:]) == {Towards.AUTOPILOT}
    assert len(ways) > frames_of_commands


def test_all_that_a_commanding_node_sends_is_the_autopilots():
    config = parse(settings("dronecan"), Path())
    side = side_of(config.can[0], config)
    (own,) = encode_node_status(NodeStatus(1), 10, 0)
    (other,) = encode_node_status(NodeStatus(1), 21, 0)
    assert side(own) is Towards.AUTOPILOT  # it has not commanded yet
    for frame in BUSES["dronecan"][0](0.02):
        side(frame)
    assert (side(own), side(other)) == (Towards.DEVICES, Towards.AUTOPILOT)


@pytest.mark.parametrize("protocol", sorted(BUSES))
def test_error_frames_go_to_who_listens(protocol):
    config = parse(settings(protocol), Path())
    assert side_of(config.can[0], config)(CanFrame(0.0, 0x40, bytes(8), error=True)) is Towards.AUTOPILOT
