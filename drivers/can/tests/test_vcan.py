"""The link on a real kernel's bus. Emulated machines are slow: limits are wide, and nothing here is a measurement."""

import asyncio
import time

import can
import pytest

import drivers.can.socketcan as socketcan_module
from drivers.can.bus import CanLink
from drivers.can.dronecan import DroneCanDecoder, DroneCanThruster, encode_raw_command
from drivers.can.dronecan.esc_status import EscStatus, encode_esc_status
from drivers.can.frame import CanFilter, CanFrame
from drivers.can.tests.conftest import ip_link
from drivers.can.tests.link_listener import running, until
from drivers.clock import Clock
from drivers.readings import ThrusterCommand, ThrusterReport

pytestmark = [pytest.mark.vcan, pytest.mark.timeout(120)]

WAIT_S = 30.0
MARK = 0x1ABCDE


@pytest.fixture
def peer(vcan0):
    with can.Bus(vcan0, "socketcan", ignore_config=True) as bus:
        yield bus


def put(bus, frames):
    for frame in frames:
        bus.send(
            can.Message(
                arbitration_id=frame.identifier,
                is_extended_id=frame.extended,
                is_error_frame=frame.error,
                data=frame.data,
            ),
            timeout=5.0,
        )


async def test_the_kernel_delivers_what_is_wanted_in_order_with_its_own_stamps(vcan0, peer):
    clock = Clock()
    link = CanLink(
        "can", "socketcan", vcan0, [CanFilter(MARK, 0x1FFF_FFFF, True), CanFilter(0x77, 0x7FF, False)], clock
    )
    async with running(link) as heard:
        await until(lambda: heard.states, WAIT_S)
        before_s = clock.now()
        frames = [CanFrame(0.0, MARK, bytes([i])) for i in range(100)]
        frames.insert(50, CanFrame(0.0, 0x77, b"standard", extended=False))
        put(peer, [CanFrame(0.0, 0x77, b""), CanFrame(0.0, MARK & 0x7FF, b"", extended=False)])
        put(peer, frames)
        after_s = clock.now()
        await asyncio.sleep(
            0.3
        )  # read late on purpose: stamps must tell when the frames came, not when they were read
        await until(lambda: len(heard.frames) == 101, WAIT_S)
    assert [(frame.identifier, frame.data) for frame in heard.frames] == [(f.identifier, f.data) for f in frames]
    stamps = [frame.time_s for frame in heard.frames]
    assert stamps == sorted(stamps)
    assert before_s - 0.05 <= stamps[0] <= stamps[-1] <= after_s + 0.05
    assert link.counters == {"connections": 1, "frames": 101}


async def test_frames_read_late_keep_the_time_of_their_arrival(vcan0, peer):
    clock = Clock()
    link = CanLink("can", "socketcan", vcan0, [CanFilter(MARK, 0x1FFF_FFFF, True)], clock)
    async with running(link) as heard:
        await until(lambda: heard.states, WAIT_S)
        put(peer, [CanFrame(0.0, MARK, b"")])
        sent_s = clock.now()
        time.sleep(0.5)  # noqa: ASYNC251  the event loop is busy elsewhere
        await until(lambda: heard.frames, WAIT_S)
    assert heard.frames[0].time_s <= sent_s + 0.05


async def test_dronecan_over_the_bus(vcan0, peer):
    decoder = DroneCanDecoder([DroneCanThruster(1, 0), DroneCanThruster(2, 1)])
    link = CanLink("can", "socketcan", vcan0, decoder.filters(), Clock())
    async with running(link) as heard:
        await until(lambda: heard.states, WAIT_S)
        put(peer, encode_raw_command([8191, -8191], 10, 0))
        put(peer, encode_esc_status(EscStatus(0, 16.0, 2.5, 300.0, -900, 10, 1), 22, 0))
        await until(lambda: len(heard.frames) == 4, WAIT_S)
    readings = [reading for frame in heard.frames for reading in decoder.decode(frame)]
    times = [reading.time_s for reading in readings]
    assert readings == [
        ThrusterCommand(times[0], 1, 1.0),
        ThrusterCommand(times[0], 2, -1.0),
        ThrusterReport(times[2], 2, -900.0, 16.0, 2.5, 300.0, 0),
    ]


async def test_what_is_sent_arrives(vcan0, peer):
    marked = [CanFilter(MARK, 0x1FFF_FFFF, True)]
    link = CanLink("can", "socketcan", vcan0, marked, Clock(), may_send=marked)
    async with running(link) as heard:
        await until(lambda: heard.states, WAIT_S)
        assert link.send(CanFrame(0.0, MARK, b"12345678"))
        message = await asyncio.to_thread(peer.recv, WAIT_S)
    assert (message.arbitration_id, bytes(message.data)) == (MARK, b"12345678")
    assert heard.frames == []


