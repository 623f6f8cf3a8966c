"""A link over python-can's virtual bus, and over a port of our own contract that fails on command."""

import asyncio
from collections import Counter
from dataclasses import dataclass, field

import can
import pytest
from hypothesis import given
from hypothesis import strategies as st

import drivers.can.bus as bus_module
from drivers.can.bus import CanLink
from drivers.can.bus_state import BusState
from drivers.can.frame import CanFilter, CanFrame
from drivers.can.frame_block import FrameBlock
from drivers.can.port import CanPortError
from drivers.can.tests.link_listener import running, until
from drivers.clock import Clock

BUS_OFF = CanFrame(0.0, 0x40, bytes(8), extended=False, error=True)
RESTARTED = CanFrame(0.0, 0x100, bytes(8), extended=False, error=True)
PASSIVE = CanFrame(0.0, 0x4, b"\0\x10\0\0\0\0\0\0", extended=False, error=True)
DATA = CanFrame(0.0, 5, b"\x01")
THIS_ONE = CanFilter(5, 0x1FFF_FFFF, extended=True)


@dataclass
class FakePort:
    """A port that gives what is put into it: batches of frames, or the reason why it fails."""

    incoming: asyncio.Queue = field(default_factory=asyncio.Queue)
    sent: list = field(default_factory=list)
    takes: bool = True
    closed: bool = False

    async def receive(self):
        assert not self.closed
        item = await self.incoming.get()
        if isinstance(item, str):
            raise CanPortError(item)
        return FrameBlock.of(item)

    def send(self, frame):
        if not self.takes:
            raise CanPortError("buffer full")
        self.sent.append(frame)

    def close(self):
        self.closed = True


@dataclass
class FakeInterface:
    """Opens fake ports, after so many refusals."""

    refusals: int = 0
    ports: list = field(default_factory=list)

    def open(self, filters, clock, counters):
        if self.refusals:
            self.refusals -= 1
            raise CanPortError("interface is down")
        self.ports.append(FakePort())
        return self.ports[-1]


@pytest.fixture
def quick(monkeypatch):
    monkeypatch.setattr(bus_module, "BACK_OFF_FIRST_S", 0.001)
    monkeypatch.setattr(bus_module, "BACK_OFF_MAX_S", 0.004)


@pytest.fixture
def interface():
    return FakeInterface()


@pytest.fixture
def link(interface, quick):
    return CanLink("can a", "virtual", "x", [], Clock(), may_send=[THIS_ONE], open_port=interface.open)


# The link's own logic


async def test_frames_come_in_batches_and_in_order(link, interface):
    async with running(link) as heard:
        await until(lambda: interface.ports)
        batch = [CanFrame(float(i), i, b"") for i in range(10)]
        interface.ports[0].incoming.put_nowait(batch)
        await until(lambda: heard.frames)
        assert heard.frames == batch
        assert heard.states == [(True, "")]
        assert link.counters == {"connections": 1, "frames": 10}


async def test_a_bus_that_is_down_at_the_start_is_reported_once_and_comes_up(link, interface):
    interface.refusals = 5
    async with running(link) as heard:
        await until(lambda: interface.ports)
        await until(lambda: len(heard.states) == 2)
    assert heard.states == [(False, "interface is down"), (True, "")]


async def test_a_bus_that_goes_away_is_closed_and_comes_back(link, interface):
    async with running(link) as heard:
        for time in range(3):
            await until(lambda time=time: len(interface.ports) == time + 1)
            interface.ports[time].incoming.put_nowait([DATA])
            interface.ports[time].incoming.put_nowait("no such CAN interface")
        await until(lambda: len(interface.ports) == 4)
        await until(lambda: len(heard.states) == 7)
    assert len(heard.frames) == 3
    assert heard.states == [(True, ""), (False, "no such CAN interface")] * 3 + [(True, "")]
    assert all(port.closed for port in interface.ports)
    assert link.counters["connections"] == 4


async def test_the_pause_doubles_to_its_limit_and_starts_over_after_frames(link, interface, monkeypatch):
    pauses = []
    sleep = asyncio.sleep

    async def note(seconds):
        pauses.append(seconds)
        await sleep(0)

    interface.refusals = 5
    async with running(link):
        monkeypatch.setattr(bus_module.asyncio, "sleep", note)
        await _settle(sleep, lambda: interface.ports)
        interface.ports[0].incoming.put_nowait([DATA])
        interface.ports[0].incoming.put_nowait("gone")
        await _settle(sleep, lambda: len(interface.ports) == 2)
        monkeypatch.undo()
    assert pauses == [0.001, 0.002, 0.004, 0.004, 0.004, 0.001]


