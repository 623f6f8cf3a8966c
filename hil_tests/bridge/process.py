"""The CAN bridge in a process of its own: nothing that its owner does delays a frame.

In a thread beside other work, a frame waits for Python's lock: for 5 ms and more where the others compute.
"""

from __future__ import annotations

import gc
import os
import signal
from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from multiprocessing.connection import Connection
from typing import Self

from drivers.can.frame import CanFrame
from drivers.can.port import CanPortError
from drivers.clock import Clock
from drivers.readings import LinkState
from hil_tests.bridge.bus_end import OnState
from hil_tests.bridge.can_bridge import CanBridge, bridged
from hil_tests.bridge.figures import BridgeFigures
from hil_tests.wires.way import Wire

MakeWire = Callable[[], Wire[CanFrame]]
MakeBridge = Callable[[OnState], AbstractContextManager[CanBridge]]

# a process that starts has to import numpy, on a slow machine as well
START_S, STOP_S = 60.0, 10.0
# the lowest of the real-time priorities is above all that is not
PRIORITY = 1


@dataclass(frozen=True, slots=True)
class BridgeReport:
    """How a bridge is.

    Attributes:
        figures: so far.
        states: of its ends, those that were not told before.
        failure: why nothing passes any more, in words; "": it does.
    """

    figures: BridgeFigures
    states: tuple[LinkState, ...] = ()
    failure: str = ""


class BridgeProcess:
    """See the module's text. Where this user may, it runs before all others on its processor.

    Args:
        name: of the bridge, as "can0:can1".
        make_bridge: makes it, in the other process, and starts and stops it; something that can be pickled.
    """

    def __init__(self, name: str, make_bridge: MakeBridge) -> None:
        spawn = get_context("spawn")
        self._connection, self._there = spawn.Pipe()
        self._process = spawn.Process(target=_live, args=(make_bridge, self._there), name="CAN bridge", daemon=True)
        self._name = name
        self._last: BridgeReport | None = None

    @classmethod
    def between(cls, autopilot: str, devices: str, make_wire: MakeWire) -> Self:
        """A bridge between two interfaces of SocketCAN.

        Args:
            autopilot, devices: their names, as "can0".
            make_wire: makes the wire, in the other process; something that can be pickled, such as
                `functools.partial(CanWire, "can0", signals, faults, start_s, seed)`.
        """
        return cls(f"{autopilot}:{devices}", partial(_bridged, autopilot, devices, make_wire))

    def __enter__(self) -> Self:
        """Starts."""
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Stops."""
        self.stop()

    def start(self) -> None:
        """Comes back when frames pass.

        Raises:
            CanPortError: an interface does not open, another bridge has it, or the bridge cannot be made; the text
                says why.
        """
        self._process.start()
        self._there.close()
        try:
            if not self._connection.poll(START_S):
                raise EOFError
            refusal = self._connection.recv()
        except (EOFError, OSError):
            refusal = f"the bridge {self._name} did not start"
        if refusal:
            self.stop()
            raise CanPortError(refusal)

    def report(self) -> BridgeReport:
        """How it is; after the stop, how it was at its end.

        Raises:
            CanPortError: its process has died.
        """
        if self._connection.closed:
            if self._last is None:
                raise CanPortError(f"the bridge {self._name} never ran")
            return self._last
        try:
            self._connection.send(None)
            self._last = self._connection.recv()
        except (EOFError, OSError) as error:
            raise CanPortError(f"the process of the bridge {self._name} has died") from error
        return self._last

    def stop(self) -> None:
        """End it; both buses are closed then. Another stop does nothing."""
        if self._connection.closed:
            return
        with suppress(CanPortError):
            self.report()
        self._connection.close()  # that ends it
        self._process.join(STOP_S)
        self._process.kill()
        self._process.join()


def _bridged(
    autopilot: str, devices: str, make_wire: MakeWire, on_state: OnState
) -> AbstractContextManager[CanBridge]:
    return bridged(autopilot, devices, make_wire(), Clock(), on_state)


def _live(make_bridge: MakeBridge, owner: Connection) -> None:
    """In the process: until its owner closes the connection, or dies."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # of a terminal, it comes to all; the owner stops us in order
    gc.freeze()  # what was imported stays; to look through it would take longer than a frame may
    states: list[LinkState] = []
    _hurry()
    try:
        with make_bridge(states.append) as bridge:
            owner.send("")
            _answer(bridge, states, owner)
    except (CanPortError, ValueError) as error:
        owner.send(str(error))


def _answer(bridge: CanBridge, states: list[LinkState], owner: Connection) -> None:
    failure = ""
    while True:
        try:
            owner.recv()
        except EOFError:
            return
        told = len(states)
        failure = failure or _failure(bridge)
        owner.send(BridgeReport(bridge.figures(), tuple(states[:told]), failure))
        del states[:told]


def _failure(bridge: CanBridge) -> str:
    """Why it runs no more; "": it does."""
    if bridge.running:
        return ""
    try:
        bridge.stop()
    except Exception as error:  # whatever the wire has raised
        return f"{type(error).__name__}: {error}"
    return "it was stopped"


def _hurry() -> None:
    """Threads that are started from here on are as urgent."""
    with suppress(PermissionError):
        os.sched_setscheduler(0, os.SCHED_RR, os.sched_param(PRIORITY))
