"""Frames and packets come to where they belong, through their wires, and are recorded as the gateway gets them."""

import asyncio
from collections import Counter

import pytest

from drivers.can.frame import CanFilter, CanFrame
from drivers.clock import Clock
from drivers.logs.candump import read_candump
from drivers.logs.damage import DamageReport
from hil_tests.playback.memory import MemoryBus, MemoryLink
from hil_tests.playback.recorder import HEARD, SAID, Recorder
from hil_tests.playback.session import Parts, Session
from hil_tests.wires.way import Passed

HEARTBEAT = bytes.fromhex("fd09000000010100000013000000020351030300") + bytes(1)
START_S = 1_700_000_000.0


class ScriptedVehicle:
    """Sends what it is given, and keeps what it gets."""

    def __init__(self):
        self.autopilot, self.devices, self.packets = [], [], []
        self.frames_heard, self.packets_heard, self.advanced_s = [], [], []

    def advance(self, time_s):
        self.advanced_s.append(time_s)

    def sent_by_autopilot(self):
        sent, self.autopilot = self.autopilot, []
        return sent

    def sent_by_devices(self):
        sent, self.devices = self.devices, []
        return sent

    def to_devices(self, frames):
        self.frames_heard += frames

    def datagrams(self):
        sent, self.packets = self.packets, []
        return sent

    def to_autopilot(self, time_s, data):
        self.packets_heard.append((time_s, data))


class HoldingWire:
    """Lets everything through, so much later; the gateway's controller is bus-off at these times."""

    def __init__(self, hold_s, off_s=()):
        self.counts, self._items, self._hold_s, self.off_s = Counter(), [], hold_s, off_s

    def put(self, time_s, item, towards):
        self._items.append((time_s + self._hold_s, Passed(item, towards)))

    def due(self, time_s):
        due = [passed for due_s, passed in self._items if due_s <= time_s]
        self._items = [one for one in self._items if one[0] > time_s]
        return due

    def next_s(self):
        return self._items[0][0] if self._items else float("inf")

    def bus_off(self, time_s):
        return time_s - START_S in self.off_s


@pytest.fixture
def stage(tmp_path):
    vehicle, bus, link = ScriptedVehicle(), MemoryBus(), MemoryLink()
    with Recorder(tmp_path) as recorder:
        yield vehicle, bus, link, recorder


def session(stage, can_wire=None, mavlink_wire=None, is_recorded=False):
    vehicle, bus, link, recorder = stage
    wires = can_wire or HoldingWire(0.0), mavlink_wire or HoldingWire(0.0)
    return Session(Parts(vehicle, is_recorded, bus, wires[0], "can0", link, wires[1], recorder))


def frame(time_s, identifier=0x123, data=b"\x01"):
    return CanFrame(START_S + time_s, identifier, data)


async def test_gateway_and_escs_hear_commands_and_the_gateway_hears_reports_in_order_of_time(stage):
    vehicle, bus, _, _ = stage
    port = bus.opener()([], Clock(), Counter())
    vehicle.autopilot = [frame(0.002, 1), frame(0.012, 2)]
    vehicle.devices = [frame(0.005, 3)]
    session(stage).step(START_S + 0.02)
    assert [one.identifier for one in (await port.receive()).frames()] == [1, 3, 2]
    assert [one.identifier for one in vehicle.frames_heard] == [1, 2]


async def test_the_gateway_gets_error_frames_and_what_it_would_filter_for_the_load_of_the_bus(stage):
    vehicle, bus, _, _ = stage
    port = bus.opener()([CanFilter(2, 0xFF, extended=True)], Clock(), Counter())
    broken = CanFrame(START_S, 0x40, bytes(8), error=True)
    vehicle.devices = [frame(0.0, 1), frame(0.0, 2), broken]
    session(stage).step(START_S)
    assert list((await port.receive()).frames()) == [frame(0.0, 1), frame(0.0, 2), broken]


async def test_what_a_wire_holds_comes_later_and_commands_are_heard_by_the_gateway_at_once(stage):
    vehicle, bus, _, _ = stage
    port = bus.opener()([], Clock(), Counter())
    vehicle.autopilot, vehicle.devices = [frame(0.0, 1)], [frame(0.0, 2)]
    played = session(stage, can_wire=HoldingWire(1.0))
    played.step(START_S)
    assert [one.identifier for one in (await port.receive()).frames()] == [1]
    assert vehicle.frames_heard == []
    played.step(START_S + 1.0)
    assert [one.identifier for one in (await port.receive()).frames()] == [2]
    assert [one.identifier for one in vehicle.frames_heard] == [1]


