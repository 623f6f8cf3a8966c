"""A scenario in the middle of real hardware: its faults are laid over what really passes there."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import AsyncIterator
from contextlib import ExitStack, asynccontextmanager
from functools import partial
from typing import Self

from drivers.can.port import port_errors
from drivers.can.socketcan import SocketCanPort, open_socket
from drivers.clock import Clock
from gateway.config import Config
from hil_tests.bridge.armed_watch import ArmedWatch
from hil_tests.bridge.mavlink_bridge import MavlinkBridge
from hil_tests.bridge.process import BridgeProcess
from hil_tests.playback.fitting import BUS
from hil_tests.playback.recorder import Recorder
from hil_tests.playback.tapped_wire import TappedWire
from hil_tests.playback.way import Way
from hil_tests.scenario.document import Scenario
from hil_tests.wires.can_signals import CanSignals
from hil_tests.wires.can_wire import CanWire
from hil_tests.wires.mavlink_wire import MavlinkWire


class Bridges:
    """The bridges of a play, with its faults in them; a context manager.

    Args:
        scenario: whose faults they are.
        config: of the gateway: it says where signals are.
        way: says what is bridged.
        endpoint: at which the gateway is.
        start_s: when the scenario begins, unix.
        key: by which all sign; None: nobody does.
        clock: of the play.
        recorder: of what comes out of the link's ends.

    Attributes:
        tap: of the link.
    """

    def __init__(
        self,
        scenario: Scenario,
        config: Config,
        way: Way,
        endpoint: str,
        start_s: float,
        key: bytes | None,
        clock: Clock,
        recorder: Recorder,
    ) -> None:
        faults, seed = scenario.faults, scenario.seed
        self.tap = TappedWire(MavlinkWire(faults, start_s, seed, key, config), recorder, key)
        self._granted, self._watch = way.granted, ArmedWatch(start_s)
        self._can = self._link = None
        if way.bridge is not None:
            make = partial(CanWire, BUS, CanSignals.of(config, BUS), faults, start_s, seed)
            self._can = BridgeProcess.between(*way.bridge, make)
        if way.autopilot is not None:
            self._link = MavlinkBridge(way.autopilot, endpoint, self.tap, clock, hear=self._watch.feed)
        self._running = ExitStack()

    def __enter__(self) -> Self:
        """Starts.

        Raises:
            CanPortError, OSError: a bus or an endpoint does not open.
        """
        with ExitStack() as started:
            if self._can is not None:
                started.enter_context(self._can)
            if self._link is not None:
                started.enter_context(self._link)
            self._running = started.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        """Stops; nothing passes any more."""
        self._running.close()

    def trouble(self, time_s: float) -> str:
        """Why the play must end now; "": it may go on."""
        failure = self._can.report().failure if self._can is not None else ""
        if failure:
            return f"the CAN bridge has failed: {failure}"
        if self._link is None:
            return ""
        if not self._link.running:
            return "the MAVLink bridge has failed"
        return self._watch.stop_reason(time_s, self._granted)

    def counts(self) -> dict[str, dict[str, int]]:
        """What faults have done, by wire."""
        can = dict(self._can.report().figures.changed) if self._can is not None else {}
        return {"CAN": can, "MAVLink": dict(self.tap.counts)}

    def lines(self) -> list[str]:
        """What has passed, and how long it took."""
        bridges = [self._can.report().figures] if self._can is not None else []
        bridges += [self._link.figures()] if self._link is not None else []
        return [line for figures in bridges for line in figures.lines()]


@asynccontextmanager
async def recorded_bus(channel: str, clock: Clock, recorder: Recorder) -> AsyncIterator[None]:
    """Writes down what is on a bus of SocketCAN meanwhile.

    Raises:
        CanPortError: it does not open.
    """
    with port_errors():
        port = SocketCanPort(open_socket(channel, ()), clock, Counter())

    async def record() -> None:
        while True:
            recorder.frames(BUS, (await port.receive()).frames())

    recording = asyncio.create_task(record(), name=f"recording of {channel}")
    try:
        yield
    finally:
        recording.cancel()
        await asyncio.wait([recording])
        port.close()
