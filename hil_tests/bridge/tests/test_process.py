"""The bridge in a process of its own, over UDP sockets in place of CAN."""

from __future__ import annotations

import socket
import time
from contextlib import ExitStack
from functools import partial

import pytest

from drivers.can.port import CanPortError
from drivers.clock import Clock
from hil_tests.bridge.bus_end import BusEnd
from hil_tests.bridge.can_bridge import CanBridge
from hil_tests.bridge.process import BridgeProcess
from hil_tests.bridge.raw_port import RawPort
from hil_tests.bridge.tests.ends import FragileWire, HoldingWire
from hil_tests.bridge.tests.test_bus_frame import MESSAGES, kernel_packet
from hil_tests.loopback import free_port

PACKET, EMPTY = kernel_packet(MESSAGES["extended"]), kernel_packet(MESSAGES["empty"])


def over_udp(buses, make_wire, on_state):
    """A bridge, for the process to make."""
    clock = Clock()
    ends = [BusEnd(name, _opener(ports), clock, on_state) for name, ports in buses.items()]
    return CanBridge(*ends, make_wire(), clock)


def _opener(ports):
    return lambda clock, lost: RawPort(udp_pair(*ports), clock, lost)


def udp_pair(own, other):
    """A UDP socket that speaks with one other."""
    opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    opened.bind(("127.0.0.1", own))
    opened.connect(("127.0.0.1", other))
    return opened


@pytest.fixture
def buses():
    return {name: (free_port(), free_port()) for name in ("can0", "can1")}


def test_frames_pass_and_the_figures_come_back_until_the_wire_fails(buses):
    with ExitStack() as stack:
        near, far = (stack.enter_context(udp_pair(*ports[::-1])) for ports in buses.values())
        far.settimeout(5.0)
        bridge = stack.enter_context(BridgeProcess("can0:can1", partial(over_udp, buses, FragileWire)))
        for _ in range(3):
            near.send(PACKET)
            assert far.recv(100) == PACKET
        report = bridge.report()
        assert [(state.link, state.up) for state in report.states] == [("can0", True), ("can1", True)]
        assert bridge.report().states == () and report.failure == ""

        near.send(EMPTY)
        end_s = time.monotonic() + 10.0
        while not (failure := bridge.report().failure):
            assert time.monotonic() < end_s
            time.sleep(0.01)
        assert failure == bridge.report().failure == "RuntimeError: the wire broke"
    bridge.stop()
    last = bridge.report().figures.ways["can0 to can1"]
    assert (last.received, last.sent, last.dropped) == (4, 3, {})


def test_an_interface_that_is_not_there_is_named_by_the_process():
    bridge = BridgeProcess.between("nocan0", "nocan1", HoldingWire)
    with pytest.raises(CanPortError, match="nocan0 does not open"):
        bridge.start()
    with pytest.raises(CanPortError, match="never ran"):
        bridge.report()
