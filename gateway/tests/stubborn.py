"""`gateway run` in processes with something in each that hangs: `python -m gateway.tests.stubborn WHAT=FOLDER ...`.

They are forked, for it takes seconds to import all that they need. A line `WHAT pid` says that one has begun, and a
line `WHAT code at` how and when (monotonic) it has ended.
"""

from __future__ import annotations

import asyncio
import os
import socket
import sys
import threading
import time
from pathlib import Path

from drivers.can import bus
from gateway.cli import main
from gateway.pipeline import Pipeline
from gateway.tests.conftest import FULL_RPM

HANG_S = 60.0


class Adapter:
    """A CAN adapter that answers only as long as it wants to."""

    def __init__(self, hang_in: str) -> None:
        self._hang_in = hang_in

    def open(self, *_: object) -> Adapter:
        self._do("open")
        return self

    async def receive(self) -> list[object]:
        await asyncio.Event().wait()
        return []

    def close(self) -> None:
        self._do("close")

    def _do(self, what: str) -> None:
        if what == self._hang_in:
            time.sleep(HANG_S)


def adapter(hang_in: str) -> None:
    """The adapter hangs while it is opened, or closed."""
    bus.port_opener = lambda *_, **__: Adapter(hang_in).open


def worker() -> None:
    """The judging hangs, as in a search that does not end."""
    take = Pipeline.take

    def hang(self: Pipeline, events: object) -> object:
        if threading.current_thread() is not threading.main_thread():
            time.sleep(HANG_S)
        return take(self, events)

    Pipeline.take = hang


def resolver() -> None:
    """No name server answers."""
    socket.getaddrinfo = lambda *_, **__: time.sleep(HANG_S)


def flood() -> None:
    """More comes in than can be judged: each event takes a tenth of a second."""
    from drivers.readings import ThrusterReport
    from gateway.judging import Judging
    from gateway.pipeline import Arrival

    take, advance = Pipeline.take, Judging.advance

    def slow(self: Pipeline, events: list[object]) -> object:
        time.sleep(0.002 * len(events))
        return take(self, events)

    def more(self: Judging, now_s: float) -> None:
        for n in range(500):
            self.put(Arrival("can0", [ThrusterReport(now_s + n * 1e-4, 1, 0.5 * FULL_RPM)]))
        advance(self, now_s)

    Pipeline.take, Judging.advance = slow, more


PREPARED = {
    "nothing": lambda: None,
    "connection": lambda: None,
    "adapter that opens": lambda: adapter("open"),
    "adapter that closes": lambda: adapter("close"),
    "worker": worker,
    "resolver": resolver,
    "flood": flood,
}


def forked(what: str, folder: Path) -> int:
    """A process that runs the gateway of a folder, and logs there."""
    process_id = os.fork()
    if process_id:
        return process_id
    os.dup2(os.open(folder / "log", os.O_WRONLY | os.O_CREAT, 0o600), 2)
    os.environ |= {"NOTIFY_SOCKET": str(folder / "notify"), "WATCHDOG_USEC": "400000"}
    PREPARED[what]()
    main(["run", str(folder / "gateway.toml")])
    raise AssertionError("it exits")


def nurse(named: list[str]) -> None:
    """Starts all of them, and says how each ends."""
    begun = {}
    for what, folder in (one.split("=") for one in named):
        begun[forked(what, Path(folder))] = what
    for process_id, what in begun.items():
        print(what, process_id, sep="=", flush=True)
    while begun:
        process_id, status = os.wait()
        what = begun.pop(process_id)
        print(what, os.waitstatus_to_exitcode(status), time.monotonic(), sep="=", flush=True)


if __name__ == "__main__":
    nurse(sys.argv[1:])
