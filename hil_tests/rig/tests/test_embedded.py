"""The whole simulated vehicle, stepped by hand and in its own thread."""

from __future__ import annotations

import socket
import threading
import time
from itertools import pairwise
from math import isnan

import can
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from drivers.can.dronecan import DroneCanDecoder, DroneCanThruster
from drivers.can.frame import CanFrame
from drivers.readings import ThrusterCommand, ThrusterReport
from hil_tests.rig.acoustic import AcousticErrors
from hil_tests.rig.embedded import EmbeddedVehicle, Surroundings
from hil_tests.rig.esc_messages import ESC_INFO_ID, ESC_STATUS_ID
from hil_tests.rig.faults import FaultType, HullFault, InjectedFault
from hil_tests.rig.helm import box
from hil_tests.rig.instruments import Equipment
from hil_tests.rig.pilot import SURVEYING
from hil_tests.rig.px4 import Px4
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


def overheard(gateway) -> tuple[list, set]:
    """Messages that have come, and the ports that they came from."""
    parser, senders, heard = mavlink.MAVLink(None), set(), []
    while True:
        try:
            data, sender = gateway.recvfrom(4096)
        except BlockingIOError:
            return heard, senders
        senders.add(sender)
        heard += parser.parse_buffer(data)


def test_acoustic_fixes_come_from_the_vehicle_as_another_component(gateway, listener):
    start_s = 1_700_000_000.0  # weeks of the GPS count from 1980
    surroundings = Surroundings(acoustic=AcousticErrors(interval_s=0.5))
    vehicle = embedded(gateway, now=lambda: start_s, surroundings=surroundings)
    for step in range(21):
        vehicle.advance(start_s + 0.1 * step)
    vehicle.close()
    heard, senders = overheard(gateway)
    fixes = [message for message in heard if message.get_type() == "GPS_INPUT"]
    assert 4 <= len(fixes) <= 5
    assert {(fix.get_srcSystem(), fix.get_srcComponent()) for fix in fixes} == {(1, 220)}
    assert len(senders) == 1


def test_a_px4_tells_what_its_escs_report(gateway, listener):
    vehicle = embedded(gateway, commander=Px4())
    vehicle.advance(1002.0)
    vehicle.close()
    heard, _ = overheard(gateway)
    kinds = {message.get_type() for message in heard}
    assert {f"UNKNOWN_{message_id}" for message_id in (ESC_INFO_ID, ESC_STATUS_ID)} <= kinds  # pymavlink lacks both
    assert vehicle.mode == "MANUAL"


def ask_for(gateway, vehicle, intervals_us, time_s) -> None:
    """As a gateway does, once it has heard where the autopilot is."""
    vehicle.advance(time_s)
    _, [sender] = overheard(gateway)
    codec = mavlink.MAVLink(None, srcSystem=1, srcComponent=192)
    for message_id, interval_us in intervals_us.items():
        ask = mavlink.MAVLink_command_long_message(1, 1, 511, 0, message_id, interval_us, 0.0, 0.0, 0.0, 0.0, 0.0)
        gateway.sendto(ask.pack(codec), sender)
    vehicle.advance(time_s)


@pytest.mark.parametrize("pause_s", [0.01, 0.07])
def test_its_instruments_speak_at_their_own_pace_however_late_it_is(gateway, listener, pause_s):
    surroundings = Surroundings(equipment=Equipment())
    vehicle = embedded(gateway, surroundings=surroundings)
    ask_for(gateway, vehicle, {27: 20_000.0, 137: 100_000.0}, 1000.0)
    heard = []
    for step in range(1, round(2.1 / pause_s)):
        vehicle.advance(1000.0 + pause_s * step)
        heard += overheard(gateway)[0]
    vehicle.close()
    told = {kind: [one for one in heard if one.get_type() == kind] for kind in KINDS}
    for kind, (stamp, per_s, interval) in KINDS.items():
        stamps = [getattr(one, stamp) for one in told[kind]]
        assert len(stamps) == pytest.approx(2.0 * per_s, rel=0.15)
        assert {after - before for before, after in pairwise(stamps)} == {interval}
    assert {one.get_srcSystem() for one in told["VISION_POSITION_DELTA"]} == {255}


KINDS = {
    "RAW_IMU": ("time_usec", 50.0, 20_000),
    "SCALED_PRESSURE2": ("time_boot_ms", 10.0, 100),
    "VISION_POSITION_DELTA": ("time_usec", 5.0, 200_000),
}


def test_without_instruments_none_speaks(gateway, listener):
    vehicle = embedded(gateway)
    vehicle.advance(1002.0)
    vehicle.close()
    assert not {message.get_type() for message in overheard(gateway)[0]} & set(KINDS)


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
        deadline_s = time.monotonic() + 10.0
        while any(thread.name == "embedded vehicle" for thread in threading.enumerate()):
            assert time.monotonic() < deadline_s
            time.sleep(0.01)
