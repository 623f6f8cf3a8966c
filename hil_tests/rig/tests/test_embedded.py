"""The whole simulated vehicle, stepped by hand and in its own thread."""

from __future__ import annotations

import socket
import threading
import time
from math import isnan

import can
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from drivers.can.dronecan import DroneCanDecoder, DroneCanThruster
from drivers.can.frame import CanFrame
from drivers.readings import ThrusterCommand, ThrusterReport
from hil_tests.rig.acoustic import AcousticErrors
from hil_tests.rig.embedded import EmbeddedVehicle, Surroundings
from hil_tests.rig.faults import FaultType, HullFault, InjectedFault
from hil_tests.rig.helm import box
from hil_tests.rig.pilot import SURVEYING
from hil_tests.rig.water import Current

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


def survey(gateway, seconds, **surroundings) -> EmbeddedVehicle:
    vehicle = embedded(gateway, style=SURVEYING, course=box(8.0), surroundings=Surroundings(**surroundings))
    vehicle.advance(1000.0 + seconds)
    vehicle.close()
    return vehicle


def test_it_keeps_the_truth_and_notes_when_the_hull_is_slowed(gateway, listener):
    net = HullFault(drag_factor=3.5, onset_s=8.0, ramp_s=1.0)
    vehicle = survey(gateway, 12.0, water=Current(east_mps=0.4), hull_faults=[net])
    assert 1008.0 < vehicle.slowed_s < 1010.0
    assert [moment.time_s for moment in vehicle.moments[:3]] == pytest.approx([1000.0, 1000.1, 1000.2])
    assert len(vehicle.moments) == 121
    assert vehicle.moments[-1].motion.water_mps == (0.0, 0.4, 0.0)
    assert vehicle.shown_s == {}


def test_a_current_alone_slows_nothing(gateway, listener):
    assert isnan(survey(gateway, 12.0, water=Current(east_mps=0.8)).slowed_s)


def test_acoustic_fixes_come_from_the_vehicle_as_another_component(gateway, listener):
    start_s = 1_700_000_000.0  # weeks of the GPS count from 1980
    surroundings = Surroundings(acoustic=AcousticErrors(interval_s=0.5))
    vehicle = embedded(gateway, now=lambda: start_s, surroundings=surroundings)
    for step in range(21):
        vehicle.advance(start_s + 0.1 * step)
    vehicle.close()
    parser, senders = mavlink.MAVLink(None), set()
    heard = []
    while True:
        try:
            data, sender = gateway.recvfrom(4096)
        except BlockingIOError:
            break
        senders.add(sender)
        heard += parser.parse_buffer(data)
    fixes = [message for message in heard if message.get_type() == "GPS_INPUT"]
    assert 4 <= len(fixes) <= 5
    assert {(fix.get_srcSystem(), fix.get_srcComponent()) for fix in fixes} == {(1, 220)}
    assert len(senders) == 1


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
