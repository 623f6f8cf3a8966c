"""The running gateway: the thin shell that owns links, tasks and the clock, around the pure pipeline.

Links decode in the event loop. All judging happens in one worker thread, one batch after the other in the order of
arrival, so that a detector that learns its model anew (tens of milliseconds) delays neither a link nor a heartbeat.
"""

from __future__ import annotations

import asyncio
import logging
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from detectors.thruster import ThrusterDetector
from detectors.verdict import Level
from drivers.can.bus import CanLink
from drivers.can.decoder import CanDecoder
from drivers.can.frame import CanFrame
from drivers.clock import Clock
from drivers.mavlink.messages import CommandLong, CompanionHeartbeat, StatusText
from drivers.readings import LinkState, Reading
from gateway.companion import Companion
from gateway.config import CanBus, Config
from gateway.findings import Finding, FindingsFile
from gateway.memory import Memory
from gateway.pipeline import DetectorFactory, Outcome, Pipeline
from gateway.severity import Severity
from gateway.wiring import can_decoder

log = logging.getLogger("gateway")

TICK_S = 0.1
# A reading is stamped when the kernel has it, and judged a little later: silence is judged after that delay
LATENESS_S = 0.1
# some seconds of a full bus; more waiting than this means that the machine is too slow
WAITING_MAX = 10_000

LOG_LEVELS = {Severity.CRITICAL: logging.ERROR, Severity.ERROR: logging.ERROR, Severity.WARNING: logging.WARNING}

Observer = Callable[[Outcome], None]


@dataclass(slots=True)
class Summary:
    """What a run came to.

    Attributes:
        duration_s: from start to stop.
        frames: received, by link (of MAVLink: readings).
        drops: what was thrown away, by link or stage, by cause.
        findings: number of findings by their level.
        levels: last level of every subject.
    """

    duration_s: float = 0.0
    frames: Counter[str] = field(default_factory=Counter)
    drops: dict[str, Counter[str]] = field(default_factory=dict)
    findings: Counter[str] = field(default_factory=Counter)
    levels: dict[str, Level] = field(default_factory=dict)

    def lines(self) -> list[str]:
        """For the log."""
        return [
            f"ran for {self.duration_s:.1f} s",
            f"received: {_listed(self.frames)}",
            *(f"dropped at {place}: {_listed(causes)}" for place, causes in self.drops.items() if causes),
            f"findings: {_listed(self.findings)}",
            f"levels: {', '.join(f'{subject} {level.name}' for subject, level in self.levels.items()) or 'none'}",
        ]


def _listed(counts: Counter[str]) -> str:
    return ", ".join(f"{name} {count}" for name, count in sorted(counts.items())) or "none"


async def run(
    config: Config,
    *,
    clock: Clock | None = None,
    observer: Observer | None = None,
    stop: asyncio.Event | None = None,
    accept: asyncio.Event | None = None,
    detector: DetectorFactory = ThrusterDetector,
) -> Summary:
    """Watches until `stop` is set.

    Args:
        config: what to watch.
        clock: stamps what is received; None: a new one.
        observer: gets every outcome in the event loop, in order: judgements, findings, and what is sent.
        stop: ends the run in order; None: it runs until it is cancelled.
        accept: the operator says that all thrusters are well as they are; it is cleared when that is done.
        detector: makes a thruster's detector from its settings and its commissioned curve, if there is one.

    Returns:
        What the run came to.

    Raises:
        OSError: the findings cannot be written where the configuration says.
    """
    with FindingsFile(config.files.findings) as findings:
        session = _Session(config, Pipeline(config, detector), clock or Clock(), observer, findings)
        return await session.run(stop or asyncio.Event(), accept or asyncio.Event())


class _CanSource:
    """A CAN bus and its decoder."""

    def __init__(
        self, bus: CanBus, config: Config, clock: Clock, take: Callable[[str, Sequence[Reading]], None]
    ) -> None:
        self.decoder: CanDecoder = can_decoder(bus, config.thruster)
        options: dict[str, Any] = {} if bus.bitrate is None else {"bitrate": bus.bitrate}
        self.link = CanLink(bus.name, bus.interface, bus.channel, self.decoder.filters(), clock, **options)
        self._take = take

    def on_frames(self, frames: list[CanFrame]) -> None:
        readings = [reading for frame in frames for reading in self.decoder.decode(frame)]
        if readings:
            self._take(self.link.name, readings)

    def drops(self) -> Counter[str]:
        trouble = {name: n for name, n in self.link.counters.items() if name not in ("frames", "connections")}
        return self.decoder.drops + Counter(trouble)


