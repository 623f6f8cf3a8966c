"""`gateway demo` from end to end, as a user starts it: a process of its own, real time, the real gateway."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
import tomllib
from pathlib import Path

import pytest

SECONDS = 40.0


def start(folder, *options) -> subprocess.Popen[str]:
    program = [Path(sys.executable).with_name("gateway"), "demo", "--out", folder, "--plain", *options]
    return subprocess.Popen(program, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


@pytest.mark.timeout(SECONDS + 60.0)
def test_weeds_are_found_and_told(tmp_path):
    with start(tmp_path, "--seconds", str(SECONDS)) as process:
        said, errors = process.communicate(timeout=SECONDS + 45.0)
    assert process.returncode == 0, said + errors
    assert 'STATUSTEXT "T3 ' in said
    assert "COMMAND_LONG DO_SET_MODE ALT_HOLD: answered ACCEPTED" in said
    assert "HEARTBEAT of component 192: CRITICAL" in said
    assert "passed" in said
    assert "no time for" in said
    for plot in ("demo.png", "speed.png", "navigation.png"):
        assert (tmp_path / plot).read_bytes().startswith(b"\x89PNG")
    assert tomllib.loads((tmp_path / "demo.toml").read_text())["failsafe"] == {"thruster_fault": "hold"}
    findings = [json.loads(line) for line in (tmp_path / "findings.jsonl").read_text().splitlines()]
    faults = [finding["subject"] for finding in findings if finding["level"] == "FAULT"]
    assert set(faults) == {"thruster 3"}


@pytest.mark.timeout(60)
def test_ctrl_c_ends_with_the_summary_so_far(tmp_path):
    with start(tmp_path, "--seconds", "50") as process:
        assert process.stdout.readline()  # it runs: before, while Python still imports, Ctrl-C only aborts
        time.sleep(2.0)
        process.send_signal(signal.SIGINT)
        said, errors = process.communicate(timeout=30.0)
    assert process.returncode == 1, said + errors  # no weeds yet, so none found
    assert "Traceback" not in errors
    assert "summary" in said
    assert (tmp_path / "demo.png").exists()
    assert (tmp_path / "speed.png").exists()
    assert (tmp_path / "navigation.png").exists()
