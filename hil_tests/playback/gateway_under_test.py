"""The gateway that a play is to judge: in the play's own event loop, or as the program that users run."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import signal
import sys
from collections.abc import AsyncIterator, Callable, Iterator, Sequence
from contextlib import asynccontextmanager, contextmanager
from dataclasses import dataclass
from pathlib import Path

from drivers.clock import Clock
from drivers.mavlink.transports import Connect, open_transport
from gateway.can_source import PortOf
from gateway.config import Config
from gateway.judging import COLLECT_S
from gateway.pipeline import Factories
from gateway.run import run
from gateway.summary import Summary

# In an emulated machine it takes half a minute to load what it needs
START_S, STOP_S = 120.0, 20.0
LOG, ERRORS_KEPT = "gateway.log", 20
READY = "watching "  # the gateway's first line once it runs


class GatewayFailedError(Exception):
    """It did not start, or ended by itself; the text says what it said."""


class GatewayRun:
    """A gateway that runs.

    Attributes:
        lines: its own account, once it has stopped.
    """

    def __init__(self, ended: Callable[[], str | None]) -> None:
        self._ended = ended
        self.lines: Sequence[str] = ()

    def check(self) -> None:
        """Does nothing while it runs.

        Raises:
            GatewayFailedError: it does no more.
        """
        reason = self._ended()
        if reason is not None:
            raise GatewayFailedError(reason)


@dataclass(frozen=True, slots=True)
class Connections:
    """How a gateway in the play's own event loop opens its links, and how often it judges.

    Attributes:
        port_of: its CAN buses; None: as configured.
        connect: the autopilot's link.
        collect_s: what arrives within this time is judged together.
    """

    port_of: PortOf | None = None
    connect: Connect = open_transport
    collect_s: float = COLLECT_S


@asynccontextmanager
async def gateway_in_loop(
    config: Config, clock: Clock, connections: Connections, factories: Factories | None = None
) -> AsyncIterator[GatewayRun]:
    """All of `gateway run` in this event loop, stopped in order; its log goes into the folder of its findings.

    Args:
        config: what it watches.
        clock: of the play.
        connections: see there.
        factories: makes the detectors; None: the real ones.
    """
    stop = asyncio.Event()
    with _logged(config.files.findings.parent / LOG):
        running = asyncio.create_task(
            run(
                config,
                clock=clock,
                stop=stop,
                factories=factories,
                port_of=connections.port_of,
                connect=connections.connect,
                collect_s=connections.collect_s,
            ),
            name="gateway",
        )
        async with _watched(running, stop) as watched:
            yield watched


@asynccontextmanager
async def _watched(running: asyncio.Task[Summary], stop: asyncio.Event) -> AsyncIterator[GatewayRun]:

    def ended() -> str | None:
        if not running.done():
            return None
        return f"the gateway ended by itself: {_reason(running.exception())}"

    watched = GatewayRun(ended)
    try:
        yield watched
    finally:
        stop.set()
        await asyncio.wait([running])
        if running.exception() is None:
            watched.lines = running.result().lines()


def _reason(error: BaseException | None) -> str:
    """What was raised in the first of its tasks that failed."""
    while isinstance(error, BaseExceptionGroup):
        error = error.exceptions[0]
    return "without a word" if error is None else f"{type(error).__name__}: {error}"


@contextmanager
def _logged(path: Path) -> Iterator[None]:
    """What the gateway logs meanwhile is in a file, and not on the terminal of those who look at the play."""
    logger, handler = logging.getLogger("gateway"), logging.FileHandler(path, mode="w", encoding="utf-8")
    before = logger.propagate, logger.level
    logger.propagate = False
    logger.setLevel(logging.INFO)
    logger.addHandler(handler)
    try:
        yield
    finally:
        logger.removeHandler(handler)
        handler.close()
        logger.propagate, level = before
        logger.setLevel(level)


@asynccontextmanager
async def gateway_process(config_file: Path) -> AsyncIterator[GatewayRun]:
    """`gateway run CONFIG` as a process of its own, that has begun to watch; its log goes into the file's folder.

    Raises:
        GatewayFailedError: it does not start.
    """
    log = config_file.parent / LOG
    with log.open("wb") as file:
        process = await asyncio.create_subprocess_exec(
            sys.executable, "-c", "from gateway.cli import main; main()", "run", str(config_file), stderr=file
        )
        try:
            await _until_ready(process, log)
            watched = GatewayRun(lambda: _ended(process, log))
            yield watched
        finally:
            await _stopped(process)
    watched.lines = _account(log)


async def _until_ready(process: asyncio.subprocess.Process, log: Path) -> None:
    with contextlib.suppress(TimeoutError):
        async with asyncio.timeout(START_S):
            while (reason := _ended(process, log)) is None:
                if _is_ready(log):
                    return
                await asyncio.sleep(0.1)
            raise GatewayFailedError(reason)
    raise GatewayFailedError(f"the gateway has not begun to watch within {START_S:.0f} s:\n{_last_words(log)}")


def _ended(process: asyncio.subprocess.Process, log: Path) -> str | None:
    if process.returncode is None:
        return None
    return f"the gateway ended by itself, exit code {process.returncode}:\n{_last_words(log)}"


async def _stopped(process: asyncio.subprocess.Process) -> None:
    if process.returncode is None:
        process.send_signal(signal.SIGTERM)
        try:
            async with asyncio.timeout(STOP_S):
                await process.wait()
        except TimeoutError:
            process.kill()
            await process.wait()


def _is_ready(log: Path) -> bool:
    return READY in log.read_text(errors="replace")


def _last_words(log: Path) -> str:
    return "\n".join(log.read_text(errors="replace").splitlines()[-ERRORS_KEPT:])


def _account(log: Path) -> list[str]:
    """What it said after it was told to stop."""
    lines = log.read_text(errors="replace").splitlines()
    stopping = [number for number, line in enumerate(lines) if line.endswith("stopping")]
    return lines[stopping[-1] + 1 :] if stopping else []
