"""The real gateway with its sockets, tasks and clock, in this process, and a vehicle beside it in the same loop."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass, field

import can

from drivers.clock import Clock
from gateway.config import Config
from gateway.pipeline import Outcome
from gateway.run import run
from gateway.summary import Summary
from hil_tests.rig.autopilot import AutopilotPeer
from hil_tests.rig.commander import Commander
from hil_tests.rig.commands import Command
from hil_tests.rig.conduct import Conduct
from hil_tests.rig.notes import Notes, ReceivedCommand
from hil_tests.tests.scene import STAND_INS, Scene

HOST = "127.0.0.1"
PERIOD_S = 0.02
LEARNT = 300  # samples of all thrusters; their detectors' stand-ins learn for 50 each
WAIT_S = 40.0  # on a machine that has much else to do


class LiveVehicle:
    """Thrusters on a virtual CAN bus, and an autopilot over UDP.

    Args:
        port: to which the autopilot sends.
        channel: of the virtual bus.
        commander: of the autopilot.
        clock: of everything.
        key: of the autopilot's signatures.
        conduct: of the autopilot.
    """

    def __init__(
        self,
        port: int,
        channel: str,
        commander: Commander,
        clock: Clock,
        key: bytes | None = None,
        conduct: Conduct | None = None,
    ) -> None:
        self.scene, self.commander = Scene(), commander
        self.peer = AutopilotPeer((HOST, port), commander, conduct=conduct, key=key)
        self._bus = can.Bus(channel, interface="virtual")
        self._clock, self._start_s, self._n = clock, clock.now(), 0

    @property
    def notes(self) -> Notes:
        """What the autopilot has received."""
        return self.peer.notes

    @property
    def asked(self) -> list[ReceivedCommand]:
        """Commands that act on the vehicle."""
        return [one for one in self.notes.commands if one.command in set(Command)]

    def said(self, words: str) -> bool:
        """Whether a text with these words has arrived at the autopilot."""
        return any(words in text.text for text in self.notes.texts)

    async def live(self) -> None:
        """One step each 20 ms, until it is cancelled."""
        try:
            while True:
                self._step()
                await asyncio.sleep(PERIOD_S)
        finally:
            self._bus.shutdown()
            self.peer.close()

    def _step(self) -> None:
        time_s = self._clock.now()
        for frame in self.scene.frames(self._n):
            self._bus.send(can.Message(arbitration_id=frame.identifier, data=frame.data, is_extended_id=True))
        self.scene.step(PERIOD_S, self.commander)
        self.peer.exchange(time_s, self.scene.telemetry(time_s - self._start_s + 1.0))
        self._n += 1


@dataclass(slots=True)
class LiveRig:
    """A running gateway and its vehicle.

    Attributes:
        vehicle: watched.
        gateway: the task that it runs in.
        clock: of both.
        outcomes: of the gateway, so far.
        summary: of the gateway, once it has stopped.
    """

    vehicle: LiveVehicle
    gateway: asyncio.Task[Summary]
    clock: Clock
    outcomes: list[Outcome] = field(default_factory=list)
    summary: Summary | None = None

    async def until(self, condition: Callable[[], bool], seconds: float = WAIT_S) -> None:
        """Wait for what others do.

        Raises:
            TimeoutError: it did not come about.
            Exception: what the gateway has ended with.
        """
        async with asyncio.timeout(seconds):
            while not condition():
                await asyncio.sleep(0.01)
                if self.gateway.done():
                    self.gateway.result()

    async def learnt(self) -> None:
        """Wait until the gateway has heard of the vehicle, and knows what is normal."""
        await self.until(lambda: self.vehicle.said("Watching") and self.judged() > LEARNT)

    def judged(self) -> int:
        """How many samples it has judged so far."""
        return sum(type(outcome).__name__ == "ThrusterJudgement" for outcome in self.outcomes)


@contextlib.asynccontextmanager
async def live(
    config: Config,
    commander: Commander,
    channel: str,
    port: int,
    key: bytes | None = None,
    conduct: Conduct | None = None,
) -> AsyncIterator[LiveRig]:
    """A vehicle and its gateway, both running.

    Args:
        config: of the gateway.
        commander: of the autopilot.
        channel: of the virtual bus, as configured.
        port: to which the autopilot sends: the gateway's own, or that of what is in between.
        key: of the autopilot's signatures.
        conduct: of the autopilot.
    """
    clock, stop, outcomes = Clock(), asyncio.Event(), list[Outcome]()
    vehicle = LiveVehicle(port, channel, commander, clock, key, conduct)
    living = asyncio.create_task(vehicle.live(), name="vehicle")
    gateway = asyncio.create_task(
        run(config, clock=clock, observer=outcomes.append, stop=stop, factories=STAND_INS), name="gateway"
    )
    rig = LiveRig(vehicle, gateway, clock, outcomes)
    try:
        yield rig
    finally:
        stop.set()
        living.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await living
        rig.summary = await gateway
