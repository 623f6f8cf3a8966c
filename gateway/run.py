"""The running gateway: the thin shell that owns links, tasks and the clock, around the pure pipeline.

Links decode in the event loop; all judging happens in one worker thread (`judging`).
"""

from __future__ import annotations

import asyncio
import logging
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

from threadpoolctl import threadpool_limits

from drivers.can.bus import CanLink
from drivers.can.decoder import CanDecoder
from drivers.can.frame import CanFrame
from drivers.clock import Clock
from drivers.mavlink.messages import OutgoingMessage
from drivers.readings import LinkState, Reading
from gateway.companion import Companion
from gateway.config import Config
from gateway.config_sections import MAVLINK, CanBus
from gateway.findings import Finding, FindingsFile
from gateway.judging import Judging
from gateway.memory import Memory
from gateway.pipeline import Arrival, Factories, Outcome, Pipeline
from gateway.severity import Severity
from gateway.summary import Summary
from gateway.wiring import can_decoder

log = logging.getLogger("gateway")

TICK_S = 0.1

LOG_LEVELS = {Severity.CRITICAL: logging.ERROR, Severity.ERROR: logging.ERROR, Severity.WARNING: logging.WARNING}

Observer = Callable[[Outcome], None]


async def run(
    config: Config,
    *,
    clock: Clock | None = None,
    observer: Observer | None = None,
    stop: asyncio.Event | None = None,
    accept: asyncio.Event | None = None,
    factories: Factories | None = None,
) -> Summary:
    """Watches until `stop` is set.

    Args:
        config: what to watch.
        clock: stamps what is received; None: a new one.
        observer: gets every outcome in the event loop, in order: judgements, findings, and what is sent.
        stop: ends the run in order; None: it runs until it is cancelled.
        accept: the operator says that all is well as it is; it is cleared when that is done.
        factories: makes the detectors; None: the real ones.

    Returns:
        What the run came to.

    Raises:
        OSError: the findings cannot be written where the configuration says.
    """
    # the detectors' matrices are small: BLAS threads that wait for each other on busy cores cost more than they give
    with threadpool_limits(limits=1, user_api="blas"), FindingsFile(config.files.findings) as findings:
        session = _Session(config, Pipeline(config, factories), clock or Clock(), observer, findings)
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
        self._judging = Judging(pipeline, clock, self._record_all, self._tell)
        self._buses = [_CanSource(bus, config, clock, self._take) for bus in config.can]
        self._companion = Companion(config, clock, self._take) if config.mavlink else None
        self._start_s = clock.now()
        self._counts: Counter[str] = Counter()
        self._lost: Counter[str] = Counter()

    async def run(self, stop: asyncio.Event, accept: asyncio.Event) -> Summary:
        self._memory.recall(self._pipeline)
        log.info(
            "watching %s: %s over %s",
            self._config.vehicle.name,
            self._config.watched(),
            ", ".join(_links(self._config)),
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
            tasks.append(group.create_task(self._judging.run(), name="pipeline"))
            tasks.append(group.create_task(self._tick(), name="ticker"))
            tasks.append(group.create_task(self._save(), name="state saver"))
            tasks.append(group.create_task(self._accept(accept), name="operator"))
            await stop.wait()
            log.info("stopping")
            await self._judging.close()  # while there is a link to tell the autopilot what is still found
            for task in tasks:
                task.cancel()

    def _take(self, link: str, readings: Sequence[Reading]) -> None:
        self._judging.put(Arrival(link, readings))

    def _on_state(self, state: LinkState) -> None:
        word = "up" if state.up else "down"
        log.log(logging.INFO if state.up else logging.WARNING, "%s %s%s", state.link, word, _colon(state.detail))
        self._take(state.link, [state])
        if self._companion is not None:
            self._companion.on_state(state)

    def _record_all(self, outcomes: Iterable[Outcome]) -> None:
        for outcome in outcomes:
            if isinstance(outcome, Finding):
                self._record(outcome)

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
                log.log(LOG_LEVELS.get(outcome.severity, logging.INFO), "%s", _line(outcome))
            elif isinstance(outcome, OutgoingMessage) and self._companion is not None:
                self._companion.send(outcome)
            if self._observer is not None:
                self._observer(outcome)

    async def _tick(self) -> None:
        while True:
            await asyncio.sleep(TICK_S)
            now_s = self._clock.now()
            self._judging.advance(now_s)
            if self._companion is not None:
                self._companion.advance(now_s)

    async def _save(self) -> None:
        while True:
            await asyncio.sleep(self._config.files.save_every_s)
            self._judging.put(self._store)

    def _store(self) -> list[Outcome]:
        self._memory.store(self._pipeline)
        return []

    async def _accept(self, accept: asyncio.Event) -> None:
        while True:
            await accept.wait()
            accept.clear()
            log.info("operator accepts all as it is")
            self._judging.put(self._accept_all)

    def _accept_all(self) -> list[Outcome]:
        now_s = self._clock.now()
        return [outcome for one in self._pipeline.subjects for outcome in self._pipeline.accept(one, now_s)]

    def _finish(self) -> None:
        """After a cancellation or an error too, what has arrived is judged, and what was learnt is kept."""
        self._judging.finish()
        self._store()

    def _summary(self) -> Summary:
        drops = {source.link.name: source.drops() for source in self._buses}
        frames = Counter({source.link.name: source.link.counters["frames"] for source in self._buses})
        remarks = self._pipeline.remarks()
        if self._companion is not None:
            drops["mavlink"] = self._companion.drops()
            frames["mavlink"] = self._companion.received
            remarks |= self._companion.remarks()
        drops["pipeline"] = self._pipeline.drops() + self._lost + self._judging.lost
        return Summary(
            duration_s=self._clock.now() - self._start_s,
            behind_max_s=self._judging.behind_max_s,
            frames=frames,
            drops=drops,
            findings=self._counts,
            levels=self._pipeline.levels(),
            remarks=remarks,
            unjudged=[subject for subject, newest in self._pipeline.newest.items() if newest is None],
        )


def _links(config: Config) -> Iterator[str]:
    """Each link with the place that it leads to."""
    yield from (f"{bus.name} ({bus.interface} {bus.channel})" for bus in config.can)
    if config.mavlink is not None:
        yield f"{MAVLINK} ({config.mavlink.endpoint})"


def _line(finding: Finding) -> str:
    """For the log: a note on a failsafe request says how it went, and not how well the vehicle is."""
    return finding.text if finding.detector == "failsafe" else f"{finding.level.name}: {finding.text}"


def _colon(detail: str) -> str:
    return f": {detail}" if detail else ""
