"""`gateway replay` of damaged logs, of other vehicles', of real ones, onto a full disk: words, never a traceback."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import can
import pytest
from click.testing import CliRunner, Result

from drivers.can.dronecan import EscStatus, encode_esc_status
from drivers.can.frame import CanFrame
from drivers.can.frame_block import FrameBlock
from gateway.cli import main
from gateway.config_sections import Recording
from gateway.recording.entries import About
from gateway.recording.scribe import Scribe
from gateway.recording.waiting import Waiting
from gateway.tests.recorded_dives import MAVLINK, START_S, dronecan, settings, telemetry, write_candump, write_tlog
from gateway.tests.test_replay import dataflash, over_mavlink, ulog

SECONDS = 4.0
REAL = Path(__file__).parents[3] / "shared" / "data" / "ardusub_logs"
CAN_LOGS = ["dive.log", "dive.asc", "dive.blf", "dive.trc"]
OTHERS = ["dive.tlog", "dive.BIN", "dive.ulg", "dive.mcap"]
KINDS = [*CAN_LOGS, *OTHERS]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same dive as a log of each kind."""
    folder = tmp_path_factory.mktemp("dive")
    (folder / "vehicle.toml").write_text(settings("dronecan") + MAVLINK)
    (folder / "over_mavlink.toml").write_text(over_mavlink())
    write_candump(folder / "dive.log", dronecan(SECONDS))
    for name in CAN_LOGS[1:]:
        _converted(folder / "dive.log", folder / name)
    write_tlog(folder / "dive.tlog", telemetry(SECONDS))
    (folder / "dive.BIN").write_bytes(dataflash(SECONDS))
    (folder / "dive.ulg").write_bytes(ulog(SECONDS))
    _record(folder / "recordings").rename(folder / "dive.mcap")
    return folder


def _converted(source: Path, target: Path) -> None:
    with can.LogReader(source) as frames, can.Logger(target) as log:
        for frame in frames:
            frame.channel = 0
            log(frame)


def _record(folder: Path) -> Path:
    """A recording of ours, a chunk for each second."""
    about = About("5f3c", 1, START_S, "Test vehicle", "1", "", {}, b"", resumed=False)
    scribe = Scribe(Recording(folder=folder, keep_free_mb=0.0), about, lambda: START_S)
    journal = Waiting(lambda: START_S)
    for second in range(int(SECONDS)):
        frames = [one for one in dronecan(SECONDS) if second <= one.time_s - START_S < second + 1]
        journal.frames("can0", FrameBlock.of(frames))
        scribe.write(journal.take(1 << 30).items)
    scribe.close()
    return scribe.path


