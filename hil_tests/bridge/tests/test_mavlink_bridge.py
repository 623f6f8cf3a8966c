"""The bridge between two MAVLink endpoints, over the loopback: transparent, unless its wire is not."""

from __future__ import annotations

import socket
import time
from contextlib import ExitStack

import pytest

from drivers.clock import Clock
from hil_tests.bridge.mavlink_bridge import MavlinkBridge
from hil_tests.bridge.tests.ends import BrokenWire, HoldingWire
from hil_tests.loopback import free_port
from hil_tests.scenario.failures import Target
from hil_tests.scenario.fault import Fault, Subject
from hil_tests.wires.mavlink_wire import MavlinkWire

HOST = "127.0.0.1"


def until(condition, seconds=5.0):
    end_s = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end_s
        time.sleep(0.005)


class Ends:
    """An autopilot that comes to a port of the bridge, and a gateway that waits at one of its own."""

    def __init__(self, stack):
        self.autopilot, self.gateway = (stack.enter_context(_udp()) for _ in range(2))
        self.gateway.bind((HOST, 0))
        self._port = free_port()
        self.endpoints = f"udpin:{HOST}:{self._port}", f"udpout:{HOST}:{self.gateway.getsockname()[1]}"

    def from_autopilot(self, *datagrams):
        for one in datagrams:
            self.autopilot.sendto(one, (HOST, self._port))

    def at_gateway(self, count):
        heard = []
        for _ in range(count):
            data, self._back = self.gateway.recvfrom(2048)
            heard.append(data)
        return heard

    def from_gateway(self, *datagrams):
        for one in datagrams:
            self.gateway.sendto(one, self._back)

    def at_autopilot(self, count):
        return [self.autopilot.recv(2048) for _ in range(count)]


def _udp():
    opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    opened.settimeout(5.0)
    return opened


def numbered(count):
    return [number.to_bytes(2) + bytes(number % 250) for number in range(count)]


@pytest.fixture
def ends():
    with ExitStack() as stack:
        yield Ends(stack)


def test_what_comes_passes_both_ways_in_its_order_and_is_heard(ends):
    heard, states = [], []
    with MavlinkBridge(
        *ends.endpoints, HoldingWire(), Clock(), states.append, lambda data, _: heard.append(data)
    ) as bridge:
        for start in range(0, 200, 50):
            some = numbered(200)[start : start + 50]
            ends.from_autopilot(*some)
            assert ends.at_gateway(50) == some
            ends.from_gateway(*some[::-1])
            assert ends.at_autopilot(50) == some[::-1]
    assert heard == numbered(200)
    ways = bridge.figures().ways
    assert list(ways) == [" to ".join(ends.endpoints), " to ".join(ends.endpoints[::-1])]
    for way in ways.values():
        assert (way.received, way.sent, way.dropped) == (200, 200, {})
        assert 0.0 < way.transit.median_ms < 1000.0
    assert {state.link for state in states if state.up} == set(ends.endpoints)


def test_the_mavlink_wire_delays_what_it_is_told_to(ends):
    latency = Fault(
        subject=Subject(Target.LINK, "link"),
        failure="latency",
        at_s=0.0,
        values={"delay_s": 0.1, "jitter_s": 0.0},
    )
    clock = Clock()
    with MavlinkBridge(*ends.endpoints, MavlinkWire([latency], clock.now()), clock) as bridge:
        begin_s = time.monotonic()
        ends.from_autopilot(b"one")
        assert ends.at_gateway(1) == [b"one"]
        assert 0.1 <= time.monotonic() - begin_s < 2.0
        assert bridge.figures().changed == {"packets delayed": 1}


def test_what_finds_nobody_at_the_other_end_is_dropped_and_counted(ends):
    place = f"udpin:{HOST}:{(port := free_port())}"
    with MavlinkBridge(ends.endpoints[0], place, HoldingWire(), Clock()) as bridge:
        ends.from_autopilot(b"one", b"two")
        until(lambda: bridge.figures().ways[f"{ends.endpoints[0]} to {place}"].dropped == {"nobody there yet": 2})
        ends.gateway.sendto(b"here I am", (HOST, port))
        assert ends.at_autopilot(1) == [b"here I am"]
        ends.from_autopilot(b"three")
        assert ends.at_gateway(1) == [b"three"]


def test_a_stream_passes_to_datagrams_and_back(ends):
    with socket.create_server((HOST, 0)) as server, ExitStack() as stack:
        endpoint = f"tcp:{HOST}:{server.getsockname()[1]}"
        bridge = stack.enter_context(MavlinkBridge(endpoint, ends.endpoints[1], HoldingWire(), Clock()))
        autopilot, _ = server.accept()
        stack.enter_context(autopilot)
        autopilot.settimeout(5.0)
        autopilot.sendall(b"from a stream")
        assert ends.at_gateway(1) == [b"from a stream"]
        ends.from_gateway(b"back")
        assert autopilot.recv(100) == b"back"
        autopilot.close()
        until(lambda: bridge.figures().away[endpoint] == 1)
        again, _ = server.accept()  # it comes back by itself
        stack.enter_context(again)
        again.sendall(b"again")
        assert ends.at_gateway(1) == [b"again"]


@pytest.mark.parametrize("hold_s", [0.0, 0.02])
def test_a_wire_that_fails_is_told_to_whoever_stops_the_bridge(ends, hold_s):
    class LateBroken(HoldingWire):
        def due(self, time_s):
            if super().due(time_s):
                raise RuntimeError("the wire broke")
            return []

    bridge = MavlinkBridge(*ends.endpoints, LateBroken(hold_s) if hold_s else BrokenWire(), Clock())
    bridge.start()
    ends.from_autopilot(b"one")
    until(lambda: not bridge.running)
    with pytest.raises(RuntimeError, match="the wire broke"):
        bridge.stop()
    bridge.stop()


def test_an_endpoint_that_does_not_open_ends_the_start(ends):
    with _udp() as holder:
        holder.bind((HOST, 0))
        taken = f"udpin:{HOST}:{holder.getsockname()[1]}"
        bridge = MavlinkBridge(taken, ends.endpoints[1], HoldingWire(), Clock())
        with pytest.raises(OSError, match=f"cannot open {taken}"):
            bridge.start()
    assert not bridge.running


def test_two_endpoints_are_wanted():
    endpoint = f"udpin:{HOST}:14550"
    with pytest.raises(ValueError, match="two endpoints, got udpin"):
        MavlinkBridge(endpoint, endpoint, HoldingWire(), Clock())


def test_a_stop_before_the_start_does_no_harm(ends):
    bridge = MavlinkBridge(*ends.endpoints, HoldingWire(), Clock())
    bridge.stop()
    assert not bridge.running
