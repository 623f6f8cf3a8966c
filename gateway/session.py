"""One run of the gateway: its tasks, their beginning and their end."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Coroutine, Iterator, Sequence
from typing import Any

from drivers.clock import Clock
from drivers.mavlink.messages import CommandAck
from drivers.mavlink.transports import Connect
from drivers.readings import OperatorAct
from gateway.account import Account
from gateway.can_source import PortOf
from gateway.config import Config
from gateway.control.local_operator import LocalOperator
from gateway.control.protocol import STATUS, WATCH, Answer, Request
from gateway.control.server import ControlSocket
from gateway.control.subject_words import watched_subjects
from gateway.findings import Finding, FindingsFile
from gateway.intake import Intake
from gateway.judging import Judging
from gateway.links import Links
from gateway.memory import Memory
from gateway.metrics.of_run import metrics_server
from gateway.operator import ALL, code_of
from gateway.outlet import Observer, Outlet
from gateway.pipeline import Outcome, Pipeline
from gateway.recording.journal import Journal
from gateway.stopwatch import Stopwatch
from gateway.summary import Summary, worst_first
from gateway.systemd import Service
from gateway.telemetry_board import TelemetryBoard
from gateway.timeline import STILL_S

log = logging.getLogger("gateway")

TICK_S = 0.1
# links that do not open for so long are told, and are no reason not to begin
READY_S = 5.0
# What a stop may take: all that came before is judged and told, and once more what was left
CLOSE_S, FINISH_S = 0.6, 0.2
# and for the recording to be whole: what takes longer is mended by the next run
WRITTEN_S = 0.6


class Session:
    """One run: links hand over to the judging, and what comes of it goes to file, log, link and listeners.

    Args:
        config: what is watched.
        pipeline: judges.
        stopwatch: measures how it does that.
        clock: of this run.
        observer: gets every outcome, too; None: nobody does.
        findings: file for them.
        service: is told how it goes.
        port_of, connect: how links are opened, see `Links`.
        collect_s: see `Judging`.
        journal: where all is written down.
    """

    def __init__(
        self,
        config: Config,
        pipeline: Pipeline,
        stopwatch: Stopwatch,
        clock: Clock,
        observer: Observer | None,
        findings: FindingsFile,
        service: Service,
        port_of: PortOf | None,
        connect: Connect,
        collect_s: float,
        journal: Journal,
    ) -> None:
        self._config, self._clock, self._pipeline, self._service = config, clock, pipeline, service
        self._journal = journal
        self._memory = Memory(config.files.state, config.files.young_s, clock.now)
        self._judging = Judging(pipeline, clock, self._record, self._tell, collect_s, journal)
        self._board = TelemetryBoard(config.vehicle.name, watched_subjects(config), clock.now())
        self._intake = Intake(lambda work: self._judging.put(work, self._intake.first), journal, self._board.hear)
        self._links = Links(config, clock, self._intake, port_of, connect)
        listeners = [self._hear_answer] if observer is None else [self._hear_answer, observer]
        self._outlet = Outlet(findings, config.files.findings, listeners, self._links.send)
        self._operator = LocalOperator(watched_subjects(config), self._intake.reading, clock.now)
        self._control = ControlSocket(config.files.control, self._answer)
        drops = {"control": self._control.drops}
        self._account = Account(
            clock, self._board, stopwatch, self._links, self._judging, self._outlet, drops, journal
        )
        self._metrics = None if config.metrics is None else metrics_server(config.metrics, self._account.telemetry)
        if self._metrics is not None:
            drops["metrics"] = self._metrics.drops
        self._ready = self._finished = False

    async def run(self, stop: asyncio.Event, accept: asyncio.Event) -> Summary:
        """Watches until `stop` is set; `accept`: the operator says that all is well as it is.

        Raises:
            SocketTakenError: another gateway runs with this configuration.
        """
        self._control.open()
        try:
            recalled = self._memory.recall(self._pipeline)
            self._journal.begin(recalled.state, recalled.resumed)
            watched, links = self._config.watched(), ", ".join(self._links.places())
            log.info("watching %s: %s over %s", self._config.vehicle.name, watched, links)
            await self._run_tasks(stop, accept)
        finally:
            self._finish()
            self._journal.close(WRITTEN_S)
        summary = self._account.summary(self._pipeline)
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
            self._links.take_leave()
            judging.cancel()
            await asyncio.wait([judging])
            self._finish()  # before the links are closed: an adapter may hang then
            for task in tasks:
                task.cancel()

    def _tasks(self, accept: asyncio.Event) -> Iterator[tuple[str, Coroutine[Any, Any, None]]]:
        yield from self._links.tasks()
        yield "ticker", self._tick()
        yield "state saver", self._save()
        yield "operator", self._accept(accept)
        yield "control", self._control.serve()
        if self._metrics is not None:
            yield "metrics", self._metrics.serve()

    async def _tick(self) -> None:
        last_s = self._clock.now()
        while True:
            await asyncio.sleep(TICK_S)
            now_s = self._clock.now()
            if now_s - last_s > STILL_S:
                log.warning("stood still for %.1f s: the process was stopped, or this machine slept", now_s - last_s)
            last_s = now_s
            self._judging.advance(now_s)
            self._links.advance(now_s)

    # From the judging to the world ----------------------------------------------------------------

    def _record(self, outcomes: Sequence[Outcome]) -> None:
        """In the judging's thread: nobody else may touch the pipeline."""
        self._outlet.record(outcomes)
        self._journal.outcomes(outcomes, self._clock.now())
        self._board.keep(self._pipeline)

    def _tell(self, outcomes: Sequence[Outcome]) -> None:
        """After each turn of the judging, in the event loop: both are alive."""
        self._outlet.tell(outcomes)
        now_s = self._clock.now()
        self._board.take(outcomes, now_s)
        if not self._ready and (not self._links.unopened or now_s - self._board.start_s > READY_S):
            self._ready = True
            self._service.ready()
        self._service.alive(now_s)
        self._service.status(worst_first(self._board.levels), now_s)

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
        if request.ask == WATCH:
            return Answer(ok=True, telemetry=self._account.telemetry())
        if request.ask == STATUS:
            levels = {subject: level.name for subject, level in self._board.levels.items()}
            return Answer(ok=True, levels=levels, texts=self._board.texts(self._clock.now()))
        log.info("operator: %s %s", request.ask, ", ".join(request.subjects))
        return await self._operator.do(request)

    # The state, and the end -----------------------------------------------------------------------

    async def _save(self) -> None:
        while True:
            await asyncio.sleep(self._config.files.save_every_s)
            self._judging.put(self._store)

    def _store(self) -> list[Outcome]:
        self._journal.remember(self._memory.store(self._pipeline))
        return []

    def _finish(self) -> None:
        """After a cancellation or an error too, what has arrived is judged, and what was learnt is kept."""
        if not self._finished:
            self._finished = True
            self._control.close()
            self._judging.finish(FINISH_S)
            self._store()
