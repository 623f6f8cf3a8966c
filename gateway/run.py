"""The running gateway: the thin shell that owns links, tasks and the clock, around the pure pipeline.

Links decode in the event loop; all judging happens in one worker thread (`judging`).
"""

from __future__ import annotations

import asyncio
from importlib import import_module

from threadpoolctl import threadpool_limits

from drivers.clock import Clock
from drivers.mavlink.transports import Connect, open_transport
from gateway.can_source import PortOf
from gateway.config import Config
from gateway.findings import FindingsFile
from gateway.judging import COLLECT_S
from gateway.outlet import Observer
from gateway.pipeline import Factories, Pipeline
from gateway.recording.journal import Journal
from gateway.recording.of_run import journal_of
from gateway.session import Session
from gateway.stopwatch import Stopwatch
from gateway.summary import Summary
from gateway.systemd import Service

# what detectors load when they first need it, a second, on slow machines half a minute: no other command waits for it
LOADED_LATE = ("filterpy.kalman", "scipy.optimize", "scipy.signal")


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
        journal: where all that comes in and goes out is written down; None: as it is configured.

    Returns:
        What the run came to.

    Raises:
        OSError: the findings cannot be written where the configuration says, or another gateway runs with it.
    """
    for module in LOADED_LATE:
        import_module(module)
    # the detectors' matrices are small: BLAS threads that wait for each other on busy cores cost more than they give
    with threadpool_limits(limits=1, user_api="blas"), FindingsFile(config.files.findings) as findings:
        clock, stopwatch = clock or Clock(), Stopwatch()
        pipeline = Pipeline(config, factories, stopwatch.judge)
        services = service or Service({})
        session = Session(
            config,
            pipeline,
            stopwatch,
            clock,
            observer,
            findings,
            services,
            port_of,
            connect,
            collect_s,
            journal or journal_of(config, clock.now),
        )
        return await session.run(stop or asyncio.Event(), accept or asyncio.Event())
