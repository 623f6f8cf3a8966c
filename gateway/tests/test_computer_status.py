"""How the machine is that we run on: this one's own numbers, and a place that is none."""

import time

import psutil
import pytest

from drivers.mavlink.encoder import MavlinkEncoder
from drivers.mavlink.tests.peer import messages_in
from gateway.computer_status import ComputerWatch


def test_this_machine_as_it_is(tmp_path):
    watch = ComputerWatch(tmp_path)
    busy_until_s = time.monotonic() + 0.1
    while time.monotonic() < busy_until_s:
        pass
    status = watch.status(time.time())
    assert len(status.cpu_percent) == psutil.cpu_count()
    assert all(0.0 <= load <= 100.0 for load in status.cpu_percent) and max(status.cpu_percent) > 0.0
    assert status.uptime_s == pytest.approx(time.time() - psutil.boot_time(), abs=5.0)
    used, total = status.memory_mib
    assert 0 < used < total == psutil.virtual_memory().total // 2**20
    assert 0 < status.storage_mib[0] < status.storage_mib[1]
    (sent,) = messages_in(MavlinkEncoder(1).encode(status))
    assert sent.get_type() == "ONBOARD_COMPUTER_STATUS" and sent.ram_total == total


def test_what_cannot_be_measured_is_left_out(tmp_path):
    assert ComputerWatch(tmp_path / "gone").status(time.time()).storage_mib is None
