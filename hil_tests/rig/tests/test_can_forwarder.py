"""The simulated autopilot's forwarding of CAN, and two clients: pydronecan's `mavcan`, and the gateway's own."""

from __future__ import annotations

import contextlib
import os
import queue
import socket
import threading
import time

import pytest
from dronecan.driver import mavcan
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from drivers.can.frame import CanFilter, CanFrame
from drivers.mavlink.can_filter import forwarding_ids
from drivers.mavlink.can_forward import CanForward
from drivers.mavlink.encoder import MavlinkEncoder
from drivers.readings import AutopilotHeartbeat
from hil_tests.rig.ardusub import ArduSub
from hil_tests.rig.autopilot import AutopilotPeer
from hil_tests.rig.can_forwarder import EXPIRES_S, LOOK_FRAMES, CanForwarder
from hil_tests.rig.commands import Result
from hil_tests.rig.telemetry import Telemetry
from hil_tests.rig.vehicle import Motion

STATUS_ID, NODE_STATUS_ID = 1034, 341
STATUS = CanFilter(STATUS_ID << 8, 0x00FF_FF80, extended=True)
US, OTHER = (1, 192), (250, 189)
BUS_1, BUS_2 = (1.0, *[0.0] * 6), (2.0, *[0.0] * 6)
PATIENCE_S = 20.0
NUMBERED = 50


def frame(time_s=0.0, data_type=STATUS_ID, node=11, data=b"\x00\x01\xc0") -> CanFrame:
    return CanFrame(time_s, 20 << 24 | data_type << 8 | node, data)


@pytest.fixture
def sent():
    return []


@pytest.fixture
def forwarder(sent):
    return CanForwarder(sent.append, buses=2)


def modify(forwarder, operation, *ids, bus=1):
    padded = [*ids, *[0] * (16 - len(ids))]
    forwarder.modify_filter(mavlink.MAVLink_can_filter_modify_message(1, 1, bus, operation, len(ids), padded))


def test_one_bus_at_a_time_to_whoever_asked_last(forwarder, sent):
    forwarder.take(0.0, 1, frame())
    assert not sent
    forwarder.request(0.0, BUS_1, US)
    forwarder.take(0.1, 1, frame())
    forwarder.take(0.1, 2, frame())
    forwarder.request(0.2, BUS_2, OTHER)
    forwarder.take(0.3, 1, frame())
    forwarder.take(0.3, 2, frame())
    assert [(one.target_system, one.target_component, one.bus) for one in sent] == [(*US, 0), (*OTHER, 1)]


def test_bus_that_it_has_not_got_is_refused(forwarder):
    assert forwarder.request(0.0, (3.0, *[0.0] * 6), US).result is Result.FAILED
    assert forwarder.client is None


def test_ends_when_asked_to_and_five_seconds_after_the_last_request(forwarder, sent):
    forwarder.request(0.0, BUS_1, US)
    for n in range(3 * LOOK_FRAMES):
        forwarder.take(EXPIRES_S - 0.1, 1, frame(n))
    assert len(sent) == 3 * LOOK_FRAMES
    for n in range(3 * LOOK_FRAMES):
        forwarder.take(EXPIRES_S + 0.1, 1, frame(n))
    assert len(sent) < 4 * LOOK_FRAMES
    forwarder.request(9.0, BUS_1, US)
    forwarder.request(9.1, (0.0,), OTHER)
    sent.clear()
    forwarder.take(9.2, 1, frame())
    assert not sent


def test_filter_is_one_for_all_and_outlives_its_client(forwarder, sent):
    modify(forwarder, mavlink.CAN_FILTER_REPLACE, NODE_STATUS_ID)
    modify(forwarder, mavlink.CAN_FILTER_ADD, 5, bus=2)
    modify(forwarder, mavlink.CAN_FILTER_ADD, 6, bus=0)
    forwarder.request(0.0, BUS_1, US)
    for data_type in (STATUS_ID, NODE_STATUS_ID, 5, 6):
        forwarder.take(0.1, 1, frame(data_type=data_type))
    assert [one.id >> 8 & 0xFFFF for one in sent] == [NODE_STATUS_ID, 5]
    modify(forwarder, mavlink.CAN_FILTER_REMOVE, 5)
    assert forwarder.filter_ids == {NODE_STATUS_ID}
    modify(forwarder, mavlink.CAN_FILTER_REPLACE)
    forwarder.take(0.2, 1, frame(data_type=6))
    assert len(sent) == 3


class Bus:
    """An autopilot with two buses on a socket, on the first of which an ESC and a node speak all the time."""

    def __init__(self, port: int) -> None:
        self.peer = AutopilotPeer(("127.0.0.1", port), ArduSub(), can_buses=2)
        self._start_s, self._n = time.time(), 0

    def step(self) -> None:
        now_s = time.time()
        self._n += 1
        self.peer.on_bus(now_s, 1, frame(now_s, data=bytes([self._n % 256, 0xC0])))
        self.peer.on_bus(now_s, 1, frame(now_s, NODE_STATUS_ID))
        self.peer.exchange(now_s, Telemetry(now_s - self._start_s, Motion(), [0.0] * 4))
        time.sleep(0.005)


@contextlib.contextmanager
def pydronecan(monkeypatch, filter_ids):
    """Its driver's own loop in a thread instead of a process, and the frames that come out of it."""
    monkeypatch.setenv("MAVLINK20", "1")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    orders, frames, end = queue.Queue(), queue.Queue(), queue.Queue()
    orders.put(mavcan.ControlMessage("FilterList", filter_ids))
    arguments = (f"udpin:127.0.0.1:{port}", 0, 1, 0, orders, frames, end, os.getppid())
    driver = threading.Thread(target=mavcan.io_process, args=arguments)
    driver.start()
    try:
        yield port, frames
    finally:
        end.put("QUIT")
        driver.join(PATIENCE_S)


def test_pydronecan_understands_it_and_asks_as_the_gateway_does(monkeypatch):
    heard = []
    with pydronecan(monkeypatch, [STATUS_ID]) as (port, frames):
        bus = Bus(port)
        with contextlib.closing(bus.peer):
            deadline_s = time.monotonic() + PATIENCE_S
            while len(heard) < 2 * NUMBERED:
                assert time.monotonic() < deadline_s, bus.peer.notes
                bus.step()
                while not frames.empty():
                    heard.append(frames.get())
                if not bus.peer.notes.counts["CAN_FILTER_MODIFY"]:
                    heard.clear()
            asked = bus.peer.notes.commands[-1]
            assert bus.peer.forwarder.filter_ids == {STATUS_ID}
    settled = heard[-NUMBERED:]  # the first were under way when the filter came
    assert {(one.id, one.extended, one.canfd, len(one.data)) for one in settled} == {(frame().identifier, 1, 0, 2)}
    numbers = [one.data[0] for one in settled]
    assert numbers == [(numbers[0] + n) % 256 for n in range(len(numbers))]

    forward = CanForward("can0", 1, forwarding_ids([STATUS]))
    beat = AutopilotHeartbeat(0.0, 1, 1, 3, 12, True, 19, 4)
    packets = b"".join(MavlinkEncoder(1).encode(message) for message in forward.update([beat], 0.0))
    ours_filter, ours = mavlink.MAVLink(None).parse_buffer(packets)
    assert (ours.command, ours.param1, ours.param2) == (asked.command, asked.parameters[0], asked.parameters[1])
    assert (ours_filter.bus, ours_filter.operation) == (1, mavlink.CAN_FILTER_REPLACE)
    assert ours_filter.ids[: ours_filter.num_ids] == [STATUS_ID]