async def _settle(sleep, condition):
    async with asyncio.timeout(5.0):
        while not condition():
            await sleep(0)


@pytest.mark.parametrize("sign_of_life", [RESTARTED, DATA])
async def test_bus_off_is_a_state_that_ends_by_itself(link, interface, sign_of_life):
    async with running(link) as heard:
        await until(lambda: interface.ports)
        interface.ports[0].incoming.put_nowait([PASSIVE, BUS_OFF])
        await until(lambda: len(heard.states) == 3)
        interface.ports[0].incoming.put_nowait([sign_of_life])
        await until(lambda: len(heard.states) == 4)
    assert [up for up, _ in heard.states] == [True, True, False, True]
    assert heard.states[1][1] == "error passive"
    assert "bus-off" in heard.states[2][1]
    assert link.counters["bus-off"] == link.counters["error passive"] == 1
    assert not any(frame.error for frame in heard.frames)


async def test_send_goes_to_the_bus_that_is_there(link, interface):
    assert not link.send(DATA)
    async with running(link):
        await until(lambda: interface.ports)
        assert link.send(DATA)
        interface.ports[0].takes = False
        assert not link.send(DATA)
    assert not link.send(DATA)
    assert interface.ports[0].sent == [DATA]
    assert link.counters["send failed"] == 3


@pytest.mark.parametrize(
    ("may_send", "frame", "why"),
    [
        ([], DATA, "0x5 may not be sent on can a: it only listens"),
        ([THIS_ONE], CanFrame(0.0, 6, b""), "0x6 may not be sent on can a: want 0x5 under mask 0x1fffffff"),
        ([THIS_ONE], CanFrame(0.0, 5, b"", extended=False), "0x5 may not be sent"),
        ([THIS_ONE], CanFrame(0.0, 5, bytes(8), error=True), "0x5 may not be sent"),
    ],
)
async def test_only_what_it_may_send_is_sent(interface, quick, may_send, frame, why):
    link = CanLink("can a", "virtual", "x", [], Clock(), may_send=may_send, open_port=interface.open)
    async with running(link):
        await until(lambda: interface.ports)
        with pytest.raises(ValueError, match=why):
            link.send(frame)
    assert interface.ports[0].sent == []


async def test_error_frames_among_data_frames_take_their_turn(link, interface):
    async with running(link) as heard:
        await until(lambda: interface.ports)
        interface.ports[0].incoming.put_nowait([DATA, BUS_OFF, PASSIVE, BUS_OFF, DATA, DATA])
        await until(lambda: len(heard.frames) == 3)
    assert [up for up, _ in heard.states] == [True, False, True, False, True]
    assert link.counters == {"connections": 1, "frames": 3, "bus-off": 2, "error passive": 1}


async def test_a_callback_that_fails_is_not_taken_for_a_bus_that_fails(link, interface):
    def full_disk(frames):
        raise OSError("no space left on device")

    task = asyncio.create_task(link.run(full_disk, lambda state: None))
    await until(lambda: interface.ports)
    interface.ports[0].incoming.put_nowait([DATA])
    with pytest.raises(OSError, match="no space left"):
        await task
    assert interface.ports[0].closed


# Over python-can


@pytest.fixture
def peer():
    with can.Bus("test_bus", "virtual", ignore_config=True) as bus:
        yield bus


async def test_a_virtual_bus_delivers_what_is_wanted_with_the_time_of_its_arrival(peer):
    clock = Clock()
    link = CanLink("v", "virtual", "test_bus", [CanFilter(0x100, 0x7F0, extended=False)], clock)
    async with running(link) as heard:
        await until(lambda: heard.states)
        before_s = clock.now()
        for identifier in range(0x0F0, 0x130):
            peer.send(can.Message(arbitration_id=identifier, is_extended_id=False, data=b"abc"))
        peer.send(can.Message(arbitration_id=0x100, is_extended_id=False, is_remote_frame=True))
        peer.send(can.Message(arbitration_id=0x100, is_extended_id=True))
        await until(lambda: len(heard.frames) == 16 and link.counters["remote frame"])
    assert [frame.identifier for frame in heard.frames] == list(range(0x100, 0x110))
    assert all(before_s - 0.01 <= frame.time_s <= clock.now() for frame in heard.frames)
    assert heard.frames[0] == CanFrame(heard.frames[0].time_s, 0x100, b"abc", extended=False)


