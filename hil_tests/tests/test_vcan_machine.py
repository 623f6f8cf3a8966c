"""The virtual machine and the way the marked tests are run in it, seen from outside."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from hil_tests.vcan.initramfs import Entry, cpio
from hil_tests.vcan.interface import has_vcan
from hil_tests.vcan.kernel import QEMU, MachineUnavailableError, guest_kernel
from hil_tests.vcan.machine import Machine

ROOT = Path(__file__).parents[2]
BOOT_TIMEOUT_S = 300.0  # 8 s on an idle desktop


@pytest.fixture(scope="module")
def kernel():
    if has_vcan():
        pytest.skip("this machine has a vcan0 of its own")
    try:
        return guest_kernel()
    except MachineUnavailableError as reason:
        pytest.skip(f"no virtual machine: {reason}")


@pytest.mark.skipif(shutil.which("busybox") is None, reason="busybox reads the archive")
def test_busybox_reads_the_archive(tmp_path):
    entries = [
        Entry("a", 0o40755),
        Entry("a/b", 0o100755, b"12345"),
        Entry("empty", 0o100644),
        Entry("c", 0o100600, b"6"),
    ]
    subprocess.run(["busybox", "cpio", "-i"], input=cpio(entries), cwd=tmp_path, check=True, capture_output=True)
    assert {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*")} == {"a", "a/b", "empty", "c"}
    assert (tmp_path / "a/b").read_bytes() == b"12345"
    assert (tmp_path / "a/b").stat().st_mode == 0o100755
    assert (tmp_path / "empty").read_bytes() == b""
    assert (tmp_path / "c").read_bytes() == b"6"


@pytest.mark.timeout(BOOT_TIMEOUT_S)
def test_a_command_runs_on_a_real_bus_and_leaves_nothing_on_the_host(kernel, tmp_path):
    here = tmp_path / "here"
    here.mkdir()
    (exchange := tmp_path / "exchange").mkdir()
    script = "cat /sys/class/net/vcan0/type; pwd; touch written-inside; echo 'two  words'; exit 3"
    with (
        (tmp_path / "output").open("wb") as output,
        Machine(kernel, ["sh", "-c", script], exchange, directory=here, stdout=output) as machine,
    ):
        status = machine.wait(BOOT_TIMEOUT_S)
    arphrd_can = 280  # linux/if_arp.h
    assert (tmp_path / "output").read_text().splitlines() == [str(arphrd_can), str(here), "two  words"]
    assert status == 3
    assert list(here.iterdir()) == []


def test_the_machine_ends_with_the_process_that_started_it(kernel):
    parent = subprocess.Popen([sys.executable, "-m", "hil_tests.vcan", "sleep", "600"], cwd=ROOT)
    try:
        emulator = _wait_for(lambda: _child(parent.pid))
        parent.send_signal(signal.SIGKILL)
        parent.wait()
        _wait_for(lambda: not _alive(emulator))
    finally:
        parent.kill()


@pytest.mark.skipif(has_vcan(), reason="this machine has a vcan0 of its own")
@pytest.mark.parametrize(("required", "outcome"), [({}, "skipped"), ({"VCAN_REQUIRED": "1"}, "error")])
def test_where_there_is_no_machine_the_bus_tests_are_not_run_and_it_is_said(required, outcome):
    environment = {name: value for name, value in os.environ.items() if name != "VCAN_REQUIRED"}
    environment |= {"PATH": "/nowhere"} | required
    tests = (
        f"{__package__.replace('.', '/')}/test_vcan_bus.py::test_simulated_escs_and_their_autopilot_are_understood"
    )
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", tests]
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert f"1 {outcome}" in done.stdout.splitlines()[-1]
    assert "BUS TESTS NOT RUN" in done.stdout
    assert "apt-get install qemu-system-x86 busybox-static" in done.stdout
    assert done.returncode == (1 if required else 0)


def _wait_for(condition, timeout_s=30.0):
    deadline_s = time.monotonic() + timeout_s
    while not (result := condition()):
        assert time.monotonic() < deadline_s, "not within the time"
        time.sleep(0.05)
    return result


def _child(pid):
    children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    is_emulator = bool(children) and Path(f"/proc/{children[0]}/exe").readlink().name == QEMU
    return int(children[0]) if is_emulator else None


def _alive(pid):
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except FileNotFoundError:
        return False
