"""A bridge in a process of its own: ours, or python-can's."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from enum import StrEnum
from multiprocessing import get_context
from multiprocessing.connection import Connection

import can

from drivers.clock import Clock
from hil_tests.bridge.bus_end import BusEnd
from hil_tests.bridge.can_bridge import CanBridge
from hil_tests.live.bridge_buses import BridgedBus

START_S, STOP_S = 60.0, 10.0
Pair = tuple[BridgedBus, BridgedBus]


class Bridge(StrEnum):
    """Whose it is."""

    OURS = "ours"
    PYTHON_CAN = "python-can"


@contextmanager
def running(bridge: Bridge, buses: Pair) -> Iterator[int]:
    """A bridge between two buses as long as it lasts; the id of its process.

    Raises:
        RuntimeError: it did not start.
    """
    spawn = get_context("spawn")
    here, there = spawn.Pipe()
    process = spawn.Process(target=_live, args=(bridge, buses, there), daemon=True)
    process.start()
    there.close()
    try:
        if not here.poll(START_S) or process.pid is None:
            raise RuntimeError(f"the bridge of {bridge} did not start within {START_S:g} s")
        here.recv()
        yield process.pid
    finally:
        here.close()  # that ends it
        process.join(STOP_S)
        process.kill()
        process.join()
        process.close()


def _live(bridge: Bridge, buses: Pair, connection: Connection) -> None:
    """In the process: from the start until the other end of the connection is closed."""
    with _ours(buses) if bridge is Bridge.OURS else _python_can(buses):
        connection.send(time.time())
        while not connection.poll(None):
            pass


def _ours(buses: Pair) -> AbstractContextManager[object]:
    # the wire knows all that the gateway can decode, and the peer's process needs not wait for that
    from hil_tests.wires.can_signals import CanSignals
    from hil_tests.wires.can_wire import CanWire

    clock = Clock()
    near, far = (BusEnd(bus.name, bus.opener(), clock, virtual=True) for bus in buses)
    return CanBridge(near, far, CanWire(buses[0].name, CanSignals(), (), clock.now()), clock)


@contextmanager
def _python_can(buses: Pair) -> Iterator[None]:
    """As its own program `can_bridge` does."""
    with ExitStack() as stack:
        near, far = (stack.enter_context(bus.python_can()) for bus in buses)
        for source, target in ((near, far), (far, near)):
            stack.enter_context(can.Notifier(source, [can.RedirectReader(target)]))
        yield
