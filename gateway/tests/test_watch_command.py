"""`gateway watch` as a user meets it: on a pipe, on a terminal, with a gateway that runs, ends and comes back."""

import asyncio
import contextlib
import os
import pty
import subprocess
import sys
import time
from itertools import pairwise
from math import inf
from pathlib import Path
from threading import Thread

import pytest
from click.testing import CliRunner

from detectors.verdict import Level
from gateway.cli import main
from gateway.config import load
from gateway.control.watching import Watching
from gateway.pipeline import Factories
from gateway.replay.log_input import log_input
from gateway.replay.reels import reels
from gateway.run import run
from gateway.tests.conftest import TWO_THRUSTERS, ThresholdDetector
from gateway.tests.live_vehicle import free_port, vehicle
from gateway.tests.recorded_dives import dronecan, settings, write_candump
from gateway.watch.live_source import LiveSource
from gateway.watch.plain import Changes
from gateway.watch.recorded_dive import RecordedDive

STAND_INS = Factories(thruster=ThresholdDetector)
REAL = Path(__file__).parents[3] / "shared" / "data" / "ardusub_logs"
PWM = Path(__file__).parents[1] / "examples" / "pwm_mavlink_esc.toml"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("dive")
    (folder / "bus.toml").write_text(settings("dronecan"))
    write_candump(folder / "dive.log", dronecan(4.0))
    (folder / "empty.log").write_bytes(b"")
    (folder / "picture.log").write_bytes(b"\xff\xd8\xff\xe0" + bytes(100))
    return folder


@pytest.fixture
def watch(folder, monkeypatch):
    monkeypatch.chdir(folder)

    def act(*words: str):
        return CliRunner().invoke(main, ["watch", *words])

    return act


def test_a_recorded_dive_without_a_terminal_is_lines_of_text_to_its_end(watch):
    result = watch("bus.toml", "dive.log", "--speed", "16", "--every", "0.1")
    assert result.exit_code == 0
    lines = result.stdout.splitlines()
    assert lines[0].endswith("  dive.log, 16 times real time")
    assert any("NORMAL  link can0" in line for line in lines)
    assert lines[-1] == "0:00:03  dive.log, end of the dive"


@pytest.mark.skipif(not REAL.exists(), reason="recordings of a real vehicle are not here")
def test_a_recording_of_a_real_vehicle(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = ["watch", str(PWM), str(REAL / "small.BIN"), "--plain", "--speed", "256", "--every", "1"]
    result = CliRunner().invoke(main, words)
    assert result.exit_code == 0
    assert "SUSPECT T1 esc" in result.stdout and "end of the dive" in result.stdout.splitlines()[-1]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["nowhere.toml"], "nowhere.toml"),
        (["bus.toml", "nowhere.log"], "nowhere.log: No such file"),
        (["bus.toml", "picture.log"], "picture.log is no CAN log"),
        (["bus.toml", "dive.log", "--offset", "5"], "want LOG=SECONDS, of dive.log"),
        (["bus.toml", "dive.log", "dive.log"], "begins before the log before it ends"),
    ],
)
def test_what_cannot_be_watched_is_said_in_one_line(watch, words, said):
    result = watch(*words)
    assert isinstance(result.exception, SystemExit) and result.exit_code in (0, 1)
    assert said in result.output and "Traceback" not in result.output


@pytest.mark.parametrize("words", [["--speed", "0"], ["--speed", "1e9"], ["--every", "0"]])
def test_what_is_no_speed_is_refused(watch, words):
    result = watch("bus.toml", *words)
    assert result.exit_code == 2 and "is not in the range" in result.output


def test_of_an_empty_log_it_is_said_that_there_is_nothing(watch):
    assert "end of the dive" in watch("bus.toml", "empty.log").stdout


async def test_a_gateway_that_is_waited_for_runs_finds_something_ends_and_is_back(tmp_path):
    path = tmp_path / "gateway.toml"
    text = TWO_THRUSTERS.replace("udpin:127.0.0.1:0", f"udpin:127.0.0.1:{free_port()}")
    path.write_text(text + "[recording]\nkeep_free_mb = 0\n")
    config, told = load(path), []
    changes, source = Changes(), LiveSource(Watching(config.files.control), time.time)

    async def seen(what: str) -> None:
        async with asyncio.timeout(15.0):
            while not any(what in line for line in told):
                told.extend(changes.take(await asyncio.to_thread(source.look)))
                await asyncio.sleep(0.05)

    with contextlib.closing(source):
        await seen("no gateway runs with this configuration")
        async with vehicle(int(config.mavlink.endpoint.rpartition(":")[2])) as simulated:
            async with running(config):
                await seen("NORMAL  T2")
                simulated.share = 0.7
                await seen("FAULT   T2")
                await seen("CRITICAL: T2 entangled?")
            told.clear()
            await seen("; waiting for it")
            async with running(config):
                await seen("live, started again")
    both_runs_are_seen_again(config)


def both_runs_are_seen_again(config) -> None:
    """What they have recorded: the second one begins anew."""
    files = [log_input(str(path), config.links()) for path in config.recording.folder.iterdir()]
    dive = RecordedDive(config, reels(files, config), STAND_INS)
    found, running_s = [], []
    while dive.next_s < inf:
        found += dive.step(0.5)
        running_s.append(dive.telemetry().running_s)
    assert next(one.text for one in found if one.level is Level.FAULT).startswith("T2 entangled?")
    assert sum(later < earlier for earlier, later in pairwise(running_s)) == 1
    first, *_ = dive.telemetry().links
    assert first.name == "can0" and first.up


@contextlib.asynccontextmanager
async def running(config):
    stop = asyncio.Event()
    task = asyncio.create_task(run(config, stop=stop, factories=STAND_INS))
    try:
        yield
    finally:
        stop.set()
        await task


def test_on_a_terminal_it_is_a_screen_that_q_ends(folder):
    ours, theirs = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, "-c", "from gateway.cli import main; main()", "watch", "bus.toml", "dive.log"],
        cwd=folder,
        stdin=theirs,
        stdout=theirs,
        stderr=theirs,
        env={**os.environ, "TERM": "xterm-256color", "NO_COLOR": "1", "COLUMNS": "80", "LINES": "24"},
    )
    os.close(theirs)
    read = bytearray()

    def drain() -> None:
        with contextlib.suppress(OSError):  # its end is closed with the process
            while data := os.read(ours, 65_536):
                read.extend(data)

    Thread(target=drain, daemon=True).start()
    try:
        deadline_s = time.monotonic() + 60.0
        while b"texts to the pilot" not in read and time.monotonic() < deadline_s:
            time.sleep(0.05)
        os.write(ours, b"q")
        assert process.wait(20.0) == 0
    finally:
        process.kill()
        process.wait()
        os.close(ours)
    assert b"Test vehicle" in read and b"\x1b[?1049h" in read and b"\x1b[?1049l" in read
