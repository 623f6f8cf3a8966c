"""The running gateway against a CAN bus and an autopilot on the loopback."""

import asyncio
import contextlib
import json
import logging
import math
import socket
import time
from collections.abc import AsyncIterator
from dataclasses import replace
from pathlib import Path

import can
import pytest
from pymavlink.dialects.v20 import ardupilotmega as dialect
from threadpoolctl import threadpool_info, threadpool_limits

from drivers.can.dronecan import EscStatus, encode_esc_status, encode_raw_command
from drivers.clock import Clock
from gateway import state
from gateway.channel import SpeedJudgement, ThrusterJudgement
from gateway.config import Config, parse
from gateway.findings import Finding
from gateway.pipeline import Factories
from gateway.run import run
from gateway.tests.conftest import FULL_RPM, SPEED_WATCH, TWO_THRUSTERS, GroundSpeedDetector, ThresholdDetector

PERIOD_S = 0.02
STAND_INS = Factories(thruster=ThresholdDetector)


class Vehicle:
    """Two thrusters on a virtual CAN bus, and an armed ArduSub over UDP that accepts every command."""

    def __init__(self, port: int) -> None:
        self.share = 1.0  # of its speed that thruster 2 still reaches
        self.speed_mps = 1.0  # to the north
        self.mode = 19  # MANUAL
        self._north_m, self._moved_s, self._start_s = 0.0, time.monotonic(), time.monotonic()
        self.bus = can.Bus(interface="virtual", channel="gateway tests")
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setblocking(False)
        self.gateway = ("127.0.0.1", port)
        self.mavlink = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
        self.texts: list[tuple[int, str]] = []
        self.states: list[int] = []
        self.commands: list[tuple[int, float, float]] = []

    async def live(self) -> None:
        """One step each 20 ms until it is cancelled."""
        n = 0
        try:
            while True:
                self.step(n)
                n += 1
                await asyncio.sleep(PERIOD_S)
        finally:
            self.bus.shutdown()
            self.socket.close()

    def step(self, n: int) -> None:
        fraction = 0.5 + 0.2 * math.sin(0.02 * n)
        command = round(8191 * fraction)
        frames = encode_raw_command([command, command], 10, n % 32)
        for index, share in enumerate((1.0, self.share)):
            status = EscStatus(0, 16.0, 3.0, 300.0, round(share * FULL_RPM * fraction), 50, index)
            frames += encode_esc_status(status, 20 + index, n % 32)
        for frame in frames:
            self.bus.send(can.Message(arbitration_id=frame.identifier, data=frame.data, is_extended_id=True))
        pulses = [1500] * 8
        pulses[2] = round(1500 + 400 * fraction)
        self.send(dialect.MAVLink_servo_output_raw_message(n * 20_000 + 1, 0, *pulses, *[0] * 8))
        if n % 5 == 0:
            self.move()
        if n % 10 == 0:
            self.send(dialect.MAVLink_heartbeat_message(12, 3, 0x81, self.mode, 4, 3))
        self.receive()

    def move(self) -> None:
        now_s = time.monotonic()
        self._north_m += self.speed_mps * (now_s - self._moved_s)
        self._moved_s, boot_ms = now_s, round(1000.0 * (now_s - self._start_s)) + 1
        self.send(dialect.MAVLink_attitude_message(boot_ms, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0))
        self.send(dialect.MAVLink_local_position_ned_message(boot_ms, self._north_m, 0.0, 5.0, 1.0, 0.0, 0.0))

    def send(self, message: dialect.MAVLink_message) -> None:
        self.socket.sendto(message.pack(self.mavlink), self.gateway)
        self.mavlink.seq = (self.mavlink.seq + 1) % 256

    def receive(self) -> None:
        with contextlib.suppress(BlockingIOError):
            while True:
                for message in self.mavlink.parse_buffer(self.socket.recv(2048)) or []:
                    self.take(message)

    def take(self, message: dialect.MAVLink_message) -> None:
        assert (message.get_srcSystem(), message.get_srcComponent()) == (1, 192)
        match message.get_type():
            case "STATUSTEXT":
                self.texts.append((message.severity, message.text))
            case "HEARTBEAT":
                self.states.append(message.system_status)
            case "COMMAND_LONG":
                self.commands.append((message.command, message.param1, message.param2))
                if message.command == dialect.MAV_CMD_DO_SET_MODE:
                    self.mode = int(message.param2)
                self.send(dialect.MAVLink_command_ack_message(message.command, 0))


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


