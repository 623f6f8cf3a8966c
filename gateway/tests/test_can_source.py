"""A CAN bus between its port and the pipeline: what is read of it, and what is lost of it."""

import asyncio
import contextlib
from collections import Counter
from dataclasses import dataclass, field

import pytest

import gateway.can_source as can_source_module
from drivers.can.dronecan import EscStatus, encode_esc_status, encode_raw_command
from drivers.can.frame import CanFrame
from drivers.can.frame_block import FrameBlock
from drivers.can.packets import OVERFLOW
from drivers.clock import Clock
from drivers.readings import FrameLoss, ThrusterCommand, ThrusterReport
from gateway.can_source import CanSource
from gateway.config import parse
from gateway.intake import Intake
from gateway.tests.conftest import TWO_THRUSTERS
from gateway.tests.live_vehicle import until
from gateway.wiring import can_decoder

CONTROLLER_OVERFLOW = CanFrame(0.0, 0x4, b"\0\x01\0\0\0\0\0\0", extended=False, error=True)


@dataclass
class Port:
    """A port that gives what is put into it, and counts what the test says was lost."""

    incoming: asyncio.Queue = field(default_factory=asyncio.Queue)
    counters: Counter = field(default_factory=Counter)

    def open(self, filters, clock, counters):
        self.counters = counters
        return self

    async def receive(self):
        return FrameBlock.of(await self.incoming.get())

    def close(self):
        """Nothing is open."""


@pytest.fixture
def port():
    return Port()


@pytest.fixture
def taken():
    return []


@pytest.fixture
def source(tmp_path, port, taken):
    config = parse(TWO_THRUSTERS, tmp_path)
    return CanSource(
        config.can[0], config, Clock(), Intake(lambda work: taken.extend(work.readings) or True), port.open
    )


@contextlib.asynccontextmanager
async def running(source):
    tasks = [asyncio.create_task(source.run(lambda state: None)), asyncio.create_task(source.watch_load())]
    try:
        yield
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


def traffic(periods):
    """Commands and reports of both thrusters at 50 Hz."""
    for n in range(periods):
        yield from encode_raw_command([50 * n, 4000], 10, n, time_s=0.02 * n)
        for index in (0, 1):
            status = EscStatus(0, 16.0, 3.0, 300.0, 1000 + n, 50, index)
            yield from encode_esc_status(status, 20 + index, n, time_s=0.02 * n + 0.001)


async def test_blocks_of_any_size_give_what_frames_one_by_one_give(source, port, taken, tmp_path):
    frames, config = list(traffic(100)), parse(TWO_THRUSTERS, tmp_path)
    decoder = can_decoder(config.can[0], config.thruster)
    wanted = [reading for frame in frames for reading in decoder.decode(frame)]
    async with running(source):
        for start, end in ((0, 1), (1, 3), (3, 9), (9, 200), (200, len(frames) - 1), (len(frames) - 1, len(frames))):
            port.incoming.put_nowait(frames[start:end])
        await until(lambda: source.received == len(frames))
    assert Counter(map(type, wanted)) == {ThrusterCommand: 200, ThrusterReport: 200}
    assert taken == wanted
    assert not source.drops()


async def test_what_is_lost_is_told_each_second_from_the_first_loss_on(source, port, taken, monkeypatch):
    monkeypatch.setattr(can_source_module, "LOAD_PERIOD_S", 0.02)
    async with running(source):
        await asyncio.sleep(0.1)
        assert taken == []
        port.counters[OVERFLOW] += 5
        await until(lambda: len(taken) >= 2)
        port.incoming.put_nowait([CONTROLLER_OVERFLOW])
        await until(lambda: any(one.overruns for one in taken))
        await until(lambda: not taken[-1].overruns)
    assert all(isinstance(one, FrameLoss) and one.link == "can0" for one in taken)
    assert [(one.frames, one.overruns) for one in taken if one.frames or one.overruns] == [(5, 0), (0, 1)]
    assert source.drops() == {OVERFLOW: 5, "controller overflow": 1}
