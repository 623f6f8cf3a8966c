"""The running gateway: the thin shell that owns links, tasks and the clock, around the pure pipeline.

Links decode in the event loop; all judging happens in one worker thread (`judging`).
"""

from __future__ import annotations

import asyncio
import logging
from collections import Counter
from collections.abc import Coroutine, Iterator, Sequence
from importlib import import_module
from typing import Any

from threadpoolctl import threadpool_limits

from drivers.clock import Clock
from drivers.mavlink.messages import CommandAck
from drivers.mavlink.transports import Connect, open_transport
from drivers.readings import LinkState, OperatorAct
from gateway.can_source import CanSource, PortOf
from gateway.companion import Companion
from gateway.config import Config
from gateway.config_sections import MAVLINK
from gateway.control.local_operator import LocalOperator
from gateway.control.protocol import STATUS, Answer, Request, Said
from gateway.control.server import ControlSocket
from gateway.control.subject_words import watched_subjects
from gateway.findings import Finding, FindingsFile
from gateway.intake import Intake
from gateway.judging import COLLECT_S, Judging
from gateway.memory import Memory
from gateway.operator import ALL, code_of
from gateway.outlet import Observer, Outlet
from gateway.pipeline import Factories, Outcome, Pipeline
from gateway.recording.journal import Journal, NoJournal
from gateway.summary import Summary, worst_first
from gateway.systemd import Service
from gateway.timeline import STILL_S

log = logging.getLogger("gateway")

TICK_S = 0.1
# what detectors load when they first need it, a second, on slow machines half a minute: no other command waits for it
LOADED_LATE = ("filterpy.kalman", "scipy.optimize", "scipy.signal")
# links that do not open for so long are told, and are no reason not to begin
READY_S = 5.0
# What a stop may take: all that came before is judged and told, and once more what was left
CLOSE_S, FINISH_S = 0.6, 0.2


async def run(
    config: Config,
    *,
    clock: Clock | None = None,
    observer: Observer | None = None,
    stop: asyncio.Event | None = None,
    accept: asyncio.Event | None = None,
    factories: Factories | None = None,
    service: Service | None = None,
    port_of: PortOf | None = None,
    connect: Connect = open_transport,
    collect_s: float = COLLECT_S,
    journal: Journal | None = None,
) -> Summary:
    """Watches until `stop` is set.

    Args:
        config: what to watch.
        clock: stamps what is received; None: a new one.
        observer: gets every outcome in the event loop, in order: judgements, findings, and what is sent.
        stop: ends the run in order; None: it runs until it is cancelled.
        accept: the operator says that all is well as it is; it is cleared when that is said on.
        factories: makes the detectors; None: the real ones.
        service: is told how the run goes; None: nobody is.
        port_of: how a CAN bus is opened; None: as it is configured.
        connect: how the autopilot's link is opened.
        collect_s: what arrives within this time is judged together; findings are the same, texts come as much later.
        journal: where all that comes in and goes out is written down; None: nowhere.

    Returns:
        What the run came to.

    Raises:
        OSError: the findings cannot be written where the configuration says, or another gateway runs with it.
    """
    for module in LOADED_LATE:
        import_module(module)
    # the detectors' matrices are small: BLAS threads that wait for each other on busy cores cost more than they give
    with threadpool_limits(limits=1, user_api="blas"), FindingsFile(config.files.findings) as findings:
        pipeline = Pipeline(config, factories)
        services = service or Service({})
        session = _Session(
            config, pipeline, clock or Clock(), observer, findings, services, port_of, connect, collect_s, journal
        )
        return await session.run(stop or asyncio.Event(), accept or asyncio.Event())


