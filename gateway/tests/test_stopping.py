"""A stop within two seconds, whatever hangs: real processes, stopped by SIGTERM."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing, suppress
from dataclasses import dataclass
from pathlib import Path

import pytest

from gateway import state
from gateway.process_signals import heard_signals
from gateway.tests.conftest import TWO_THRUSTERS
from gateway.tests.stubborn import PREPARED

CAN_ONLY = TWO_THRUSTERS.replace('link = "mavlink", servo_channel = 3', 'link = "can0", esc_index = 1')
WITHIN_S = 2.0
# (what hangs, the endpoint, the exit code: 1 where it did not end in order)
ENDPOINTS = {"resolver": "tcp:vehicle.invalid:5760", "connection": "tcp:127.0.0.1:{port}"}
ENDED_HARD = {"worker", "resolver"}
NEVER_READY = {*ENDED_HARD, "adapter that opens", "connection"}
# without threads of BLAS, a process can be forked
ONE_THREAD = {"OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
WITHOUT_STATE = {"worker"}


@dataclass(slots=True)
class Ended:
    """How a process ended."""

    code: int
    after_s: float
    log: str
    folder: Path


class Systemd:
    """The other end of NOTIFY_SOCKET."""

    def __init__(self, folder: Path) -> None:
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)
        self.socket.bind(str(folder / "notify"))
        self.socket.settimeout(30.0)
        self.heard: list[str] = []

    def until(self, text: str) -> None:
        said = ""
        while said != text:
            said = self.socket.recv(4096).decode()
            self.heard.append(said)

    def rest(self) -> list[str]:
        self.socket.setblocking(False)
        with suppress(BlockingIOError):
            self.until("nothing more")
        return self.heard


class Nursery:
    """All processes; they run at the same time."""

    def __init__(self, folders: dict[str, Path]) -> None:
        self.folders = folders
        self.systemd = {what: Systemd(folder) for what, folder in folders.items()}
        command = [sys.executable, "-m", "gateway.tests.stubborn", *(f"{w}={f}" for w, f in folders.items())]
        self._nurse = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=os.environ | ONE_THREAD)
        self._ids = dict(self._said() for _ in folders)
        self._stopped_s: dict[str, float] = {}

    def stop(self, what: str) -> None:
        """Stops it when it is ready, or, where it never will be, in the midst of what hangs."""
        if what in NEVER_READY:
            until(lambda: "watching" in (self.folders[what] / "log").read_text())
            time.sleep(0.5)
        else:
            self.systemd[what].until("READY=1")
        if what == "nothing":
            for _ in range(3):
                self.systemd[what].until("WATCHDOG=1")
        self._stopped_s[what] = time.monotonic()
        os.kill(int(self._ids[what]), signal.SIGTERM)

    def ended(self) -> dict[str, Ended]:
        ends = {}
        for _ in self.folders:
            what, how = self._said()
            code, at_s = how.split("=")
            folder = self.folders[what]
            after_s = float(at_s) - self._stopped_s[what]
            ends[what] = Ended(int(code), after_s, (folder / "log").read_text(), folder)
            self.systemd[what].rest()
        self._nurse.communicate(timeout=5.0)
        return ends

    def close(self) -> None:
        self._nurse.kill()
        self._nurse.communicate()
        for one in self.systemd.values():
            one.socket.close()

    def _said(self) -> tuple[str, str]:
        what, _, rest = self._nurse.stdout.readline().strip().partition("=")
        return what, rest


def until(condition, seconds: float = 30.0) -> None:
    end_s = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end_s
        time.sleep(0.02)


@pytest.fixture(scope="module")
def full_port() -> Iterator[int]:
    """A port whose server accepts nobody: a connection to it stays under way."""
    with ExitStack() as stack:
        server = stack.enter_context(closing(socket.create_server(("127.0.0.1", 0), backlog=0)))
        port = server.getsockname()[1]
        for _ in range(4):
            caller = stack.enter_context(closing(socket.socket()))
            caller.setblocking(False)
            caller.connect_ex(("127.0.0.1", port))
        yield port


@pytest.fixture(scope="module")
def nursery(tmp_path_factory, full_port) -> Iterator[Nursery]:
    folders = {what: tmp_path_factory.mktemp("stop") for what in PREPARED}
    for what, folder in folders.items():
        endpoint = ENDPOINTS.get(what, "udpin:127.0.0.1:0").format(port=full_port)
        (folder / "gateway.toml").write_text(CAN_ONLY.replace("udpin:127.0.0.1:0", endpoint))
    with closing(Nursery(folders)) as nursery:
        yield nursery


@pytest.fixture(scope="module")
def ended(nursery) -> dict[str, Ended]:
    for what in PREPARED:
        nursery.stop(what)
    return nursery.ended()


@pytest.mark.parametrize("what", PREPARED)
def test_it_stops_within_two_seconds(ended, what):
    end = ended[what]
    print(f"{what}: {end.after_s:.2f} s")
    assert end.after_s < WITHIN_S, end.log
    assert end.code == (1 if what in ENDED_HARD else 0), end.log
    assert "Traceback" not in end.log
    assert not (end.folder / "gateway.sock").exists()
    if what not in WITHOUT_STATE:
        assert sorted(state.load(end.folder / "vehicle.state").learnt) == ["thruster 1", "thruster 2"]


def test_what_holds_it_up_is_said(ended):
    for what in ENDED_HARD:
        assert "stopping took 1.8 s and is cut short" in ended[what].log
    assert "dropped at pipeline" in ended["flood"].log and "no time at the end" in ended["flood"].log
    assert "dropped at pipeline" not in ended["nothing"].log


def test_systemd_hears_a_watchdog_only_while_judging_turns(ended, nursery):
    lived = nursery.systemd["nothing"].heard
    assert lived.count("READY=1") == 1 and lived.count("WATCHDOG=1") >= 3 and "STOPPING=1" in lived
    assert any(line.startswith("STATUS=") for line in lived)
    assert nursery.systemd["worker"].heard == ["STOPPING=1"]


# The thread that hears the signals


def test_signals_are_heard_while_the_main_thread_is_busy():
    heard, stopped = [], threading.Event()
    with heard_signals(stopped.set, lambda: heard.append("accept"), end=lambda: heard.append("end")):
        for number in (signal.SIGUSR1, signal.SIGUSR1, signal.SIGTERM, signal.SIGINT):
            signal.raise_signal(number)
            time.sleep(0.02)
    assert stopped.is_set() and heard == ["accept", "accept"]


def test_the_limit_of_a_stop_outlasts_the_hearing(monkeypatch, caplog):
    monkeypatch.setattr("gateway.process_signals.WORDS_S", 0.05)
    monkeypatch.setattr("gateway.process_signals.STOP_S", 0.1)
    ended = threading.Event()
    with heard_signals(lambda: None, lambda: None, end=ended.set):
        signal.raise_signal(signal.SIGTERM)
    assert ended.wait(5.0)
    assert "is cut short" in caplog.text


def test_handlers_are_given_back():
    before = [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGUSR1)]
    with heard_signals(lambda: None, lambda: None):
        assert signal.getsignal(signal.SIGTERM) not in before
    assert [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGUSR1)] == before
    assert signal.set_wakeup_fd(-1) == -1
