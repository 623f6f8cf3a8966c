"""Who is armed, from the bytes of a link: before a play, and while it goes on."""

from __future__ import annotations

import asyncio
import contextlib
import socket

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from drivers.clock import Clock
from hil_tests.bridge.armed_watch import ArmedWatch, listen
from hil_tests.bridge.permission import Granted, HeardAutopilot
from hil_tests.loopback import free_port

ARMED_FLAG = 0x80
ARDUPILOT, PX4, NO_AUTOPILOT = 3, 12, 8
SUBMARINE, GROUND_STATION = 12, 6


def heartbeat(armed, system=1, component=1, autopilot=ARDUPILOT, kind=SUBMARINE):
    message = mavlink.MAVLink_heartbeat_message(kind, autopilot, ARMED_FLAG if armed else 0, 19, 4, 3)
    return message.pack(mavlink.MAVLink(None, srcSystem=system, srcComponent=component))


def watching(*data, time_s=0.0):
    watch = ArmedWatch(0.0)
    for one in data:
        watch.feed(one, time_s)
    return watch


def test_an_autopilot_is_known_by_its_newest_heartbeat():
    watch = watching(heartbeat(True), heartbeat(False))
    assert watch.heard() == (HeardAutopilot("ArduSub (system 1)", False),)


def test_ground_stations_and_cameras_are_no_autopilots():
    ground_station = heartbeat(True, 255, 190, NO_AUTOPILOT, GROUND_STATION)
    assert watching(ground_station, heartbeat(True, 1, 100, NO_AUTOPILOT)).heard() == ()


def test_any_autopilot_counts_whatever_its_component():
    watch = watching(heartbeat(False), heartbeat(True, 2, 7, PX4))
    assert watch.heard() == (
        HeardAutopilot("ArduSub (system 1)", False),
        HeardAutopilot("autopilot (component 7 of 2)", True),
    )


def test_heartbeats_that_are_cut_or_damaged_are_waited_for_or_dropped():
    whole = heartbeat(True)
    damaged = bytearray(heartbeat(False))
    damaged[12] ^= 0x40
    watch = watching(whole[:9], whole[9:], bytes(damaged), b"\xfd\xfe\x00garbage")
    assert watch.heard() == (HeardAutopilot("ArduSub (system 1)", True),)


@pytest.mark.parametrize(
    ("granted", "reason"),
    [
        (Granted(), "ArduSub (system 1) has become armed: stopped, for --while-armed was not said"),
        (Granted(no_autopilot=True), "ArduSub (system 1) has become armed: stopped, for --while-armed was not said"),
        (Granted(while_armed=True), ""),
    ],
)
def test_a_play_stops_when_the_vehicle_becomes_armed(granted, reason):
    watch = watching(heartbeat(False))
    assert watch.stop_reason(1.0, granted) == ""
    watch.feed(heartbeat(True), 1.0)
    assert watch.stop_reason(1.1, granted) == reason


@pytest.mark.parametrize(
    ("heard", "granted", "silent"),
    [
        (True, Granted(), "ArduSub (system 1) has been silent for 5 s"),
        (False, Granted(), "the autopilot has been silent for 5 s"),
        (True, Granted(while_armed=True), None),
        (False, Granted(no_autopilot=True), None),
    ],
)
def test_a_play_stops_when_it_is_no_longer_known_whether_it_is_armed(heard, granted, silent):
    watch = watching(*[heartbeat(False)] * heard, time_s=100.0)
    watch = watch if heard else ArmedWatch(100.0)
    assert watch.stop_reason(105.0, granted) == ""
    reason = watch.stop_reason(105.1, granted)
    assert reason.startswith(silent) if silent else reason == ""


def test_a_heartbeat_that_comes_again_lets_it_go_on():
    watch = watching(heartbeat(False))
    watch.feed(heartbeat(False), 9.0)
    assert watch.stop_reason(10.0, Granted()) == ""


async def test_a_link_is_listened_to():
    port = free_port()

    async def beat():
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as speaker:
            while True:
                speaker.sendto(heartbeat(True), ("127.0.0.1", port))
                await asyncio.sleep(0.02)

    beating = asyncio.create_task(beat())
    watch = await listen(f"udpin:127.0.0.1:{port}", Clock(), 0.2)
    beating.cancel()
    with contextlib.suppress(asyncio.CancelledError):
        await beating
    assert watch.heard() == (HeardAutopilot("ArduSub (system 1)", True),)


async def test_silence_is_heard_as_nobody():
    assert (await listen(f"udpin:127.0.0.1:{free_port()}", Clock(), 0.05)).heard() == ()


async def test_a_link_that_does_not_open_is_named():
    with pytest.raises(OSError, match="serial:/dev/nothing:57600 does not open"):
        await listen("serial:/dev/nothing:57600", Clock(), 0.05)


async def test_a_link_that_is_lost_at_once_is_named():
    async def hang_up(_reader, writer):
        writer.close()

    server = await asyncio.start_server(hang_up, "127.0.0.1", 0)
    port = server.sockets[0].getsockname()[1]
    async with server:
        with pytest.raises(OSError, match=f"tcp:127.0.0.1:{port} opens, and is lost at once"):
            await listen(f"tcp:127.0.0.1:{port}", Clock(), 5.0)
