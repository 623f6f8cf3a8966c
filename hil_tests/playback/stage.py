"""Where a scenario is played: vehicle, wires, gateway and recorder, put together for each way of playing."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping, Sequence
from contextlib import AsyncExitStack, closing
from dataclasses import dataclass, replace
from functools import partial
from math import floor
from pathlib import Path

import numpy as np

from drivers.clock import Clock
from gateway.config import Config
from gateway.findings import Finding
from gateway.pipeline import Factories
from hil_tests.dive_logs.laps import Part
from hil_tests.loopback import free_port
from hil_tests.playback.attached import attached
from hil_tests.playback.bridged import Bridges, recorded_bus
from hil_tests.playback.ends import Played, VehicleBus, VehicleLink, Witness
from hil_tests.playback.fitting import BUS
from hil_tests.playback.gateway_under_test import Connections, GatewayRun, gateway_in_loop, gateway_process
from hil_tests.playback.leave import leave_for_bridge, leave_for_bus
from hil_tests.playback.memory import MemoryBus, MemoryLink
from hil_tests.playback.recorded import DiveLogs, RecordedDive
from hil_tests.playback.recorder import Recorder
from hil_tests.playback.session import STEP_S, Parts, Session
from hil_tests.playback.settings import CONFIG, FINDINGS, HOST, Meeting, config_text, in_memory, write_config
from hil_tests.playback.sockets import SocketCanBus, UdpLink
from hil_tests.playback.way import Way
from hil_tests.profiles import load_profile
from hil_tests.report.outcome import Outcome, Series
from hil_tests.rig.notes import ReceivedValue
from hil_tests.rig.world import World
from hil_tests.scenario.document import Scenario
from hil_tests.wires.can_signals import CanSignals
from hil_tests.wires.can_wire import CanWire
from hil_tests.wires.mavlink_wire import MavlinkWire

SOCKETCAN = "socketcan"
# Judging three times a second, not ten times, takes half the time; findings are the same, and the pilot reads them a
# quarter of a second later at most.
COLLECT_S = 0.3
SETTLE_S = 0.1  # until the gateway has opened its links
LEAD_S = 2.0  # in real time: a slow machine takes a while to build a vehicle
LOOK_S = 0.2  # how often bridges are looked after
LATE_S = 0.5  # a real-time play that is further behind than this says so


class PlayEndedError(Exception):
    """It could not go on; the text says why."""


@dataclass(frozen=True, slots=True)
class Opened:
    """All that is there before a vehicle comes.

    Attributes:
        clock: of the play.
        config: of the gateway.
        key: by which autopilot and gateway sign; None: they do not.
        bus: of the ESCs; None: there is none.
        link: of the autopilot.
        gateway: runs.
    """

    clock: Clock
    config: Config
    key: bytes | None
    bus: VehicleBus | None
    link: VehicleLink
    gateway: GatewayRun


class Stage:
    """One play of a scenario.

    Args:
        scenario: to play.
        path: the file that paths in it are relative to.
        folder: for all that is written; exists.
        progress: hears how far it is, in seconds since the start.
        factories: makes the gateway's detectors, where it is in this program; None: the real ones.

    Raises:
        ConfigError: the vehicle has problems.
    """

    def __init__(
        self,
        scenario: Scenario,
        path: Path,
        folder: Path,
        progress: Callable[[float], None],
        factories: Factories | None,
    ) -> None:
        self._scenario, self._path, self._folder = scenario, path, folder
        self._progress, self._factories = progress, factories
        self._profile = load_profile(scenario.vehicle, path.parent)
        self._witness: Witness | None = None
        self._counts: Mapping[str, Mapping[str, int]] = {}
        self._start_s = self._end_s = 0.0
        self._account: list[str] = []

    # The ways -------------------------------------------------------------------------------------

    async def in_memory(self, clock: Clock) -> None:
        """Vehicle and gateway in one event loop, whatever its time is."""
        bus, link = MemoryBus(), MemoryLink()
        config, key = self._configured(in_memory())
        connections = Connections(lambda _: bus.opener(), link.connect, COLLECT_S)
        async with gateway_in_loop(config, clock, connections, self._factories) as gateway:
            await asyncio.sleep(SETTLE_S)
            opened = Opened(clock, config, key, bus if config.can else None, link, gateway)
            await self._play_simulated(opened)
        self._account += gateway.lines

    async def on_bus(self, clock: Clock, channel: str, way: Way) -> None:
        """On a real bus, and UDP; around a real autopilot, where there is one."""
        gate = await leave_for_bus(self._scenario, self._profile, channel, way, clock)
        port = free_port()
        is_real = way.autopilot is not None
        config, key = self._configured(Meeting(SOCKETCAN, channel, f"udpin:{HOST}:{port}", is_real))
        async with AsyncExitStack() as stack:
            bus = stack.enter_context(closing(SocketCanBus(channel, clock, gate)))
            link = stack.enter_context(closing(UdpLink(port)))
            gateways = (
                gateway_process(self._folder / CONFIG)
                if way.program
                else gateway_in_loop(config, clock, Connections(collect_s=COLLECT_S), self._factories)
            )
            gateway = await stack.enter_async_context(gateways)
            await asyncio.sleep(SETTLE_S)
            opened = Opened(clock, config, key, bus, link, gateway)
            if way.autopilot is None:
                await self._play_simulated(opened, LEAD_S)
            else:
                around = attached(self._scenario, self._profile, clock, way.autopilot, key)
                devices = await stack.enter_async_context(around)
                await self._play(opened, devices, devices.start_s, partial(devices.trouble, granted=way.granted))
        self._account += gateway.lines
        self._account += [line for line in [gate.line() if gate else ""] if line]

    async def in_between(self, clock: Clock, way: Way) -> None:
        """Between real buses, and a real autopilot and the gateway."""
        await leave_for_bridge(self._scenario, way, clock)
        port = free_port()
        channel = way.bridge[0] if way.bridge else None
        meeting = Meeting(SOCKETCAN if channel else None, channel, f"udpin:{HOST}:{port}", real_autopilot=True)
        config, key = self._configured(meeting)
        gateway: GatewayRun | None = None
        async with AsyncExitStack() as stack:
            if way.gateway is None:
                gateway = await stack.enter_async_context(gateway_process(self._folder / CONFIG))
            recorder = stack.enter_context(Recorder(self._folder))
            if channel is not None:
                await stack.enter_async_context(recorded_bus(channel, clock, recorder))
            self._start_s = self._end_s = clock.now()
            endpoint = way.gateway or f"udpout:{HOST}:{port}"
            bridges = Bridges(self._scenario, config, way, endpoint, self._start_s, key, clock, recorder)
            self._witness = bridges.tap
            with bridges:
                await self._wait(clock, bridges, gateway)
            self._end_s = clock.now()
            self._counts = bridges.counts()
            self._account += bridges.lines()
        self._account += gateway.lines if gateway is not None else ()

    # What they share ------------------------------------------------------------------------------

    def _configured(self, meeting: Meeting) -> tuple[Config, bytes | None]:
        text, relative_to = config_text(self._scenario, self._path, self._profile)
        return write_config(self._scenario, text, self._folder, meeting, relative_to)

    async def _play_simulated(self, opened: Opened, lead_s: float = 0.0) -> None:
        """With a vehicle that is simulated, or recorded; its time begins so much later."""
        start_s = round(opened.clock.now() + lead_s, 6)
        await self._play(opened, self._cast(opened, start_s), start_s, lambda _: "")

    def _cast(self, opened: Opened, start_s: float) -> World | RecordedDive:
        recording = self._scenario.recording
        if recording is None:
            return World(self._scenario, self._profile, start_s, key=opened.key)
        dive = DiveLogs(recording.logs, self._path.parent, Part(recording.from_s, recording.to_s))
        return RecordedDive(dive, opened.config, start_s, opened.key)

    async def _play(self, opened: Opened, vehicle: Played, start_s: float, trouble: Callable[[float], str]) -> None:
        """Lets the time pass for a vehicle that is stepped, until the end, or until there is trouble with it."""
        scenario, config = self._scenario, opened.config
        name = config.can[0].name if config.can else BUS
        can_wire = CanWire(name, CanSignals.of(config, name), scenario.faults, start_s, scenario.seed)
        mavlink_wire = MavlinkWire(scenario.faults, start_s, scenario.seed, opened.key, config)
        self._witness = vehicle
        self._start_s = self._end_s = start_s
        self._counts = {"CAN": can_wire.counts, "MAVLink": mavlink_wire.counts}
        with Recorder(self._folder) as recorder:
            parts = Parts(
                vehicle=vehicle,
                is_recorded=scenario.recording is not None,
                bus=opened.bus,
                can_wire=can_wire,
                bus_name=name,
                link=opened.link,
                mavlink_wire=mavlink_wire,
                recorder=recorder,
            )
            late_s = await self._steps(opened, Session(parts), trouble)
        self._end_s = opened.clock.now()
        if late_s > LATE_S:
            self._account.append(f"the vehicle fell behind by up to {late_s:.1f} s: this machine is too slow for it")

    async def _steps(self, opened: Opened, session: Session, trouble: Callable[[float], str]) -> float:
        """Returns by how much the latest step was late."""
        clock, late_s, n = opened.clock, 0.0, 0
        while n <= round(self._scenario.duration_s / STEP_S):
            since_s = n * STEP_S
            await asyncio.sleep(max(self._start_s + since_s - clock.now(), 0.0))
            self._end_s = now_s = clock.now()
            behind_s = now_s - self._start_s - since_s
            late_s = max(late_s, behind_s)
            session.step(now_s)
            opened.gateway.check()
            self._progress(since_s)
            if reason := trouble(now_s):
                raise PlayEndedError(reason)
            # one step makes up for all that a slow machine has missed
            n += max(1, floor(behind_s / STEP_S))
        return late_s

    async def _wait(self, clock: Clock, bridges: Bridges, gateway: GatewayRun | None) -> None:
        """Until the scenario is over, or something fails."""
        while (since_s := clock.now() - self._start_s) < self._scenario.duration_s:
            self._progress(since_s)
            self._end_s = self._start_s + since_s
            await asyncio.sleep(LOOK_S)
            if gateway is not None:
                gateway.check()
            if reason := bridges.trouble(clock.now()):
                raise PlayEndedError(reason)

    # The end --------------------------------------------------------------------------------------

    def outcome(self, way: str, broken: str | None) -> Outcome:
        """What came of it."""
        witness = self._witness
        found = Outcome(
            scenario=self._scenario,
            path=self._path,
            way=way,
            start_s=self._start_s,
            end_s=self._end_s,
            wall_s=0.0,
            findings=_findings(self._folder / FINDINGS),
            gateway_lines=self._account,
            broken=broken,
            folder=self._folder,
        )
        if witness is None:
            return found
        return replace(
            found,
            texts=witness.notes.texts,
            commands=witness.notes.commands,
            modes=witness.modes,
            scores={name: _series(values) for name, values in witness.notes.values.items()},
            truth=witness.truth(),
            wire_counts={wire: dict(counts) for wire, counts in self._counts.items()},
        )


def _series(values: Sequence[ReceivedValue]) -> Series:
    return Series(np.array([one.time_s for one in values]), np.array([one.value for one in values]))


def _findings(path: Path) -> list[Finding]:
    if not path.exists():
        return []
    return [Finding.of_json_line(line) for line in path.read_text(encoding="utf-8").splitlines()]