async def until(condition, seconds: float = 10.0) -> None:
    async with asyncio.timeout(seconds):
        while not condition():  # noqa: ASYNC110  what is awaited is another program's doing
            await asyncio.sleep(0.02)


@contextlib.asynccontextmanager
async def vehicle(port: int) -> AsyncIterator[Vehicle]:
    simulated = Vehicle(port)
    task = asyncio.create_task(simulated.live())
    try:
        yield simulated
    finally:
        task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await task


@pytest.fixture
def port() -> int:
    return free_port()


@pytest.fixture
def live_config(tmp_path, port) -> Config:
    text = TWO_THRUSTERS.replace("udpin:127.0.0.1:0", f"udpin:127.0.0.1:{port}")
    return parse(text + '[failsafe]\nthruster_fault = "hold"\ndelay_s = 0\n[files]\nsave_every_s = 1', tmp_path)


async def test_fault_on_the_bus_arrives_as_statustext_and_failsafe(live_config, port, caplog):
    caplog.set_level(logging.INFO, "gateway")
    stop, outcomes, clock = asyncio.Event(), [], Clock()
    async with vehicle(port) as simulated:
        running = asyncio.create_task(
            run(live_config, clock=clock, observer=outcomes.append, stop=stop, factories=STAND_INS)
        )
        judged = lambda: sum(isinstance(outcome, ThrusterJudgement) for outcome in outcomes)  # noqa: E731
        await until(lambda: judged() > 200)
        assert simulated.texts == [(6, "Watching 2 thrusters")]
        simulated.texts.clear()
        simulated.share, start_s = 0.7, clock.now()
        await until(lambda: simulated.texts)
        assert clock.now() - start_s < 1.0
        await until(lambda: 5 in simulated.states and len(simulated.texts) >= 2 and simulated.mode == 2)
        await until(lambda: any(text.startswith("Hold done") for _, text in simulated.texts))
        stop.set()
        summary = await running
    assert simulated.texts[0][0] == 2 and simulated.texts[0][1].startswith("T2 entangled? ")
    assert (2, "Hold done for T2") in simulated.texts
    assert (176, 1.0, 2.0) in simulated.commands
    assert {command for command, *_ in simulated.commands} == {511, 176}
    assert simulated.states[0] in (1, 4) and simulated.states[-1] == 5
    assert summary.levels["thruster 2"].name == "FAULT" and summary.findings["FAULT"] == 1
    assert summary.frames["can0"] > 500 and summary.frames["mavlink"] > 50
    lines = [json.loads(line) for line in live_config.files.findings.read_text().splitlines()]
    (fault,) = [line for line in lines if line["level"] == "FAULT"]
    assert (fault["subject"], fault["text"], fault["severity"]) == ("thruster 2", simulated.texts[0][1], "CRITICAL")
    assert sorted(state.load(live_config.files.state).learnt) == ["thruster 1", "thruster 2"]
    assert any("autopilot ArduSub, system 1" in record.message for record in caplog.records)
    messages = [record.message for record in caplog.records]
    assert any(message.startswith("FAULT: T2 entangled?") for message in messages)
    assert "Hold done for T2" in messages
    assert {line["detector"] for line in lines if line["text"] == "Hold done for T2"} == {"failsafe"}


async def test_slow_vehicle_is_told_and_its_normal_speed_kept(live_config, port, caplog):
    caplog.set_level(logging.INFO, "gateway")
    parts = parse(TWO_THRUSTERS + SPEED_WATCH.replace("[speed]", '[speed]\nposition = "local"'), Path("/nowhere"))
    watching = replace(live_config, speed=parts.speed, detector=parts.detector)
    stop, outcomes = asyncio.Event(), []
    async with vehicle(port) as simulated:
        factories = Factories(ThresholdDetector, GroundSpeedDetector)
        running = asyncio.create_task(run(watching, observer=outcomes.append, stop=stop, factories=factories))
        await until(lambda: sum(isinstance(outcome, SpeedJudgement) for outcome in outcomes) > 5)
        simulated.speed_mps = 0.1
        await until(lambda: any(text.startswith("Speed 0.1") for _, text in simulated.texts))
        stop.set()
        summary = await running
    assert summary.levels["vehicle"].name == "FAULT"
    assert "vehicle: positions from LOCAL_POSITION_NED" in summary.lines()
    assert sorted(state.load(live_config.files.state).learnt) == ["thruster 1", "thruster 2", "vehicle"]
    assert any("thrusters 1, 2 and speed over can0" in record.message for record in caplog.records)


