"""One scenario, from its file to what came of it."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from drivers.clock import Clock
from gateway.config import Config
from gateway.findings import Finding
from gateway.pipeline import Factories
from hil_tests.dive_logs.laps import Part
from hil_tests.playback.ends import VehicleBus, VehicleLink
from hil_tests.playback.fitting import BUS, load_fitting
from hil_tests.playback.gateway_under_test import (
    Connections,
    GatewayFailedError,
    GatewayRun,
    gateway_in_loop,
    gateway_process,
)
from hil_tests.playback.memory import MemoryBus, MemoryLink
from hil_tests.playback.recorded import DiveLogs, RecordedDive
from hil_tests.playback.recorder import Recorder
from hil_tests.playback.session import STEP_S, Parts, Session
from hil_tests.playback.settings import CONFIG, FINDINGS, HOST, Meeting, in_memory, write_config
from hil_tests.playback.sockets import SocketCanBus, UdpLink, free_port
from hil_tests.playback.virtual_time import run_in_virtual_time
from hil_tests.profiles.loading import load_profile
from hil_tests.report.outcome import Outcome, Series
from hil_tests.rig.notes import ReceivedValue
from hil_tests.rig.world import World
from hil_tests.scenario.document import Scenario
from hil_tests.wires.can_signals import CanSignals
from hil_tests.wires.can_wire import CanWire
from hil_tests.wires.mavlink_wire import MavlinkWire

# Judging three times a second, not ten times, takes half the time; findings are the same, and the pilot reads them a
# quarter of a second later at most.
COLLECT_S = 0.3
SETTLE_S = 0.1  # until the gateway has opened its links
LATE_S = 0.5  # a real-time play that is further behind than this says so

Progress = Callable[[float], None]


@dataclass(frozen=True, slots=True)
class Way:
    """How to play.

    Attributes:
        realtime: at the pace of the clock; else as fast as this machine can.
        channel: a SocketCAN interface, in real time; None: in memory.
        program: on such a bus, the gateway is a program of its own, as on the vehicle; else it is in this one, which
            spares a slow machine to load it anew for each scenario.
    """

    realtime: bool = False
    channel: str | None = None
    program: bool = True

    def __str__(self) -> str:
        if self.channel is not None:
            return f"real time on {self.channel}"
        return "real time in memory" if self.realtime else "virtual time"


VIRTUAL = Way()


def play_file(
    path: Path,
    folder: Path,
    way: Way = VIRTUAL,
    progress: Progress = lambda _: None,
    changes: Mapping[str, Any] | None = None,
) -> Outcome:
    """Plays the scenario of a file.

    Args:
        path: of the file.
        folder: for all that is written; made if it is not there.
        way: how.
        progress: hears how far it is, in seconds since the start.
        changes: fields of the scenario that are set anew, such as its seed.

    Raises:
        ConfigError: the scenario, its vehicle or the gateway's configuration has problems.
        CanPortError: there is no such bus.
        OSError: the folder cannot be written to.
    """
    scenario = load_fitting(path)[0].model_copy(update=dict(changes or {}))
    return play(scenario, path, folder, way, progress)


def play(
    scenario: Scenario,
    path: Path,
    folder: Path,
    way: Way = VIRTUAL,
    progress: Progress = lambda _: None,
    factories: Factories | None = None,
) -> Outcome:
    """Plays a scenario.

    Args:
        scenario: to play.
        path: the file that paths in it are relative to.
        folder, way, progress: as of `play_file`.
        factories: makes the gateway's detectors, where it is in memory; None: the real ones.

    Raises:
        ConfigError, CanPortError, OSError: as `play_file`.
    """
    folder.mkdir(parents=True, exist_ok=True)
    one = _Play(scenario, path, folder, progress, factories)
    began_s, broken = time.perf_counter(), None
    try:
        if way.channel is not None:
            asyncio.run(one.on_bus(Clock(), way.channel, way.program))
        elif way.realtime:
            asyncio.run(one.in_memory(Clock()))
        else:
            run_in_virtual_time(one.in_memory)
    except GatewayFailedError as error:
        broken = str(error)
    outcome = one.outcome(str(way), broken)
    return replace(outcome, wall_s=time.perf_counter() - began_s)


class _Play:
    """One play of a scenario."""

    def __init__(
        self, scenario: Scenario, path: Path, folder: Path, progress: Progress, factories: Factories | None
    ) -> None:
        self._scenario, self._path, self._folder, self._progress = scenario, path, folder, progress
        self._factories = factories
        self._profile = load_profile(scenario.vehicle, path.parent)
        self._vehicle: World | RecordedDive | None = None
        self._can_wire: CanWire | None = None
        self._mavlink_wire: MavlinkWire | None = None
        self._start_s = self._end_s = 0.0
        self._account: list[str] = []

    async def in_memory(self, clock: Clock) -> None:
        """Vehicle and gateway in one event loop, whatever its time is."""
        bus, link = MemoryBus(), MemoryLink()
        config, key = self._configured(in_memory())
        connections = Connections(lambda _: bus.opener(), link.connect, COLLECT_S)
        async with gateway_in_loop(config, clock, connections, self._factories) as gateway:
            await asyncio.sleep(SETTLE_S)
            await self._play(clock, config, key, bus if config.can else None, link, gateway)
        self._account += gateway.lines

    async def on_bus(self, clock: Clock, channel: str, program: bool) -> None:
        """On a real bus, and UDP."""
        port = free_port()
        config, key = self._configured(Meeting("socketcan", channel, f"udpin:{HOST}:{port}"))
        with closing(SocketCanBus(channel, clock)) as bus, closing(UdpLink(port)) as link:
            gateways = (
                gateway_process(self._folder / CONFIG)
                if program
                else gateway_in_loop(config, clock, Connections(), self._factories)
            )
            async with gateways as gateway:
                await asyncio.sleep(SETTLE_S)
                await self._play(clock, config, key, bus, link, gateway)
            self._account += gateway.lines

    def _configured(self, meeting: Meeting) -> tuple[Config, bytes | None]:
        own = self._scenario.gateway.config
        if own is None:
            text, relative_to = self._profile.gateway_toml(), self._profile.folder
        else:
            file = self._path.parent / own
            text, relative_to = file.read_text(encoding="utf-8"), file.parent
        return write_config(self._scenario, text, self._folder, meeting, relative_to)

    async def _play(
        self,
        clock: Clock,
        config: Config,
        key: bytes | None,
        bus: VehicleBus | None,
        link: VehicleLink,
        gateway: GatewayRun,
    ) -> None:
        scenario, start_s = self._scenario, round(clock.now(), 6)
        bus_name = config.can[0].name if config.can else BUS
        self._start_s = start_s
        self._vehicle = self._cast(config, start_s, key)
        self._can_wire = CanWire(bus_name, CanSignals.of(config, bus_name), scenario.faults, start_s, scenario.seed)
        self._mavlink_wire = MavlinkWire(scenario.faults, start_s, scenario.seed, key, config)
        with Recorder(self._folder) as recorder:
            parts = Parts(
                vehicle=self._vehicle,
                is_recorded=scenario.recording is not None,
                bus=bus,
                can_wire=self._can_wire,
                bus_name=bus_name,
                link=link,
                mavlink_wire=self._mavlink_wire,
                recorder=recorder,
            )
            late_s = await self._steps(clock, Session(parts), gateway)
        self._end_s = clock.now()
        if late_s > LATE_S:
            self._account.append(f"the vehicle fell behind by up to {late_s:.1f} s: this machine is too slow for it")

    def _cast(self, config: Config, start_s: float, key: bytes | None) -> World | RecordedDive:
        """Who plays the vehicle."""
        recording = self._scenario.recording
        if recording is None:
            return World(self._scenario, self._profile, start_s, key=key)
        part = Part(recording.from_s, recording.to_s)
        return RecordedDive(DiveLogs(recording.logs, self._path.parent, part), config, start_s, key)

    async def _steps(self, clock: Clock, session: Session, gateway: GatewayRun) -> float:
        """Lets the time pass; returns by how much the latest step was late."""
        late_s = 0.0
        for n in range(round(self._scenario.duration_s / STEP_S)):
            due_s = self._start_s + n * STEP_S
            await asyncio.sleep(max(due_s - clock.now(), 0.0))
            now_s = clock.now()
            late_s = max(late_s, now_s - due_s)
            session.step(now_s)
            gateway.check()
            self._progress(n * STEP_S)
        return late_s

    def outcome(self, way: str, broken: str | None) -> Outcome:
        """What came of it."""
        vehicle = self._vehicle
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
        if vehicle is None or self._can_wire is None or self._mavlink_wire is None:
            return found
        return replace(
            found,
            texts=vehicle.notes.texts,
            commands=vehicle.notes.commands,
            modes=vehicle.modes,
            scores={name: _series(values) for name, values in vehicle.notes.values.items()},
            truth=vehicle.truth() if isinstance(vehicle, World) else None,
            wire_counts={"CAN": dict(self._can_wire.counts), "MAVLink": dict(self._mavlink_wire.counts)},
        )


def _series(values: Sequence[ReceivedValue]) -> Series:
    return Series(np.array([one.time_s for one in values]), np.array([one.value for one in values]))


def _findings(path: Path) -> list[Finding]:
    if not path.exists():
        return []
    return [Finding.of_json_line(line) for line in path.read_text(encoding="utf-8").splitlines()]