async def test_what_is_sent_arrives_and_is_not_heard_back(peer):
    wanted = CanFilter(0x1234567, 0x1FFF_FFFF, extended=True)
    link = CanLink("v", "virtual", "test_bus", [], Clock(), may_send=[wanted])
    async with running(link) as heard:
        await until(lambda: heard.states)
        assert link.send(CanFrame(0.0, 0x1234567, b"12345678"))
        message = await asyncio.to_thread(peer.recv, 2.0)
        await asyncio.sleep(0.02)
    assert (message.arbitration_id, bytes(message.data), message.is_extended_id) == (0x1234567, b"12345678", True)
    assert heard.frames == []


async def test_a_thousand_frames_at_once_arrive_in_order(peer):
    link = CanLink("v", "virtual", "test_bus", [], Clock())
    async with running(link) as heard:
        await until(lambda: heard.states)
        for i in range(1500):
            peer.send(can.Message(arbitration_id=i, data=b""))
        await until(lambda: len(heard.frames) == 1500)
    assert [frame.identifier for frame in heard.frames] == list(range(1500))


async def test_garbage_from_an_adapter_is_counted(peer):
    link = CanLink("v", "virtual", "test_bus", [], Clock())
    async with running(link) as heard:
        await until(lambda: heard.states)
        peer.send(can.Message(arbitration_id=0xFFFF_FFFF, data=b""))
        peer.send(can.Message(arbitration_id=7, data=b""))
        await until(lambda: heard.frames)
    assert [frame.identifier for frame in heard.frames] == [7]
    assert link.counters["malformed frame"] == 1


async def test_a_missing_socketcan_interface_is_a_state_and_not_an_exception(quick):
    link = CanLink("c", "socketcan", "nosuchcan9", [], Clock())
    async with running(link) as heard:
        await until(lambda: heard.states)
        await asyncio.sleep(0.05)
    assert len(heard.states) == 1
    assert heard.states[0][0] is False


def test_an_unknown_interface_is_refused_with_those_that_are_known():
    with pytest.raises(ValueError, match=r"interface must be one of .*socketcan.*virtual.*, got 'socketscan'"):
        CanLink("c", "socketscan", "can0", [], Clock())


async def test_the_configuration_of_python_can_is_not_read(monkeypatch, tmp_path, peer):
    monkeypatch.setenv("CAN_INTERFACE", "socketcan")
    monkeypatch.setenv("CAN_CONFIG", '{"receive_own_messages": true}')
    monkeypatch.chdir(tmp_path)
    (tmp_path / "can.ini").write_text("[default]\ninterface = socketcan\nchannel = nowhere\n")
    link = CanLink("v", "virtual", "test_bus", [], Clock(), may_send=[THIS_ONE])
    async with running(link) as heard:
        await until(lambda: heard.states)
        assert link.send(DATA)
        await asyncio.sleep(0.02)
    assert heard.states == [(True, "")]
    assert heard.frames == []


# The state that frames tell, whatever they come from


def changes(*blocks):
    counters = Counter()
    state = BusState(counters)
    told = [(one.row, one.up, one.detail) for block in blocks for one in state.changes(FrameBlock.of(block))]
    return told, counters


def test_a_block_tells_each_change_where_it_is():
    told, counters = changes([DATA, PASSIVE, PASSIVE, DATA, BUS_OFF, BUS_OFF, DATA, DATA], [DATA], [BUS_OFF], [DATA])
    bus_off = "bus-off (back by restart-ms only)"
    assert told == [
        (1, True, "error passive"),
        (4, False, bus_off),
        (6, True, ""),
        (0, False, bus_off),
        (0, True, ""),
    ]
    assert counters == {"error passive": 2, "bus-off": 3}


@given(st.lists(st.sampled_from([DATA, PASSIVE, BUS_OFF, RESTARTED]), min_size=1, max_size=20), st.data())
def test_the_state_does_not_depend_on_how_frames_are_cut(frames, data):
    cut = data.draw(st.integers(1, len(frames)))
    whole, counters = changes(frames)
    parts, same = changes(frames[:cut], *([frames[cut:]] if frames[cut:] else []))
    assert [one[1:] for one in parts] == [one[1:] for one in whole]
    assert same == counters
