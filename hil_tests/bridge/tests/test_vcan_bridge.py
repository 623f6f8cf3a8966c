"""The bridge between two buses of a real kernel. Emulated machines are slow: nothing here is a measurement."""

from __future__ import annotations

import json
import socket
import subprocess
import time
from contextlib import ExitStack

import pytest

from drivers.can.frame import CanFrame
from drivers.can.port import CanPortError
from drivers.can.socketcan import RECEIVE_BUFFER_BYTES, SO_RCVBUFFORCE, open_socket
from drivers.can.tests.conftest import ip_link, own_vcan, vcan0  # noqa: F401  fixtures
from drivers.clock import Clock
from hil_tests.bridge.bus_frame import packed
from hil_tests.bridge.can_bridge import bridged
from hil_tests.bridge.tests.ends import HoldingWire
from hil_tests.bridge.tests.test_bus_frame import MESSAGES, kernel_packet

pytestmark = [pytest.mark.vcan, pytest.mark.timeout(120)]

OTHER = "vcangw1"
WAIT_S = 20.0
FULL_LOAD = 1000  # frames each way, as fast as they can be sent: 700 a second each way on an emulated machine
ANY = list(map(kernel_packet, MESSAGES.values()))


@pytest.fixture
def buses(own_vcan):  # noqa: F811
    """Names of two virtual buses, both up."""
    ip_link("add", "dev", OTHER, "mtu", "72", "type", "vcan")
    ip_link("set", OTHER, "up")
    yield own_vcan, OTHER
    subprocess.run(["ip", "link", "del", OTHER], check=False, capture_output=True)


def node(channel, stack):
    """Somebody on a bus."""
    opened = stack.enter_context(open_socket(channel, []))
    opened.settimeout(WAIT_S)
    opened.setsockopt(socket.SOL_SOCKET, SO_RCVBUFFORCE, RECEIVE_BUFFER_BYTES)
    return opened


def heard(opened, count):
    return [opened.recv(72) for _ in range(count)]


def silent(opened):
    opened.settimeout(0.3)
    with pytest.raises(TimeoutError):
        opened.recv(72)
    return True


def carried(channel):
    """Frames that all on this machine have put on a bus."""
    words = ["ip", "-statistics", "-json", "link", "show", "dev", channel]
    answer = subprocess.run(words, check=True, capture_output=True)
    return json.loads(answer.stdout)[0]["stats64"]["tx"]["packets"]


def numbered(first, count):
    return [packed(CanFrame(0.0, 0x1404_0A00 + first, number.to_bytes(8))) for number in range(count)]


def test_all_frames_pass_both_ways_in_their_order_as_fast_as_they_come(buses):
    near, far = buses
    ours, theirs = numbered(1, FULL_LOAD), numbered(2, FULL_LOAD)
    ahead, back = [*ANY, *ours], [*ANY[::-1], *theirs]
    with ExitStack() as stack:
        autopilot, esc, local_gateway = node(near, stack), node(far, stack), node(near, stack)
        bridge = stack.enter_context(bridged(near, far, HoldingWire(), Clock()))
        for one, other in zip(ahead, back, strict=True):
            autopilot.send(one)
            esc.send(other)
        assert heard(esc, len(ahead)) == ahead
        assert heard(autopilot, len(back)) == back
        # who listens on this machine hears both, and nothing comes back to where it was sent
        on_the_bus = heard(local_gateway, len(ahead) + len(back))
        assert sorted(on_the_bus) == sorted(ahead + back)
        for way in (ours, theirs):
            assert [one for one in on_the_bus if one in set(way)] == way
        assert silent(autopilot) and silent(esc)
        assert [carried(name) for name in buses] == [len(ahead) + len(back)] * 2
        assert all(not way.dropped for way in bridge.figures().ways.values())


def test_a_bus_that_goes_down_or_is_unplugged_is_bridged_again(buses):
    near, far = buses
    states = []

    def until(up, name):
        end_s = time.monotonic() + WAIT_S
        while not states or (states[-1].up, states[-1].link) != (up, name):
            assert time.monotonic() < end_s, states
            time.sleep(0.05)

    with ExitStack() as stack:
        autopilot = node(near, stack)
        bridge = stack.enter_context(bridged(near, far, HoldingWire(), Clock(), states.append))

        ip_link("set", far, "down")
        until(False, far)
        autopilot.send(ANY[0])
        ip_link("set", far, "up")
        until(True, far)
        esc = node(far, stack)
        autopilot.send(ANY[1])
        assert heard(esc, 1) == [ANY[1]]

        ip_link("del", far)
        until(False, far)
        ip_link("add", "dev", far, "mtu", "72", "type", "vcan")
        ip_link("set", far, "up")
        until(True, far)
        esc = node(far, stack)
        autopilot.send(ANY[2])
        assert heard(esc, 1) == [ANY[2]]
        figures = bridge.figures()
        assert figures.away == {near: 0, far: 2}
        assert figures.ways[f"{near} to {far}"].dropped == {f"{far} is away": 1}


def test_a_frame_of_can_fd_does_not_pass_onto_a_bus_without_and_harms_nothing(buses):
    near, far = buses
    ip_link("set", far, "down")
    ip_link("set", far, "mtu", "16")
    ip_link("set", far, "up")
    fast = kernel_packet(MESSAGES["CAN FD, fast"])
    with ExitStack() as stack:
        autopilot, esc = node(near, stack), node(far, stack)
        bridge = stack.enter_context(bridged(near, far, HoldingWire(), Clock()))
        for packet in (fast, ANY[0]):
            autopilot.send(packet)
        assert heard(esc, 1) == [ANY[0]]
        assert bridge.figures().ways[f"{near} to {far}"].dropped == {"refused by the interface": 1}


def test_two_bridges_between_the_same_buses_are_one_too_many(buses):
    with (
        bridged(*buses, HoldingWire(), Clock()),
        pytest.raises(CanPortError, match="is an end of another bridge of this machine"),
        bridged(*buses[::-1], HoldingWire(), Clock()),
    ):
        pass
