"""ESCs on the autopilot's own CAN bus, watched by a companion without an adapter: on loopback, and on bad links."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import threading
import time
from functools import partial

import numpy as np
import pytest
from pymavlink.dialects.v20 import ardupilotmega as mavlink

from drivers.can.dronecan import EscStatus, encode_esc_status, encode_raw_command
from drivers.can.dronecan.node_status import NodeStatus, encode_node_status
from drivers.clock import Clock
from gateway.checking import forwarded_can
from gateway.checking.forwarded_can import check_forwarded
from gateway.config import parse
from gateway.run import run
from hil_tests.loopback import free_port
from hil_tests.random_runs import random_run
from hil_tests.rig.ardusub import ArduSub
from hil_tests.rig.autopilot import AutopilotPeer
from hil_tests.rig.px4 import Px4
from hil_tests.tests.live_rig import HOST, PERIOD_S, LiveRig
from hil_tests.tests.sampled_rig import Losses, SampledRig
from hil_tests.tests.scene import HEAD, STAND_INS, THRUSTER, THRUSTERS, Scene

FORWARD = mavlink.MAV_CMD_CAN_FORWARD
STATUS_ID, RAW_COMMAND_ID = 1034, 1030
STATUS_STEPS = round(1.0 / PERIOD_S)
# what remains of transfers of which a frame is lost
LOST = {
    "missing start", "unfinished transfer", "toggle", "transfer id", "repeated transfer", "timed out", "CRC",
    "speed after losses",
}  # fmt: skip


def configuration(folder, port=0, thrusters=THRUSTERS, align="sample_rate_hz = 50"):
    """A gateway that reads all thrusters on the autopilot's CAN1."""
    text = HEAD.format(channel="1", port=port, mavlink="", rate_hz=50.0)
    text = text.replace('"virtual"', '"mavlink"').replace("sample_rate_hz = 50.0", align)
    for number in thrusters:
        text += THRUSTER.format(number=number, esc=number - 1, direction="ahead")
    return parse(text, folder)


# The whole gateway, over loopback -----------------------------------------------------------------


class ForwardingVehicle:
    """An autopilot over UDP, with ESCs on its first CAN bus."""

    def __init__(self, port, commander, now, can_buses=2):
        self.scene, self.commander = Scene(), commander
        self.peer = AutopilotPeer((HOST, port), commander, can_buses=can_buses)
        self._now, self._start_s, self._n = now, now(), 0

    @property
    def notes(self):
        return self.peer.notes

    def said(self, words):
        return any(words in text.text for text in self.notes.texts)

    def step(self):
        time_s = self._now()
        for frame in self.scene.frames(self._n):
            self.peer.on_bus(time_s, 1, frame)
        self.peer.exchange(time_s, self.scene.telemetry(time_s - self._start_s + 1.0))
        self._n += 1

    async def live(self):
        try:
            while True:
                self.step()
                await asyncio.sleep(PERIOD_S)
        finally:
            self.step()  # what was said to it at last
            self.peer.close()


@contextlib.asynccontextmanager
async def live(folder, commander, can_buses=2):
    port, clock, stop, outcomes = free_port(), Clock(), asyncio.Event(), []
    config = configuration(folder, port)
    vehicle = ForwardingVehicle(port, commander, clock.now, can_buses)
    living = asyncio.create_task(vehicle.live())
    gateway = asyncio.create_task(
        run(config, clock=clock, observer=outcomes.append, stop=stop, factories=STAND_INS), name="gateway"
    )
    rig = LiveRig(vehicle, gateway, clock, outcomes)
    try:
        yield rig
    finally:
        stop.set()
        rig.summary = await gateway
        living.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await living


async def test_fault_of_an_esc_on_the_autopilots_bus_is_told_to_the_pilot(tmp_path):
    async with live(tmp_path, ArduSub()) as rig:
        await rig.learnt()
        forwarder = rig.vehicle.peer.forwarder
        assert forwarder.filter_ids >= {STATUS_ID, RAW_COMMAND_ID}
        assert forwarder.client == (1, 192)
        rig.vehicle.scene.entangle(2)
        await rig.until(lambda: rig.vehicle.said("T2 entangled"))
        told = {one.subject for one in rig.outcomes if getattr(getattr(one, "level", None), "name", "") == "FAULT"}
    assert {"thruster 2"} <= told
    assert not rig.vehicle.said("can0")
    assert rig.summary.frames["can0"] > 500
    assert rig.summary.drops["can0"].total() < 0.01 * rig.summary.frames["can0"]
    asked = [one.parameters[0] for one in rig.vehicle.notes.commands if one.command == FORWARD]
    assert asked == [1.0] * (len(asked) - 1) + [0.0]  # kept alive, and ended
    assert forwarder.client is None
    assert forwarder.filter_ids == frozenset()  # nobody else finds our filter