class _Session:
    """One run."""

    def __init__(
        self,
        config: Config,
        pipeline: Pipeline,
        clock: Clock,
        observer: Observer | None,
        findings: FindingsFile,
    ) -> None:
        self._config = config
        self._clock = clock
        self._observer = observer
        self._findings = findings
        self._pipeline = pipeline
        self._memory = Memory(config.files.state)
        self._waiting: asyncio.Queue[Callable[[], list[Outcome]]] = asyncio.Queue(WAITING_MAX)
        self._buses = [_CanSource(bus, config, clock, self._take) for bus in config.can]
        self._companion = Companion(config, clock, self._take) if config.mavlink else None
        self._start_s = clock.now()
        self._counts: Counter[str] = Counter()
        self._lost: Counter[str] = Counter()

    async def run(self, stop: asyncio.Event, accept: asyncio.Event) -> Summary:
        self._memory.recall(self._pipeline)
        log.info(
            "watching %s: thrusters %s over %s",
            self._config.vehicle.name,
            ", ".join(str(thruster.number) for thruster in self._config.thruster),
            ", ".join(self._config.links()),
        )
        try:
            await self._run_tasks(stop, accept)
        finally:
            self._finish()
        summary = self._summary()
        for line in summary.lines():
            log.info("%s", line)
        return summary

    async def _run_tasks(self, stop: asyncio.Event, accept: asyncio.Event) -> None:
        async with asyncio.TaskGroup() as group:
            tasks: list[asyncio.Task[Any]] = [
                group.create_task(source.link.run(source.on_frames, self._on_state), name=f"link {source.link.name}")
                for source in self._buses
            ]
            if self._companion is not None:
                tasks.append(group.create_task(self._companion.run(self._on_state), name="link mavlink"))
            tasks.append(group.create_task(self._judge(), name="pipeline"))
            tasks.append(group.create_task(self._tick(), name="ticker"))
            tasks.append(group.create_task(self._save(), name="state saver"))
            tasks.append(group.create_task(self._accept(accept), name="operator"))
            await stop.wait()
            log.info("stopping")
            for task in tasks:
                task.cancel()

    def _take(self, link: str, readings: Sequence[Reading]) -> None:
        self._enqueue(partial(self._pipeline.feed, link, readings), len(readings))

    def _on_state(self, state: LinkState) -> None:
        word = "up" if state.up else "down"
        log.log(logging.INFO if state.up else logging.WARNING, "%s %s%s", state.link, word, _colon(state.detail))
        self._take(state.link, [state])
        if self._companion is not None:
            self._companion.on_state(state)

    def _enqueue(self, work: Callable[[], list[Outcome]], readings: int = 1) -> None:
        try:
            self._waiting.put_nowait(work)
        except asyncio.QueueFull:
            self._lost["machine too slow"] += readings

    async def _judge(self) -> None:
        while True:
            batch = [await self._waiting.get()]
            while not self._waiting.empty():
                batch.append(self._waiting.get_nowait())
            self._tell(await asyncio.to_thread(self._process, batch))

    def _process(self, batch: Iterable[Callable[[], list[Outcome]]]) -> list[Outcome]:
        outcomes = [outcome for work in batch for outcome in work()]
        for outcome in outcomes:
            if isinstance(outcome, Finding):
                self._record(outcome)
        return outcomes

    def _record(self, finding: Finding) -> None:
        """A full disk must not end the watch: pilot and autopilot are told all the same."""
        try:
            self._findings.append(finding)
        except OSError as error:
            if not self._lost["finding not written"]:
                log.error("findings cannot be written to %s: %s", self._config.files.findings, error)
            self._lost["finding not written"] += 1

    def _tell(self, outcomes: Iterable[Outcome]) -> None:
        for outcome in outcomes:
            if isinstance(outcome, Finding):
                self._counts[outcome.level.name] += 1
                log.log(LOG_LEVELS.get(outcome.severity, logging.INFO), "%s: %s", outcome.subject, outcome.text)
            elif isinstance(outcome, StatusText | CommandLong | CompanionHeartbeat) and self._companion is not None:
                self._companion.send(outcome)
            if self._observer is not None:
                self._observer(outcome)

    async def _tick(self) -> None:
        while True:
            await asyncio.sleep(TICK_S)
            now_s = self._clock.now()
            self._enqueue(partial(self._pipeline.advance, now_s - LATENESS_S))
            if self._companion is not None:
                self._companion.advance(now_s)

    async def _save(self) -> None:
        while True:
            await asyncio.sleep(self._config.files.save_every_s)
            self._enqueue(self._store)

    def _store(self) -> list[Outcome]:
        self._memory.store(self._pipeline)
        return []

    async def _accept(self, accept: asyncio.Event) -> None:
        while True:
            await accept.wait()
            accept.clear()
            log.info("operator accepts all thrusters as they are")
            self._enqueue(self._accept_all)

    def _accept_all(self) -> list[Outcome]:
        now_s = self._clock.now()
        return [outcome for one in self._config.thruster for outcome in self._pipeline.accept(one.number, now_s)]

    def _finish(self) -> None:
        """What has arrived is still judged, and what was learnt is kept."""
        batch = []
        while not self._waiting.empty():
            batch.append(self._waiting.get_nowait())
        self._tell(self._process(batch))
        self._store()

    def _summary(self) -> Summary:
        drops = {source.link.name: source.drops() for source in self._buses}
        frames = Counter({source.link.name: source.link.counters["frames"] for source in self._buses})
        if self._companion is not None:
            drops["mavlink"] = self._companion.drops()
            frames["mavlink"] = self._companion.received
        drops["pipeline"] = self._pipeline.drops() + self._lost
        duration_s = self._clock.now() - self._start_s
        return Summary(duration_s, frames, drops, self._counts, self._pipeline.levels())


def _colon(detail: str) -> str:
    return f": {detail}" if detail else ""
