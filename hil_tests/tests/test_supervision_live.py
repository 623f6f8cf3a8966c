"""The whole gateway in real time: sockets, tasks and all, over good and bad links, signed and unsigned."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from pathlib import Path

import pytest

from gateway.config import Config
from gateway.findings import Finding
from hil_tests.loopback import free_port
from hil_tests.rig.ardusub import ArduSub, Mode
from hil_tests.rig.commands import Command
from hil_tests.rig.conduct import Conduct, Reply
from hil_tests.rig.link_conditions import LinkConditions
from hil_tests.rig.px4 import MainMode, Px4
from hil_tests.rig.router import Endpoint, UdpRouter
from hil_tests.tests.live_rig import HOST, LEARNT, LiveRig, live
from hil_tests.tests.scene import configuration, key_file

HOLD = 'thruster_fault = ["hold"]\ndelay_s = 0.5\n'
HELD = {ArduSub: Mode.ALT_HOLD, Px4: MainMode.ALTCTL}
KEY = hashlib.sha256(b"submarine").digest()
BAD = LinkConditions(loss=0.2, latency_s=0.5, jitter_s=0.05, reordering=0.1, duplication=0.1)
TOLD_WITHIN_S = 1.0
# all that a companion may say: no SYS_STATUS, which would be a leak to ArduSub, no SETUP_SIGNING
CITIZEN = {
    "HEARTBEAT", "STATUSTEXT", "COMMAND_LONG", "TIMESYNC", "NAMED_VALUE_FLOAT", "ONBOARD_COMPUTER_STATUS"
}  # fmt: skip
# before the first HEARTBEAT there is nobody to listen to, and nobody to tell
EARLY = {"not our autopilot", "not sent: no autopilot heard"}

both = pytest.mark.parametrize("make", [ArduSub, Px4], ids=["ardusub", "px4"])


@pytest.fixture
def port() -> int:
    return free_port()


@pytest.fixture
def configured(request, tmp_path: Path, port: int) -> Callable[..., Config]:
    def configured(mavlink: str = "") -> Config:
        return configuration(tmp_path, HOLD, mavlink=mavlink, port=port, channel=request.node.name, rate_hz=50.0)

    return configured


def ended(rig: LiveRig) -> str:
    """How the request ended, in the words of the findings; empty: it is under way."""
    notes = [one.text for one in rig.outcomes if isinstance(one, Finding) and one.detector == "failsafe"]
    return next((text for text in notes if "done" in text or "yours to act" in text), "")


@both
async def test_a_fault_is_told_at_once_and_held(make, configured, port, request):
    async with live(configured(), make(), request.node.name, port) as rig:
        await rig.learnt()
        assert not rig.vehicle.asked
        rig.vehicle.scene.entangle(1)
        shown_s = rig.clock.now()
        await rig.until(lambda: rig.vehicle.said("T1 entangled"))
        text = next(one for one in rig.vehicle.notes.texts if "T1 entangled" in one.text)
        await rig.until(lambda: rig.vehicle.said("Hold done for T1"))
    assert text.severity == 2
    assert text.time_s - shown_s < TOLD_WITHIN_S
    assert rig.vehicle.commander.mode is HELD[make]
    assert len(rig.vehicle.asked) == 1
    assert rig.vehicle.notes.counts.keys() == CITIZEN
    assert rig.vehicle.notes.clock_answers > 0 or make is ArduSub  # which asks every ten seconds only
    assert any("its clock is" in line for line in rig.summary.lines())
    assert set(rig.summary.drops["mavlink"]) <= EARLY


@both
async def test_signed_both_ways(make, configured, port, request, tmp_path):
    async with live(configured(key_file(tmp_path, KEY)), make(), request.node.name, port, KEY) as rig:
        await rig.learnt()
        rig.vehicle.scene.entangle(1)
        await rig.until(lambda: rig.vehicle.said("Hold done for T1"))
        assert rig.vehicle.notes.counts["BAD_DATA"] == 0
        rig.vehicle.peer.restart(rig.clock.now(), silent_s=1.0)  # it goes on a minute ahead, unarmed
        beats = len(rig.vehicle.notes.heartbeats)
        await rig.until(lambda: len(rig.vehicle.notes.heartbeats) > beats)
    assert set(rig.summary.drops["mavlink"]) <= EARLY


async def test_an_autopilot_with_another_key_is_not_heard(configured, port, request, tmp_path):
    async with live(configured(key_file(tmp_path, KEY)), ArduSub(), request.node.name, port, bytes(32)) as rig:
        await rig.until(lambda: rig.judged() > LEARNT)
        rig.vehicle.scene.entangle(1)
        await rig.until(lambda: any(getattr(one, "subject", "") == "thruster 1" for one in rig.outcomes))
    assert rig.vehicle.notes.texts == []
    assert rig.vehicle.asked == []
    assert set(rig.summary.drops["mavlink"]) - EARLY


@both
async def test_a_fault_is_told_and_held_over_a_bad_link(make, configured, port, request):
    vehicle, gateway = Endpoint(conditions=BAD, seed=1), Endpoint((HOST, port), seed=2)
    async with live(configured(), make(), request.node.name, vehicle.port) as rig:
        with UdpRouter([vehicle, gateway], rig.clock.now):
            await rig.until(lambda: rig.judged() > LEARNT and len(rig.vehicle.notes.heartbeats) > 1)
            rig.vehicle.scene.entangle(1)
            await rig.until(lambda: ended(rig))
    # of three tries all may be lost, or all of their answers: what is said to be done is done
    assert rig.vehicle.commander.mode is HELD[make] or ended(rig) != "Hold done for T1"
    assert vehicle.inward.counts["lost"] > 0 < vehicle.outward.counts["lost"]
    assert len(rig.vehicle.asked) <= 6  # three tries, each of which may come twice


class CutsTheLink(Conduct):
    """Nothing comes from the vehicle any more from the moment on at which it is first told to change the mode."""

    def __init__(self, endpoint: Endpoint) -> None:
        super().__init__()
        self._endpoints = [endpoint]

    def reply(self, command: int, parameters: tuple[float, ...]) -> Reply | None:
        if command == Command.DO_SET_MODE and self._endpoints:
            self._endpoints.pop().inward.cut(0.0)
        return super().reply(command, parameters)


async def test_a_link_cut_in_the_middle_of_a_command(configured, port, request):
    vehicle, gateway = Endpoint(), Endpoint((HOST, port))
    async with live(configured(), ArduSub(), request.node.name, vehicle.port, conduct=CutsTheLink(vehicle)) as rig:
        with UdpRouter([vehicle, gateway], rig.clock.now):
            await rig.learnt()
            rig.vehicle.scene.entangle(1)
            await rig.until(lambda: len(rig.vehicle.asked) >= 2)
            assert not rig.vehicle.said("Hold done")
            vehicle.mend()
            await rig.until(lambda: rig.vehicle.said("Hold done for T1"))
    assert len(rig.vehicle.asked) <= 3
    assert rig.vehicle.commander.mode is Mode.ALT_HOLD


async def test_routers_in_a_circle_bring_our_own_frames_back(configured, port, request):
    vehicle, gateway, other = Endpoint(), Endpoint((HOST, port)), Endpoint((HOST, free_port()))
    async with live(configured(), ArduSub(), request.node.name, vehicle.port) as rig:
        with UdpRouter([vehicle, gateway, other], rig.clock.now, echo=True):
            await rig.learnt()
            rig.vehicle.scene.entangle(1)
            await rig.until(lambda: rig.vehicle.said("Hold done for T1"))
    assert len(rig.vehicle.asked) == 1
    assert not any("component" in getattr(one, "text", "") for one in rig.outcomes)