@pytest.fixture
def replay(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(os, "cpu_count", lambda: 1)  # no processes for detectors: they take seconds to begin
    monkeypatch.chdir(folder)

    def act(name: str, data: bytes | None = None) -> Result:
        path = tmp_path / name
        path.write_bytes((folder / name).read_bytes() if data is None else data)
        config = "over_mavlink.toml" if name.endswith((".tlog", ".BIN", ".ulg")) else "vehicle.toml"
        log = f"can0={path}" if name in CAN_LOGS else str(path)
        result = CliRunner().invoke(main, ["replay", config, log, "--out", str(tmp_path / "out"), "--no-report"])
        assert isinstance(result.exception, SystemExit | None)
        assert "Traceback" not in result.output
        return result

    return act


@pytest.mark.parametrize("name", KINDS)
def test_whole_it_is_judged(replay, name: str):
    result = replay(name)
    assert result.exit_code == 0, result.output
    assert "lost" not in result.stdout


@pytest.mark.parametrize("name", KINDS)
def test_cut_off_it_is_read_as_far_as_it_goes(replay, folder: Path, name: str):
    data = (folder / name).read_bytes()
    result = replay(name, data[: len(data) * 3 // 4 + 1])
    assert result.exit_code == 0, result.output
    assert "lost, " in result.stdout


@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize("hole", [bytes(700), bytes(range(256)) * 3], ids=["zeros", "rubbish"])
def test_a_hole_in_the_middle_is_told(replay, folder: Path, name: str, hole: bytes):
    data = bytearray((folder / name).read_bytes())
    middle = len(data) // 2
    if name == "dive.mcap":  # in its second chunk
        middle = data.index(b"zstd", data.index(b"zstd") + 4) + 100
    data[middle : middle + len(hole)] = hole
    result = replay(name, bytes(data))
    assert "lost, " in result.stdout
    assert result.exit_code in (0, 2), result.output
    assert result.exit_code == 0 or "Error: " in result.stderr


@pytest.mark.parametrize("name", KINDS)
@pytest.mark.parametrize("data", [b"", b"\x00", bytes(4096)], ids=["empty", "one byte", "zeros"])
def test_what_holds_nothing_fails_in_words(replay, name: str, data: bytes):
    result = replay(name, data)
    assert result.exit_code == 2
    assert result.stderr.startswith("Error: ")


def other_escs(seconds: float) -> list[CanFrame]:
    """Of a vehicle whose ESCs have other indexes."""
    frames = []
    for n in range(round(seconds * 50)):
        status = EscStatus(0, 16.0, 3.0, 300.0, 1200, 50, 7)
        frames += encode_esc_status(status, 27, n % 32, time_s=START_S + n / 50)
    return frames


def test_a_log_of_another_vehicle_is_told_to_be_none_of_ours(replay, tmp_path: Path):
    result = replay("dive.log", write_candump(tmp_path / "other.log", other_escs(8.0)).read_bytes())
    assert "dropped at can0: unknown ESC 400" in result.stdout
    assert "never judged: thruster 1, thruster 2" in result.stdout
    assert result.exit_code == 2
    assert "nothing in these logs is of a link" in result.stderr


def test_a_recording_of_another_vehicle_is_told(folder: Path, tmp_path: Path):
    other = tmp_path / "other.toml"
    other.write_text((folder / "vehicle.toml").read_text().replace("Test vehicle", "The other one"))
    words = ["replay", str(other), str(folder / "dive.mcap"), "--out", str(tmp_path / "out"), "--no-report"]
    assert "recorded on Test vehicle, judged as The other one" in CliRunner().invoke(main, words).stdout


def test_a_dive_of_a_second_has_a_report(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(os, "cpu_count", lambda: 1)
    log, out = write_candump(tmp_path / "short.log", dronecan(1.0)), tmp_path / "out"
    result = CliRunner().invoke(main, ["replay", str(folder / "vehicle.toml"), str(log), "--out", str(out)])
    assert result.exit_code == 0, result.output
    assert (out / "report.html").stat().st_size > 0


@pytest.mark.skipif(not REAL.exists(), reason="recordings of a real vehicle are not here")
@pytest.mark.parametrize("name", ["small.tlog", "small.BIN"])
def test_a_real_vehicle_without_speeds_of_its_thrusters_is_not_called_well(replay, name: str):
    """ArduSub alone does not know how fast its thrusters turn."""
    result = replay(name, (REAL / name).read_bytes())
    assert result.exit_code == 2
    assert "never judged: thruster 1, thruster 2" in result.stdout
    assert "nothing could be judged: see what each needs" in result.stderr


def test_a_full_disk_leaves_no_half_report(folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(os, "cpu_count", lambda: 1)
    disk = tmp_path / "disk"
    disk.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=200k", "tmpfs", str(disk)]
    made = subprocess.run(mount, capture_output=True, check=False)
    if made.returncode != 0:
        pytest.skip(f"no disk of our own: {made.stderr.decode().strip()}")
    try:
        words = ["replay", str(folder / "vehicle.toml"), str(folder / "dive.log"), "--out", str(disk)]
        result = CliRunner().invoke(main, words)
        left = {path.name for path in disk.iterdir()}
    finally:
        subprocess.run(["umount", "-l", str(disk)], check=True)
    assert result.exit_code == 2
    assert result.stderr == f"Error: {disk}: No space left on device; make room, or name another folder by --out\n"
    assert "findings.jsonl" in left
    assert "report.html" not in left
