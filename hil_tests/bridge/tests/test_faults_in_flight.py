"""Scripted faults on frames that pass a bridge: what they name is changed, all else passes as it is."""

from __future__ import annotations

import pickle
import time

from drivers.can.dronecan import DroneCanDecoder, DroneCanThruster, EscStatus, encode_esc_status
from drivers.clock import Clock
from drivers.readings import ThrusterReport
from hil_tests.bridge.bus_frame import packed, unpacked
from hil_tests.bridge.tests.ends import bridged_sockets
from hil_tests.bridge.tests.test_bus_frame import MESSAGES, kernel_packet
from hil_tests.scenario.fault import Fault, subject_named
from hil_tests.wires.can_signals import CanSignals
from hil_tests.wires.can_wire import CanWire

ANY = list(map(kernel_packet, MESSAGES.values()))
THRUSTERS = (DroneCanThruster(1, 0), DroneCanThruster(2, 1))
SIGNALS = CanSignals("dronecan", THRUSTERS, speeds=frozenset({1, 2}), commands=frozenset({1, 2}))


def wire(subject, failure, **values):
    fault = Fault(subject=subject_named(subject), failure=failure, at_s=0.0, values=values)
    return CanWire("can0", SIGNALS, [fault], Clock().now() - 1.0)


def status(index, number):
    return [
        packed(frame)
        for frame in encode_esc_status(EscStatus(0, 16.0, 1.0, 300.0, 1000, 50, index), 20 + index, number)
    ]


def test_one_thrusters_speed_is_changed_and_every_other_frame_passes_byte_by_byte():
    sent, other = [], []
    for number in range(8):
        theirs = [*status(1, number), ANY[number]]
        other += theirs
        sent += [*status(0, number), *theirs]
    with bridged_sockets(wire("thruster 1 rpm", "scale", factor=0.5)) as (bridge, can0, can1):
        out = []
        for packet in sent:
            can1.send(packet)
        out = [can0.recv(72) for _ in sent]
        for packet in ANY:
            can0.send(packet)
        assert [can1.recv(72) for _ in ANY] == ANY
        assert bridge.figures().changed
    assert [packet for packet in out if packet in other] == other
    decoder = DroneCanDecoder(THRUSTERS)
    readings = [one for packet in out if packet not in ANY for one in decoder.decode(unpacked(packet, 0.0))]
    told = {1: set(), 2: set()}
    for one in readings:
        if isinstance(one, ThrusterReport):
            told[one.thruster].add(one.speed_rpm)
    assert told == {1: {500.0}, 2: {1000.0}}
    assert not decoder.drops


def test_frames_that_a_fault_holds_come_as_they_were():
    held = wire("can0", "delay", delay_s=0.02, jitter_s=0.0, node=-1.0)
    with bridged_sockets(held) as (bridge, can0, can1):
        begin_s = time.monotonic()
        for packet in ANY:
            can0.send(packet)
        assert [can1.recv(72) for _ in ANY] == ANY
        assert 0.02 <= time.monotonic() - begin_s < 2.0
    transit = bridge.figures().ways["can0 to can1"].transit
    assert transit.max_ms != transit.max_ms


def test_what_is_known_of_a_bus_can_be_handed_to_another_process():
    assert pickle.loads(pickle.dumps(SIGNALS)) == SIGNALS  # noqa: S301  our own
