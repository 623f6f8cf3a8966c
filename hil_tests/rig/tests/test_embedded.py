"""The whole simulated vehicle, stepped by hand and in its own thread."""

from __future__ import annotations

import socket
import threading
import time

import can
import pytest

from drivers.can.dronecan import DroneCanDecoder, DroneCanThruster
from drivers.can.frame import CanFrame
from drivers.readings import ThrusterCommand, ThrusterReport
from hil_tests.rig.embedded import EmbeddedVehicle
from hil_tests.rig.faults import FaultType, InjectedFault

CHANNEL = "test_embedded"
WEEDS = InjectedFault(type=FaultType.ENTANGLED, onset_s=1.0, ramp_s=0.5, severity=0.3)


@pytest.fixture
def gateway():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as link:
        link.bind(("127.0.0.1", 0))
        link.setblocking(False)
        yield link


@pytest.fixture
def listener():
    bus = can.Bus(CHANNEL, interface="virtual")
    yield bus
    bus.shutdown()


def embedded(gateway, now=lambda: 1000.0, **settings) -> EmbeddedVehicle:
    return EmbeddedVehicle(interface="virtual", channel=CHANNEL, gateway=gateway.getsockname(), now=now, **settings)


def readings(listener) -> list:
    decoder = DroneCanDecoder([DroneCanThruster(number, number - 1) for number in range(1, 9)])
    heard = []
    while (message := listener.recv(0.0)) is not None:
        heard += decoder.decode(CanFrame(0.0, message.arbitration_id, bytes(message.data)))
    assert not decoder.drops
    return heard


def test_fifty_commands_and_reports_a_second_of_every_thruster(gateway, listener):
    vehicle = embedded(gateway)
    vehicle.advance(1001.995)
    vehicle.close()
    heard = readings(listener)
    for kind in (ThrusterCommand, ThrusterReport):
        numbers = [reading.thruster for reading in heard if isinstance(reading, kind)]
        assert {number: numbers.count(number) for number in range(1, 9)} == dict.fromkeys(range(1, 9), 100)


def test_the_same_seed_makes_the_same_traffic_however_it_is_stepped(gateway, listener):
    def traffic(seed, times):
        vehicle = embedded(gateway, seed=seed)
        for time_s in times:
            vehicle.advance(time_s)
        vehicle.close()
        return readings(listener)

    at_once = traffic(3, [1000.5])
    assert traffic(3, [1000.0 + 0.05 * step for step in range(11)]) == at_once
    assert traffic(4, [1000.5]) != at_once


def test_it_notes_when_a_fault_begins_to_show(gateway, listener):
    vehicle = embedded(gateway, faults={3: [WEEDS]})
    vehicle.advance(1004.0)
    vehicle.close()
    assert set(vehicle.shown_s) == {3}
    assert 1001.0 < vehicle.shown_s[3] < 1004.0


def test_a_healthy_vehicle_shows_nothing(gateway, listener):
    vehicle = embedded(gateway)
    vehicle.advance(1003.0)
    vehicle.close()
    assert vehicle.shown_s == {}


def test_its_thread_keeps_real_time_and_ends(gateway, listener):
    with embedded(gateway, now=time.monotonic):
        assert any(thread.name == "embedded vehicle" for thread in threading.enumerate())
        time.sleep(0.5)
    assert not any(thread.name == "embedded vehicle" for thread in threading.enumerate())
    reports = [reading for reading in readings(listener) if isinstance(reading, ThrusterReport)]
    assert 15 * 8 <= len(reports) <= 35 * 8
    assert gateway.recv(4096)  # it has said HEARTBEAT


def test_an_error_in_its_thread_is_not_lost(gateway, listener):
    clock = iter([1000.0, 1000.1])
    vehicle = embedded(gateway, now=lambda: next(clock))  # a clock that breaks after its second reading
    with pytest.raises(RuntimeError, match="stopped by itself"), vehicle:
        time.sleep(0.1)
