"""What systemd hears, over real sockets; and what it thinks of the unit."""

import logging
import os
import shutil
import socket
import subprocess
import uuid
from pathlib import Path

import pytest

import gateway
from gateway.systemd import Service

UNIT = Path(gateway.__file__).parent / "examples" / "thruster-gateway.service"


class Systemd:
    """The other end of NOTIFY_SOCKET."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind("\0" + name[1:] if name.startswith("@") else name)
        self.socket.setblocking(False)

    def heard(self) -> list[str]:
        said = []
        while True:
            try:
                said.append(self.socket.recv(4096).decode())
            except BlockingIOError:
                return said


@pytest.fixture(params=["path", "abstract"])
def systemd(request, tmp_path):
    end = Systemd(str(tmp_path / "notify") if request.param == "path" else f"@gateway test {uuid.uuid4()}")
    yield end
    end.socket.close()


def test_a_life_as_systemd_hears_it(systemd):
    service = Service({"NOTIFY_SOCKET": systemd.name, "WATCHDOG_USEC": "2000000"})
    service.ready()
    assert systemd.heard() == ["READY=1"]
    for tenth in range(31):
        service.alive(100.0 + tenth / 10.0)
    assert systemd.heard() == ["WATCHDOG=1"] * 4  # at 0, 1, 2 and 3 s
    service.status("all NORMAL", 100.0)
    service.status("thruster 3 FAULT", 100.5)  # too soon
    service.status("all NORMAL", 102.0)  # nothing new
    service.status("thruster 3 FAULT", 102.1)
    assert systemd.heard() == ["STATUS=all NORMAL", "STATUS=thruster 3 FAULT"]
    service.stopping()
    assert systemd.heard() == ["STOPPING=1"]


def test_without_systemd_nothing_is_said(caplog):
    service = Service({})
    service.ready()
    service.alive(1.0)
    service.status("all NORMAL", 1.0)
    service.stopping()
    assert caplog.messages == []


@pytest.mark.parametrize(
    "environment",
    [{}, {"WATCHDOG_USEC": "0"}, {"WATCHDOG_USEC": "2000000", "WATCHDOG_PID": "1"}],
)
def test_a_watchdog_that_is_not_ours_is_not_served(systemd, environment):
    Service({"NOTIFY_SOCKET": systemd.name} | environment, process_id=77).alive(1.0)
    assert systemd.heard() == []


def test_a_watchdog_that_is_meant_for_us_is_served(systemd):
    environment = {"NOTIFY_SOCKET": systemd.name, "WATCHDOG_USEC": "2000000", "WATCHDOG_PID": str(os.getpid())}
    Service(environment).alive(1.0)
    assert systemd.heard() == ["WATCHDOG=1"]


@pytest.mark.parametrize(
    ("environment", "said"),
    [
        ({"NOTIFY_SOCKET": "vsock:2:1234"}, "want a path or @name"),
        ({"NOTIFY_SOCKET": "/no/such/socket"}, "systemd cannot be told READY=1"),
        ({"WATCHDOG_USEC": "soon"}, "is no number"),
    ],
)
def test_what_is_wrong_is_said_once_and_ends_nothing(environment, said, caplog):
    service = Service(environment)
    service.ready()
    service.ready()
    service.alive(1.0)
    assert [record.levelno for record in caplog.records] == [logging.WARNING]
    assert said in caplog.text


def test_a_systemd_that_does_not_read_holds_nobody_up(systemd):
    service = Service({"NOTIFY_SOCKET": systemd.name})
    for turn in range(10_000):
        service.status(f"turn {turn}", 2.0 * turn)
    assert 0 < len(systemd.heard()) < 10_000


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="no systemd here")
def test_systemd_understands_the_unit(tmp_path):
    unit = tmp_path / UNIT.name
    unit.write_text(UNIT.read_text().replace("/usr/local/bin/gateway", shutil.which("true")))
    command = ["systemd-analyze", "verify", "--man=no", "--recursive-errors=no", str(unit)]
    result = subprocess.run(command, check=False, capture_output=True, text=True, timeout=60)
    assert (result.returncode, result.stdout + result.stderr) == (0, "")