class _Session:
    """One run."""

    def __init__(
        self,
        config: Config,
        pipeline: Pipeline,
        clock: Clock,
        observer: Observer | None,
        findings: FindingsFile,
        service: Service,
        port_of: PortOf | None,
        connect: Connect,
        collect_s: float,
        journal: Journal | None,
    ) -> None:
        self._config, self._clock, self._pipeline, self._service = config, clock, pipeline, service
        self._memory = Memory(config.files.state, config.files.young_s, clock.now)
        self._journal = journal or NoJournal()
        self._intake = Intake(lambda work: self._judging.put(work, self._intake.first), self._journal)
        self._buses = [
            CanSource(bus, config, clock, self._intake, port_of and port_of(bus))
            for bus in config.can
            if not bus.forwarded
        ]
        self._companion = Companion(config, clock, self._intake, connect) if config.mavlink else None
        self._outlet = Outlet(
            findings,
            config.files.findings,
            [self._hear_answer] if observer is None else [self._hear_answer, observer],
            None if self._companion is None else self._companion.send,
            clock.now,
        )
        self._judging = Judging(pipeline, clock, self._record, self._tell, collect_s, self._journal)
        self._operator = LocalOperator(watched_subjects(config), self._intake.reading, clock.now)
        self._control = ControlSocket(config.files.control, self._answer)
        self._levels = pipeline.levels()
        self._unopened = set(config.links())
        self._ready = self._finished = False
        self._start_s = clock.now()

    async def run(self, stop: asyncio.Event, accept: asyncio.Event) -> Summary:
        self._control.open()
        try:
            self._memory.recall(self._pipeline)
            watched, links = self._config.watched(), ", ".join(_links(self._config))
            log.info("watching %s: %s over %s", self._config.vehicle.name, watched, links)
            await self._run_tasks(stop, accept)
        finally:
            self._finish()
        summary = self._summary()
        for line in summary.lines():
            log.info("%s", line)
        return summary

    async def _run_tasks(self, stop: asyncio.Event, accept: asyncio.Event) -> None:
        async with asyncio.TaskGroup() as group:
            judging = group.create_task(self._judging.run(), name="pipeline")
            tasks = [group.create_task(work, name=name) for name, work in self._tasks(accept)]
            await stop.wait()
            log.info("stopping")
            self._service.stopping()
            self._control.close()
            self._intake.close()
            await self._judging.close(CLOSE_S)  # while there is a link to tell the autopilot what is still found
            if self._companion is not None:
                self._companion.take_leave()
            judging.cancel()
            await asyncio.wait([judging])
            self._finish()  # before the links are closed: an adapter may hang then
            for task in tasks:
                task.cancel()

    def _tasks(self, accept: asyncio.Event) -> Iterator[tuple[str, Coroutine[Any, Any, None]]]:
        for bus in self._buses:
            yield f"link {bus.name}", bus.run(self._on_state)
            yield f"load {bus.name}", bus.watch_load()
        if self._companion is not None:
            yield "link mavlink", self._companion.run(self._on_state)
        yield "ticker", self._tick()
        yield "state saver", self._save()
        yield "operator", self._accept(accept)
        yield "control", self._control.serve()

    # From the links to the judging ----------------------------------------------------------------

    def _on_state(self, state: LinkState) -> None:
        word = "up" if state.up else "down"
        log.log(logging.INFO if state.up else logging.WARNING, "%s %s%s", state.link, word, _colon(state.detail))
        self._unopened.discard(state.link)
        self._intake.reading(state.link, state)
        if self._companion is not None:
            self._companion.on_state(state)

    async def _tick(self) -> None:
        last_s = self._clock.now()
        while True:
            await asyncio.sleep(TICK_S)
            now_s = self._clock.now()
            if now_s - last_s > STILL_S:
                log.warning("stood still for %.1f s: the process was stopped, or this machine slept", now_s - last_s)
            last_s = now_s
            self._judging.advance(now_s)
            if self._companion is not None:
                self._companion.advance(now_s)

    # From the judging to the world ----------------------------------------------------------------

    def _record(self, outcomes: Sequence[Outcome]) -> None:
        """In the judging's thread: nobody else may touch the pipeline."""
        self._outlet.record(outcomes)
        self._journal.outcomes(outcomes, self._clock.now())
        self._levels = self._pipeline.levels()

    def _tell(self, outcomes: Sequence[Outcome]) -> None:
        """After each turn of the judging, in the event loop: both are alive."""
        self._outlet.tell(outcomes)
        now_s = self._clock.now()
        if not self._ready and (not self._unopened or now_s - self._start_s > READY_S):
            self._ready = True
            self._service.ready()
        self._service.alive(now_s)
        self._service.status(worst_first(self._levels), now_s)

    # The operator ---------------------------------------------------------------------------------

    async def _accept(self, accept: asyncio.Event) -> None:
        while True:
            await accept.wait()
            accept.clear()
            log.info("operator accepts all as it is")
            self._operator.say(OperatorAct.ACCEPT, code_of(ALL))

    def _hear_answer(self, outcome: Outcome) -> None:
        match outcome:
            case Finding():
                self._operator.note(outcome)
            case CommandAck():
                self._operator.hear(outcome)

    async def _answer(self, request: Request) -> Answer:
        if request.ask != STATUS:
            log.info("operator: %s %s", request.ask, ", ".join(request.subjects))
            return await self._operator.do(request)
        now_s = self._clock.now()
        return Answer(
            ok=True,
            levels={subject: level.name for subject, level in self._levels.items()},
            texts=tuple(Said(now_s - said_s, one.severity, one.text) for said_s, one in self._outlet.texts),
        )

    # The state, and the end -----------------------------------------------------------------------

    async def _save(self) -> None:
        while True:
            await asyncio.sleep(self._config.files.save_every_s)
            self._judging.put(self._store)

    def _store(self) -> list[Outcome]:
        self._memory.store(self._pipeline)
        return []

    def _finish(self) -> None:
        """After a cancellation or an error too, what has arrived is judged, and what was learnt is kept."""
        if not self._finished:
            self._finished = True
            self._control.close()
            self._judging.finish(FINISH_S)
            self._store()

    def _summary(self) -> Summary:
        buses = [*self._buses, *(self._companion.buses if self._companion is not None else ())]
        drops = {bus.name: bus.drops() for bus in buses}
        frames = Counter({bus.name: bus.received for bus in buses})
        remarks = self._pipeline.remarks()
        if self._companion is not None:
            drops[MAVLINK], frames[MAVLINK] = self._companion.drops(), self._companion.received
            remarks |= self._companion.remarks()
        drops["control"] = self._control.drops
        drops["pipeline"] = self._pipeline.drops() + self._outlet.lost + self._judging.lost
        return Summary(
            duration_s=self._clock.now() - self._start_s,
            behind_max_s=self._judging.behind_max_s,
            frames=frames,
            drops=drops,
            findings=self._outlet.counts,
            levels=self._pipeline.levels(),
            remarks=remarks,
            unjudged=[subject for subject, newest in self._pipeline.newest.items() if newest is None],
        )


def _links(config: Config) -> Iterator[str]:
    """Each link with the place that it leads to."""
    yield from (f"{bus.name} ({bus.interface} {bus.channel})" for bus in config.can)
    if config.mavlink is not None:
        yield f"{MAVLINK} ({config.mavlink.endpoint})"


def _colon(detail: str) -> str:
    return f": {detail}" if detail else ""
