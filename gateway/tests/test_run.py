"""The running gateway against a CAN bus and an autopilot on the loopback."""

import asyncio
import contextlib
import json
import logging
import re
import socket
from dataclasses import replace
from pathlib import Path

import can
import pytest
from threadpoolctl import threadpool_info, threadpool_limits

from detectors.verdict import Level
from drivers.clock import Clock
from gateway import state
from gateway.channel import SpeedJudgement, ThrusterJudgement
from gateway.config import Config, parse
from gateway.findings import Finding
from gateway.pipeline import Factories
from gateway.run import run
from gateway.systemd import Service
from gateway.tests.conftest import SPEED_WATCH, TWO_THRUSTERS, GroundSpeedDetector, ThresholdDetector
from gateway.tests.live_vehicle import free_port, until, vehicle

STAND_INS = Factories(thruster=ThresholdDetector)


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
        assert simulated.bus.recv(timeout=0.0) is None  # on CAN it only listens
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


@pytest.mark.parametrize(("young_s", "level"), [(600.0, "FAULT"), (0.0, "UNKNOWN")])
async def test_levels_go_on_in_the_next_run_if_it_comes_soon(live_config, port, young_s, level):
    files = live_config.files.model_copy(update={"young_s": young_s})
    config, first, found = replace(live_config, files=files), asyncio.Event(), []
    observe = lambda outcome: found.append(outcome) if isinstance(outcome, Finding) else None  # noqa: E731
    async with vehicle(port) as simulated:
        simulated.share = 0.7
        running = asyncio.create_task(run(config, observer=observe, stop=first, factories=STAND_INS))
        await until(lambda: any(one.level.name == "FAULT" for one in found))
        first.set()
        await running
    first.set()
    summary = await run(config, stop=first, factories=STAND_INS)
    assert summary.levels.get("thruster 2", Level.UNKNOWN).name == level


async def test_a_bus_that_carries_more_than_it_should_is_told(live_config, port):
    bus = live_config.can[0].model_copy(update={"bitrate": 125_000, "load_max": 0.1})
    stop = asyncio.Event()
    async with vehicle(port) as simulated:
        running = asyncio.create_task(run(replace(live_config, can=(bus,)), stop=stop, factories=STAND_INS))
        await until(lambda: any(re.fullmatch(r"can0 load \d\d%, limit 10%", text) for _, text in simulated.texts))
        stop.set()
        summary = await running
    assert summary.levels["link can0 load"].name == "SUSPECT"


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


@pytest.mark.parametrize(("patience_s", "ready"), [(0.2, True), (60.0, False)])
async def test_a_link_that_does_not_open_delays_readiness_only_so_long(
    live_config, tmp_path, monkeypatch, patience_s, ready
):
    monkeypatch.setattr("gateway.session.READY_S", patience_s)
    with socket.create_server(("127.0.0.1", 0), backlog=0) as full, contextlib.ExitStack() as callers:
        for _ in range(4):
            caller = callers.enter_context(socket.socket())
            caller.setblocking(False)
            caller.connect_ex(full.getsockname())
        endpoint = f"tcp:127.0.0.1:{full.getsockname()[1]}"
        mavlink = live_config.mavlink.model_copy(update={"endpoint": endpoint})
        with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as systemd:
            systemd.bind(str(tmp_path / "notify"))
            systemd.setblocking(False)
            service, stop = Service({"NOTIFY_SOCKET": str(tmp_path / "notify")}), asyncio.Event()
            config = replace(live_config, mavlink=mavlink)
            running = asyncio.create_task(run(config, stop=stop, factories=STAND_INS, service=service))
            await asyncio.sleep(0.6)
            stop.set()
            await running
            heard = []
            with contextlib.suppress(BlockingIOError):
                while True:
                    heard.append(systemd.recv(100))
    assert (b"READY=1" in heard) is ready and heard[-1] == b"STOPPING=1"


async def test_no_task_is_left_behind(live_config):
    before = asyncio.all_tasks()
    stop = asyncio.Event()
    running = asyncio.create_task(run(live_config, stop=stop, factories=STAND_INS))
    await asyncio.sleep(0.3)
    names = {task.get_name() for task in asyncio.all_tasks() - before - {running}}
    links = {"link can0", "load can0", "link mavlink"}
    assert links | {"pipeline", "ticker", "state saver", "operator", "control"} <= names
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