async def test_bus_off_is_reported_and_ends(vcan0, peer):
    link = CanLink("can", "socketcan", vcan0, [CanFilter(MARK, 0x1FFF_FFFF, True)], Clock())
    async with running(link) as heard:
        await until(lambda: heard.states, WAIT_S)
        put(peer, [CanFrame(0.0, 0x40, bytes(8), extended=False, error=True)])
        await until(lambda: len(heard.states) == 2, WAIT_S)
        put(peer, [CanFrame(0.0, 0x100, bytes(8), extended=False, error=True)])
        await until(lambda: len(heard.states) == 3, WAIT_S)
    assert [up for up, _ in heard.states] == [True, False, True]
    assert "bus-off" in heard.states[1][1]


async def test_frames_that_the_kernel_lost_are_counted(vcan0, peer, monkeypatch):
    monkeypatch.setattr(socketcan_module, "RECEIVE_BUFFER_BYTES", 4096)
    link = CanLink("can", "socketcan", vcan0, [CanFilter(MARK, 0x1FFF_FFFF, True)], Clock())
    async with running(link) as heard:
        await until(lambda: heard.states, WAIT_S)
        put(peer, [CanFrame(0.0, MARK, b"")] * 300)  # the event loop does not get to read meanwhile
        await until(lambda: heard.frames, WAIT_S)
        put(peer, [CanFrame(0.0, MARK, b"last")])
        await until(lambda: heard.frames[-1].data == b"last", WAIT_S)
    assert link.counters["receive buffer overflow"] > 0
    assert link.counters["receive buffer overflow"] + link.counters["frames"] == 301


async def test_frames_of_can_fd_both_ways(own_vcan):
    ip_link("set", own_vcan, "down")
    ip_link("set", own_vcan, "mtu", "72")
    ip_link("set", own_vcan, "up")
    marked = [CanFilter(MARK, 0x1FFF_FFFF, True)]
    link = CanLink("can", "socketcan", own_vcan, marked, Clock(), may_send=marked)
    with can.Bus(own_vcan, "socketcan", fd=True, ignore_config=True) as peer:
        async with running(link) as heard:
            await until(lambda: heard.states, WAIT_S)
            peer.send(can.Message(arbitration_id=MARK, is_fd=True, data=bytes(range(64))), timeout=5.0)
            peer.send(can.Message(arbitration_id=MARK, data=b"classic"), timeout=5.0)
            await until(lambda: len(heard.frames) == 2, WAIT_S)
            assert link.send(CanFrame(0.0, MARK, bytes(48), fd=True))
            message = await asyncio.to_thread(peer.recv, WAIT_S)
    assert [(frame.data, frame.fd) for frame in heard.frames] == [(bytes(range(64)), True), (b"classic", False)]
    assert (message.arbitration_id, message.is_fd, len(message.data)) == (MARK, True, 48)


# The interface itself goes away


def _send_to(channel, data):
    with can.Bus(channel, "socketcan", ignore_config=True) as bus:
        bus.send(can.Message(arbitration_id=MARK, data=data), timeout=5.0)


async def test_an_interface_that_goes_down_comes_back(own_vcan):
    marked = CanFilter(MARK, 0x1FFF_FFFF, True)
    link = CanLink("can", "socketcan", own_vcan, [], Clock(), may_send=[marked])
    async with running(link) as heard:
        await until(lambda: heard.states, WAIT_S)
        for attempt in range(3):
            ip_link("set", own_vcan, "down")
            await until(lambda attempt=attempt: len(heard.states) == 2 * attempt + 2, WAIT_S)
            await asyncio.sleep(0.5)
            assert not link.send(CanFrame(0.0, MARK, b""))
            ip_link("set", own_vcan, "up")
            await until(lambda attempt=attempt: len(heard.states) == 2 * attempt + 3, WAIT_S)
            _send_to(own_vcan, bytes([attempt]))
            await until(lambda attempt=attempt: len(heard.frames) == attempt + 1, WAIT_S)
    assert heard.states == [(True, "")] + [(False, "interface is down"), (True, "")] * 3
    assert [frame.data for frame in heard.frames] == [b"\0", b"\1", b"\2"]


async def test_an_interface_that_is_down_at_the_start_comes_up(own_vcan):
    ip_link("set", own_vcan, "down")
    link = CanLink("can", "socketcan", own_vcan, [], Clock())
    async with running(link) as heard:
        await until(lambda: heard.states, WAIT_S)
        ip_link("set", own_vcan, "up")
        await until(lambda: len(heard.states) == 2, WAIT_S)
        _send_to(own_vcan, b"up")
        await until(lambda: heard.frames, WAIT_S)
    assert heard.states == [(False, "interface is down"), (True, "")]


async def test_an_interface_that_is_deleted_and_made_again_comes_back(own_vcan):
    link = CanLink("can", "socketcan", own_vcan, [], Clock())
    async with running(link) as heard:
        await until(lambda: heard.states, WAIT_S)
        ip_link("del", own_vcan)
        await until(lambda: len(heard.states) > 1 and not heard.states[-1][0], WAIT_S)
        await asyncio.sleep(0.5)
        ip_link("add", "dev", own_vcan, "type", "vcan")
        ip_link("set", own_vcan, "up")
        await until(lambda: heard.states[-1][0], WAIT_S)
        _send_to(own_vcan, b"new")
        await until(lambda: heard.frames, WAIT_S)
    assert heard.frames[-1].data == b"new"
    assert all(detail for up, detail in heard.states if not up)
