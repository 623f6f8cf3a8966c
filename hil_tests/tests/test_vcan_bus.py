"""Nodes that share no code with the gateway, heard by the gateway's CAN link on a real kernel's bus.

The link itself, its stamps, losses and reconnecting, is tested beside it, in drivers/can/tests/test_vcan.py.
"""

from __future__ import annotations

import can
import pytest

from drivers.can.bus import CanLink
from drivers.can.dronecan import DroneCanDecoder, DroneCanThruster
from drivers.can.frame import CanFilter, CanFrame
from drivers.can.tests.link_listener import running, until
from drivers.clock import Clock
from drivers.readings import ThrusterCommand, ThrusterReport
from hil_tests.rig.esc import CommandNode, EscBank
from hil_tests.rig.vehicle import THRUSTERS, Vehicle
from hil_tests.vcan.interface import INTERFACE

pytestmark = pytest.mark.vcan

WAIT_S = 30.0  # the machine may be an emulated one


@pytest.fixture
def nodes():
    """Two nodes of python-can; each hears the other."""
    with can.Bus(INTERFACE, "socketcan") as first, can.Bus(INTERFACE, "socketcan") as second:
        yield first, second


async def test_frames_of_two_nodes_arrive_in_the_order_of_the_bus(nodes):
    async with running(CanLink("can", "socketcan", INTERFACE, [], Clock())) as heard:
        await until(lambda: heard.states, WAIT_S)
        for number in range(40):
            nodes[number % 2].send(can.Message(arbitration_id=0x100 + number, is_extended_id=False, data=[number]))
        await until(lambda: len(heard.frames) >= 40, WAIT_S)
    wanted = [(0x100 + number, bytes([number]), False) for number in range(40)]
    assert [(frame.identifier, frame.data, frame.extended) for frame in heard.frames] == wanted
    assert [nodes[1].recv(1.0).arbitration_id for _ in range(20)] == list(range(0x100, 0x128, 2))


async def test_the_kernel_tells_standard_from_extended_and_one_data_type_from_another(nodes):
    wanted = [CanFilter(0x0406_00, 0xFFFF_00, extended=True), CanFilter(0x123, 0x7FF, extended=False)]
    offered = [
        (0x1404_060B, True),
        (0x1404_0A0B, True),
        (0x123, False),
        (0x123, True),
        (0x124, False),
        (0x406_7F, True),
    ]
    link = CanLink("can", "socketcan", INTERFACE, wanted, Clock())
    async with running(link) as heard:
        await until(lambda: heard.states, WAIT_S)
        for identifier, extended in offered:
            nodes[0].send(can.Message(arbitration_id=identifier, is_extended_id=extended))
        await until(lambda: heard.frames and heard.frames[-1].identifier == 0x406_7F, WAIT_S)
    passed = [(0x1404_060B, True), (0x123, False), (0x406_7F, True)]
    assert [(frame.identifier, frame.extended) for frame in heard.frames] == passed
    assert link.counters["frames"] == 3


def thrusters_told(decoder: DroneCanDecoder, frames: list[CanFrame]) -> list[int]:
    """Thrusters of the commands and reports; the nodes tell of themselves as well."""
    readings = [reading for frame in frames for reading in decoder.decode(frame)]
    return [reading.thruster for reading in readings if isinstance(reading, ThrusterCommand | ThrusterReport)]


async def test_simulated_escs_and_their_autopilot_are_understood(nodes):
    def decoder() -> DroneCanDecoder:
        return DroneCanDecoder([DroneCanThruster(number, number - 1) for number in range(1, THRUSTERS + 1)])

    autopilot, escs = CommandNode(nodes[0]), EscBank(nodes[1], Vehicle(0.01, seed=1))
    async with running(CanLink("can", "socketcan", INTERFACE, decoder().filters(), Clock())) as heard:
        await until(lambda: heard.states, WAIT_S)
        autopilot.publish(0.0, [0.5] * THRUSTERS)
        await until(lambda: len(thrusters_told(decoder(), heard.frames)) >= THRUSTERS, WAIT_S)
        commands = escs.commands(0.0)
        escs.report(0.02, 0.02)
        await until(lambda: len(thrusters_told(decoder(), heard.frames)) >= 2 * THRUSTERS, WAIT_S)
    whole = decoder()
    assert commands == pytest.approx([0.5] * THRUSTERS, abs=1e-4)
    assert thrusters_told(whole, heard.frames) == [*range(1, THRUSTERS + 1)] * 2
    assert not whole.drops
