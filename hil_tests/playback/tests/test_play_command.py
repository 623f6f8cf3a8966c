"""`gateway hil play`: what it says, what it leaves behind, and how it ends."""

from __future__ import annotations

import re
import subprocess
import sys
import time

import psutil
import pytest
from click.testing import CliRunner

from gateway.cli import main

HEARD = """
tags: [brief]
vehicle: bench_rov
duration_s: 4
expect: [{finding: {subject: link can0, level: NORMAL}, after_s: 0, within_s: 3.9}]
"""
MISSED = """
vehicle: bench_rov
duration_s: 0.5
expect: [{finding: {subject: vehicle, level: FAULT}, after_s: 0, within_s: 0.4}]
"""
PROGRAM = [sys.executable, "-c", "from gateway.cli import main; main()", "hil", "play"]


def called(*arguments):
    """Exit code and all that was said."""
    result = CliRunner().invoke(main, ["hil", "play", *map(str, arguments)])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result.exit_code, result.output


@pytest.fixture
def shelf(tmp_path):
    """Two folders of scenarios, with a name in common."""
    for name, text in (("a/dive", MISSED), ("b/dive", HEARD)):
        file = tmp_path / f"{name}.yaml"
        file.parent.mkdir()
        file.write_text(text)
    return tmp_path


def test_one_that_passes_and_one_that_does_not_each_in_a_folder_of_its_own(shelf):
    out = shelf / "out"
    code, text = called(shelf / "a", shelf / "b", "--out", out, "--jobs", 1)
    assert code == 1, text
    assert f"report: {out / 'report.html'}" in text
    assert (out / "dive" / "gateway.toml").exists()
    assert "can0 ok" in (out / "dive-2" / "findings.jsonl").read_text()
    assert (out / "junit.xml").read_text().count("<failure") == 1


def test_a_tag_chooses_and_a_seed_is_another_play(shelf):
    logs = []
    for seed in (1, 2):
        code, text = called(shelf, "--tag", "brief", "--seed", seed, "--out", shelf / str(seed))
        assert code == 0, text
        assert [path.name for path in (shelf / str(seed)).iterdir() if path.is_dir()] == ["dive"]
        logs.append((shelf / str(seed) / "dive" / "can.log").read_bytes())
    assert logs[0] != logs[1]


def test_what_cannot_be_played_is_said_in_words(shelf):
    occupied = shelf / "occupied"
    occupied.touch()
    for arguments, words in (
        (["no_such_scenario"], "no_such_scenario: no file, no folder, and no scenario that ships"),
        ([shelf, "--tag", "deep"], "none of 2 scenarios has the tags deep"),
        ([shelf / "a", "--out", occupied / "out"], f"{occupied / 'out'}: Not a directory"),
        ([shelf / "a", "--can", "can0", "--bridge", "can0:can1"], "want --can or --bridge, not both"),
    ):
        code, text = called("--out", shelf / "out", *arguments)
        assert code == 2
        assert text.startswith("Error: ")
        assert words in text


def test_one_that_cannot_be_played_does_not_stop_the_others(shelf):
    (shelf / "a" / "lost.tlog").write_bytes(b"no packet of anybody's")
    (shelf / "a" / "dive.yaml").write_text("duration_s: 1\nrecording: {logs: [lost.tlog]}\n")
    code, text = called(shelf, "--out", shelf / "out", "--jobs", 1)
    assert code == 2
    assert "lost.tlog" in text
    assert "can0 ok" in (shelf / "out" / "dive-2" / "findings.jsonl").read_text()


def test_ended_it_tells_what_was_played_and_leaves_no_process(shelf):
    (shelf / "a" / "long.yaml").write_text("vehicle: bench_rov\nduration_s: 36000\n")
    (shelf / "b" / "long.yaml").write_text("vehicle: bench_rov\nduration_s: 36000\n")
    command = [*PROGRAM, shelf, "--out", shelf / "out", "--jobs", "2"]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True
    ) as playing:
        _until((shelf / "out" / "long-2" / "can.log").exists)
        children = psutil.Process(playing.pid).children(recursive=True)
        playing.terminate()
        said, errors = playing.communicate(timeout=60)
    assert playing.returncode == 2
    assert re.fullmatch(r"Error: interrupted; [0-2] of 4 scenarios had been played", errors.strip())
    assert f"report: {shelf / 'out' / 'report.html'}" in said
    assert psutil.wait_procs(children, timeout=20)[1] == []


def _until(done):
    """Waits, on a slow machine for long."""
    for _ in range(600):
        if done():
            return
        time.sleep(0.1)
    raise AssertionError("it does not come about")
