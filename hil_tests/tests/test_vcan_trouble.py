"""A whole gateway on a real bus that has every kind of trouble: it says so, goes on, and stays silent on CAN."""

from __future__ import annotations

import asyncio
import contextlib
import json
import subprocess
from dataclasses import replace

import pytest

from detectors.verdict import Level
from drivers.can.frame import CanFrame
from drivers.can.packets import packed
from drivers.can.socketcan import open_socket
from drivers.can.tests.conftest import ip_link, own_vcan, vcan0  # noqa: F401  fixtures
from gateway.channel import ThrusterJudgement
from gateway.findings import Finding
from gateway.run import run
from hil_tests.loopback import free_port
from hil_tests.tests.scene import STAND_INS, Scene, configuration

pytestmark = [pytest.mark.vcan, pytest.mark.timeout(600)]

WAIT_S = 90.0  # the machine may be an emulated one
PERIOD_S = 0.1
BUS_OFF = CanFrame(0.0, 0x40, bytes(8), extended=False, error=True)
AWAY = "vcangone0"


class Nodes:
    """An autopilot and its ESCs, on the bus whenever there is one.

    Attributes:
        put: frames that the interface took.
    """

    def __init__(self, channel):
        self._channel = channel
        self._scene = Scene()
        self.speaking, self.put = True, 0

    async def live(self):
        for n in range(10**9):
            if self.speaking:
                self.send(self._scene.frames(n))
            await asyncio.sleep(PERIOD_S)

    def send(self, frames):
        with contextlib.suppress(OSError), open_socket(self._channel, []) as opened:
            for frame in frames:
                opened.send(packed(frame))
                self.put += 1


class Watched:
    """What the gateway says of the bus."""

    def __init__(self, log):
        self.outcomes = []
        self._log = log

    def findings(self):
        return [one for one in self.outcomes if isinstance(one, Finding) and one.subject == "link can0"]

    def judged(self):
        return sum(isinstance(one, ThrusterJudgement) for one in self.outcomes)

    async def until(self, condition):
        async with asyncio.timeout(WAIT_S):
            while not condition():  # noqa: ASYNC110  a condition of any kind
                await asyncio.sleep(0.05)

    async def trouble(self, words):
        """The link has said so, and the pilot was told: on a slow machine perhaps that it is silent, which it is."""
        await self.until(lambda: words in self._log.text and self.suspected())
        self._log.clear()

    def suspected(self):
        return bool(self.findings()) and self.findings()[-1].level is Level.SUSPECT

    async def over(self):
        judged = self.judged()
        await self.until(lambda: not self.suspected() and self.judged() > judged)


def sent_on(channel):
    """Frames that anybody on this machine has put on the bus, as the interface counts them."""
    answer = subprocess.run(
        ["ip", "-statistics", "-json", "link", "show", "dev", channel], check=True, capture_output=True
    )
    return json.loads(answer.stdout)[0]["stats64"]["tx"]["packets"]


@contextlib.asynccontextmanager
async def running(config, nodes, log):
    watched, stop = Watched(log), asyncio.Event()
    living = asyncio.create_task(nodes.live())
    gateway = asyncio.create_task(run(config, observer=watched.outcomes.append, stop=stop, factories=STAND_INS))
    try:
        yield watched
        assert not gateway.done(), gateway
    finally:
        stop.set()
        living.cancel()
        await asyncio.wait([gateway, living])
    gateway.result()


async def test_a_bus_in_trouble_is_told_of_and_watched_again_and_nothing_is_ever_sent(tmp_path, own_vcan, caplog):  # noqa: F811
    config = configuration(tmp_path, port=free_port(), channel=own_vcan)
    config = replace(config, can=tuple(bus.model_copy(update={"interface": "socketcan"}) for bus in config.can))
    nodes = Nodes(own_vcan)
    async with running(config, nodes, caplog) as watched:
        await watched.until(lambda: watched.judged() > 20)

        nodes.speaking = False
        nodes.send([BUS_OFF])
        await watched.trouble("down: bus-off")
        nodes.speaking = True  # a driver that restarted without a word
        await watched.over()

        ip_link("set", own_vcan, "down")
        await watched.trouble("down: interface is down")
        ip_link("set", own_vcan, "up")
        await watched.over()

        ip_link("set", own_vcan, "down")
        ip_link("set", own_vcan, "name", AWAY)
        await watched.trouble("down: no such CAN interface")
        ip_link("set", AWAY, "name", own_vcan)
        ip_link("set", own_vcan, "up")
        await watched.over()
        assert sent_on(own_vcan) == nodes.put

        ip_link("del", own_vcan)  # an adapter that is unplugged
        await watched.trouble("down: no such CAN interface")
        nodes.put = 0
        ip_link("add", "dev", own_vcan, "type", "vcan")
        ip_link("set", own_vcan, "up")
        await watched.over()
    assert sent_on(own_vcan) == nodes.put > 0