@pytest.mark.parametrize("is_recorded", [False, True])
async def test_what_comes_while_the_gateway_is_bus_off_only_the_escs_hear(stage, is_recorded):
    vehicle, bus, _, _ = stage
    port = bus.opener()([], Clock(), Counter())
    vehicle.autopilot = [frame(0.0, 1), frame(0.25, 2), frame(0.5, 3)]
    session(stage, can_wire=HoldingWire(0.0, off_s=[0.25]), is_recorded=is_recorded).step(START_S + 0.5)
    assert [one.identifier for one in (await port.receive()).frames()] == [1, 3]
    assert [one.identifier for one in vehicle.frames_heard] == ([] if is_recorded else [1, 2, 3])


async def test_commands_of_a_recorded_dive_are_heard_as_faults_leave_them(stage):
    vehicle, bus, _, _ = stage
    port = bus.opener()([], Clock(), Counter())
    vehicle.autopilot, vehicle.devices = [frame(0.0, 1)], [frame(0.001, 2)]
    played = session(stage, can_wire=HoldingWire(1.0), is_recorded=True)
    played.step(START_S + 0.5)
    played.step(START_S + 1.5)
    assert [one.identifier for one in (await port.receive()).frames()] == [1, 2]
    assert vehicle.frames_heard == []


async def delivered():
    """A link in memory lets frames go first that were sent before."""
    for _ in range(3):
        await asyncio.sleep(0)


async def test_frames_are_heard_before_packets_that_came_after_them(stage):
    vehicle, bus, link, _ = stage
    port, heard = bus.opener()([], Clock(), Counter()), []

    async def read():
        heard.extend((await port.receive()).time_s.tolist())

    reading = asyncio.create_task(read())
    await link.connect(None, heard.append, None, Counter())
    await delivered()
    vehicle.devices, vehicle.packets = [frame(0.015)], [(START_S + 0.02, HEARTBEAT)]
    session(stage).step(START_S + 0.02)
    await reading
    await delivered()
    assert heard == [START_S + 0.015, HEARTBEAT]


async def test_packets_pass_both_ways_through_the_wire(stage):
    vehicle, _, link, _ = stage
    heard = []
    transport = await link.connect(None, heard.append, None, Counter())
    vehicle.packets = [(START_S, HEARTBEAT)]
    transport.send(b"\xfe\x00\x00\xff\x00\x00\x00\x00")
    played = session(stage, mavlink_wire=HoldingWire(1.0))
    played.step(START_S)
    assert (heard, vehicle.packets_heard) == ([], [])
    played.step(START_S + 1.0)
    await delivered()
    assert heard == [HEARTBEAT]
    assert vehicle.packets_heard == [(START_S + 1.0, b"\xfe\x00\x00\xff\x00\x00\x00\x00")]


async def test_a_gateway_that_has_closed_its_link_hears_nothing_more(stage):
    vehicle, _, link, _ = stage
    heard = []
    (await link.connect(None, heard.append, None, Counter())).close()
    vehicle.packets = [(START_S, HEARTBEAT)]
    session(stage).step(START_S)
    assert heard == []


def test_what_the_gateway_gets_is_recorded_as_everybody_reads_it(stage, tmp_path):
    vehicle, _, _, recorder = stage
    frames = [frame(0.25, 0x12345678, bytes(range(8))), CanFrame(START_S + 0.5, 0x7FF, b"", extended=False)]
    vehicle.devices = list(frames)
    vehicle.packets = [(START_S + 0.5, HEARTBEAT + HEARTBEAT), (START_S + 0.5, b"noise")]
    session(stage).step(START_S + 0.5)
    recorder.close()
    read = [
        (name, one) for name, block in read_candump(tmp_path / "can.log", DamageReport()) for one in block.frames()
    ]
    assert read == [("can0", one) for one in frames]
    stamp = round(1e6 * (START_S + 0.5)).to_bytes(8, "big")
    assert (tmp_path / HEARD).read_bytes() == 2 * (stamp + HEARTBEAT) + stamp + b"noise"
    assert (tmp_path / SAID).read_bytes() == b""