async def test_next_run_knows_what_the_last_one_learnt(live_config, port):
    async def one_run(samples: int) -> list[ThrusterJudgement]:
        stop, judgements = asyncio.Event(), []
        observe = lambda outcome: judgements.append(outcome) if isinstance(outcome, ThrusterJudgement) else None  # noqa: E731
        async with vehicle(port):
            running = asyncio.create_task(run(live_config, observer=observe, stop=stop, factories=STAND_INS))
            await until(lambda: len(judgements) > samples)
            stop.set()
            await running
        return judgements

    first = await one_run(150)
    second = await one_run(20)
    assert first[0].verdict.level.name == "UNKNOWN"
    assert {judgement.verdict.level.name for judgement in second} == {"NORMAL"}


async def test_corrupt_state_is_set_aside_and_not_fatal(live_config, caplog):
    live_config.files.state.write_bytes(b"garbage")
    stop = asyncio.Event()
    stop.set()
    summary = await run(live_config, stop=stop, factories=STAND_INS)
    assert summary.duration_s < 5.0
    assert (live_config.files.state.parent / "vehicle.state.aside").read_bytes() == b"garbage"
    assert any("kept as vehicle.state.aside" in record.message for record in caplog.records)
    assert sorted(state.load(live_config.files.state).learnt) == ["thruster 1", "thruster 2"]


async def test_state_that_cannot_be_saved_is_told_once_and_not_fatal(live_config, tmp_path, caplog):
    elsewhere = replace(live_config, files=live_config.files.model_copy(update={"state": tmp_path / "no" / "state"}))
    stop = asyncio.Event()
    stop.set()
    await run(elsewhere, stop=stop, factories=STAND_INS)
    assert sum("cannot be saved" in record.message for record in caplog.records) == 1


async def test_full_disk_does_not_end_the_watch(live_config, port, caplog):
    full = replace(live_config, files=live_config.files.model_copy(update={"findings": Path("/dev/full")}))
    stop, found = asyncio.Event(), []
    observe = lambda outcome: found.append(outcome) if isinstance(outcome, Finding) else None  # noqa: E731
    async with vehicle(port):
        running = asyncio.create_task(run(full, observer=observe, stop=stop, factories=STAND_INS))
        await until(lambda: len(found) >= 2)
        stop.set()
        summary = await running
    assert summary.drops["pipeline"]["finding not written"] >= 2
    assert sum("cannot be written" in record.message for record in caplog.records) == 1


async def test_operator_accepts(live_config, port):
    stop, accept, outcomes = asyncio.Event(), asyncio.Event(), []
    async with vehicle(port) as simulated:
        running = asyncio.create_task(
            run(live_config, observer=outcomes.append, stop=stop, accept=accept, factories=STAND_INS)
        )
        await until(lambda: len(outcomes) > 200)
        simulated.share = 0.7
        await until(lambda: any(text.startswith("T2 entangled") for _, text in simulated.texts))
        accept.set()
        await until(lambda: (5, "T2 fault cleared: operator accepted") in simulated.texts)
        stop.set()
        await running


async def test_summary_names_what_was_dropped(live_config, port):
    stop = asyncio.Event()
    async with vehicle(port) as simulated:
        running = asyncio.create_task(run(live_config, stop=stop, factories=STAND_INS))
        await until(lambda: len(simulated.states) > 1)
        garbage = can.Message(arbitration_id=0x10040A16, data=bytes([1, 2, 3, 0xE0]), is_extended_id=True)
        simulated.bus.send(garbage)
        await asyncio.sleep(0.1)
        stop.set()
        summary = await running
    assert sum(summary.drops["can0"].values()) >= 1
    assert any(line.startswith("dropped at can0: ") for line in summary.lines())


async def test_no_task_is_left_behind(live_config):
    before = asyncio.all_tasks()
    stop = asyncio.Event()
    running = asyncio.create_task(run(live_config, stop=stop, factories=STAND_INS))
    await asyncio.sleep(0.3)
    names = {task.get_name() for task in asyncio.all_tasks() - before - {running}}
    assert {"link can0", "link mavlink", "pipeline", "ticker", "state saver", "operator"} <= names
    stop.set()
    await running
    assert asyncio.all_tasks() == before


async def test_blas_has_one_thread_while_it_runs_and_its_own_number_after(live_config):
    def threads() -> list[int]:
        return [library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"]

    before, stop = threads(), asyncio.Event()
    with threadpool_limits(limits=2, user_api="blas"):
        running = asyncio.create_task(run(live_config, stop=stop, factories=STAND_INS))
        await asyncio.sleep(0.1)
        assert set(threads()) == {1}
        stop.set()
        await running
        assert set(threads()) == {2}
    assert threads() == before