@pytest.mark.parametrize(
    ("make", "can_buses", "why"),
    [(ArduSub, 0, "autopilot has no CAN1 (CAN_P1_DRIVER)"), (Px4, 0, "PX4 does not forward CAN")],
)
async def test_why_it_is_not_forwarded_is_said(make, can_buses, why, tmp_path, caplog):
    caplog.set_level(logging.INFO, "gateway")
    async with live(tmp_path, make(), can_buses) as rig:
        await rig.until(lambda: f"can0 down: {why}" in caplog.messages)
    assert 0.0 not in [one.parameters[0] for one in rig.vehicle.notes.commands if one.command == FORWARD]


# Links that lose frames ---------------------------------------------------------------------------


def steady(scene):
    """All that its ESCs and their commander say; each also says once a second how it is."""

    def frames(n):
        status = NodeStatus(uptime_s=100 + n // STATUS_STEPS)
        statuses = [encode_node_status(status, node, n // STATUS_STEPS % 32) for node in (10, 21, 22, 23, 24)]
        said = statuses if n % STATUS_STEPS == 0 else []
        return [*scene.frames(n), *(frame for one in said for frame in one)]

    return frames


@pytest.fixture
def scene():
    return Scene()


@pytest.fixture
def sampled(tmp_path, scene):
    return SampledRig(configuration(tmp_path), ArduSub(), steady(scene), STAND_INS)


@pytest.mark.parametrize(
    "losses",
    [Losses(0.1), Losses(0.5), Losses(0.3, burst_s=0.1), Losses(0.3, burst_s=1.0)],
    ids=["10 %", "50 %", "bursts of 0.1 s", "bursts of 1 s"],
)
def test_lost_frames_are_no_findings(sampled, losses):
    sampled.autopilot.forwarder.has_room = losses
    sampled.run(30.0)
    assert sampled.texts == []
    assert sampled.autopilot.forwarder.lost > 1000


def test_fault_is_found_all_the_same(sampled, scene):
    sampled.autopilot.forwarder.has_room = Losses(0.3)
    sampled.run(20.0)
    scene.entangle(3)
    sampled.run(5.0)
    assert [one.subject for one in sampled.findings if one.level.name == "FAULT"] == ["thruster 3"]
    assert sampled.bus.drops().keys() <= LOST
    assert sampled.bus.drops().total() > 0  # counted, and no more


@pytest.mark.parametrize("losses", [Losses(0.1), Losses(0.2, burst_s=0.4)], ids=["10 %", "bursts"])
def test_real_detectors_do_not_take_lost_frames_for_faults(tmp_path, losses):
    runs = [random_run(seed, samples=3000) for seed in (2, 3)]

    def frames(n):
        commands = [round(8191 * float(one.command[n])) for one in runs]
        reports = [
            EscStatus(0, 16.0, 3.0, 300.0, round(float(one.speed_rpm[n])), 50, i) for i, one in enumerate(runs)
        ]
        statuses = [encode_esc_status(report, 20 + i, n % 32) for i, report in enumerate(reports)]
        return [*encode_raw_command(commands, 10, n % 32), *np.concatenate(statuses)]

    rig = SampledRig(configuration(tmp_path, thrusters=(1, 2), align=""), ArduSub(), frames)
    rig.autopilot.forwarder.has_room = losses
    rig.run(59.9)
    assert rig.texts == []
    assert rig.judged > 500


def test_dead_esc_is_told_and_a_dead_bus(sampled, scene):
    sampled.autopilot.forwarder.has_room = Losses(0.3)
    sampled.run(10.0)
    silent = partial(mute, steady(scene), 20 + THRUSTERS[1])
    sampled.frames = silent
    sampled.run(8.0)
    assert any(text.startswith("T2 ESC silent") for text in sampled.texts)
    assert not any(text.startswith("can0") for text in sampled.texts)


def mute(frames, node, n):
    return [frame for frame in frames(n) if frame.identifier & 0x7F != node]


def test_another_program_that_takes_the_bus_over_is_told(sampled):
    other = mavlink.MAVLink(None, srcSystem=250, srcComponent=189)
    sampled.run(10.0)
    assert sampled.texts == []
    request = mavlink.MAVLink_command_long_message(1, 1, FORWARD, 0, 2, 0, 0, 0, 0, 0, 0)
    for _ in range(400):  # it asks more often than we do
        sampled.step()
        sampled.autopilot.receive(sampled.time_s, request.pack(other))
        sampled.autopilot.on_bus(sampled.time_s, 2, next(iter(Scene().frames(0))))
    assert sampled.texts[0].startswith("can0 another program has CAN2 forwarded")


def test_restarted_autopilot_is_asked_anew_and_the_bus_is_not_missed(sampled):
    sampled.run(10.0)
    sampled.autopilot.restart(sampled.time_s, silent_s=2.0)
    assert sampled.autopilot.forwarder.client is None
    sampled.run(5.0)
    assert sampled.autopilot.forwarder.client == (1, 192)
    assert sampled.autopilot.forwarder.filter_ids >= {STATUS_ID}
    assert not any(text.startswith(("can0", "T")) for text in sampled.texts)


def test_lost_mavlink_is_told_and_not_the_bus_that_came_over_it(sampled):
    sampled.run(10.0)
    sampled.cut = True
    sampled.run(6.0)
    sampled.link(up=False)
    sampled.run(20.0)
    sampled.cut = False
    sampled.link(up=True)
    sampled.run(10.0)
    assert sampled.texts
    assert all(text.startswith("mavlink") for text in sampled.texts)
    assert sampled.autopilot.forwarder.client == (1, 192)


# gateway check ------------------------------------------------------------------------------------


@contextlib.contextmanager
def standing_by(port, commander, can_buses=2, busy=True):
    """A vehicle in a thread of its own, for checks that run loops of their own."""
    vehicle = ForwardingVehicle(port, commander, time.time, can_buses)
    if not busy:
        vehicle.scene.frames = lambda _: ()
    end = threading.Event()

    def live():
        while not end.wait(PERIOD_S):
            vehicle.step()

    thread = threading.Thread(target=live)
    thread.start()
    try:
        yield vehicle
    finally:
        end.set()
        thread.join()
        vehicle.step()  # what was said to it at last
        vehicle.peer.close()


def checked(folder, make, **options):
    port = free_port()
    config = configuration(folder, port)
    with standing_by(port, make(), **options) as vehicle:
        return check_forwarded(config.can[0], config, config.mavlink), vehicle


def test_check_says_what_comes_and_ends_it(tmp_path, monkeypatch):
    monkeypatch.setattr(forwarded_can, "COUNT_S", 1.0)
    result, vehicle = checked(tmp_path, ArduSub)
    assert result.ok
    assert "the autopilot's CAN1 is forwarded: " in result.detail
    assert result.detail.endswith("frames/s from nodes 10, 21, 22, 23, 24")
    rate_hz = float(result.detail.split(": ")[1].split(" ")[0])
    assert 200.0 < rate_hz < 2000.0
    assert vehicle.peer.forwarder.client is None


@pytest.mark.parametrize(
    ("make", "options", "detail", "remedy"),
    [
        (ArduSub, {"can_buses": 0}, "autopilot has no CAN1", "CAN_P1_DRIVER = 1"),
        (Px4, {}, "PX4 does not forward CAN", "socketcan"),
    ],
)
def test_check_says_why_nothing_comes(make, options, detail, remedy, tmp_path):
    result, _ = checked(tmp_path, make, **options)
    assert not result.ok
    assert detail in result.detail
    assert remedy in result.remedy


def test_check_of_a_bus_on_which_nobody_speaks_is_well(tmp_path, monkeypatch):
    monkeypatch.setattr(forwarded_can, "COUNT_S", 0.5)
    result, _ = checked(tmp_path, ArduSub, busy=False)
    assert result.ok
    assert "are the ESCs on?" in result.detail


def test_check_without_an_autopilot_says_so(tmp_path, monkeypatch):
    monkeypatch.setattr(forwarded_can, "ASK_S", 0.3)
    config = configuration(tmp_path, free_port())
    result = check_forwarded(config.can[0], config, config.mavlink)
    assert not result.ok
    assert "no autopilot heard" in result.detail
