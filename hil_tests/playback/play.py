"""One scenario, from its file to what came of it."""

from __future__ import annotations

import asyncio
import fcntl
import os
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from drivers.clock import Clock
from gateway.pipeline import Factories
from hil_tests.playback.fitting import load_fitting
from hil_tests.playback.gateway_under_test import GatewayFailedError
from hil_tests.playback.stage import PlayEndedError, Stage
from hil_tests.playback.virtual_time import run_in_virtual_time
from hil_tests.playback.way import VIRTUAL, Way
from hil_tests.report.outcome import Outcome
from hil_tests.scenario.document import Scenario

Progress = Callable[[float], None]


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
        RefusedError: a real bus or autopilot may not be touched.
        CanPortError: there is no such bus.
        OSError: the folder cannot be written to, or the autopilot's endpoint does not open.
        ValueError: the scenario cannot be played in this way.
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
        factories: makes the gateway's detectors, where it is in this program; None: the real ones.

    Raises:
        ConfigError, RefusedError, CanPortError, OSError, ValueError: as `play_file`.
    """
    folder.mkdir(parents=True, exist_ok=True)
    with _alone_in(folder):
        stage = Stage(scenario, path, folder, progress, factories)
        began_s, broken = time.perf_counter(), None
        try:
            _play(stage, way)
        except (GatewayFailedError, PlayEndedError) as error:
            broken = str(error)
        return replace(stage.outcome(str(way), broken), wall_s=time.perf_counter() - began_s)


@contextmanager
def _alone_in(folder: Path) -> Iterator[None]:
    """Raises ValueError while another play writes there: each would take the other's findings for its own."""
    place = os.open(folder, os.O_RDONLY)
    try:
        _lock(place, folder)
        yield
    finally:
        os.close(place)


def _lock(place: int, folder: Path) -> None:
    try:
        fcntl.flock(place, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        raise ValueError(f"another play writes into {folder}: wait for its end, or give another --out") from error


def _play(stage: Stage, way: Way) -> None:
    if way.is_virtual:
        run_in_virtual_time(stage.in_memory)
    elif way.is_bridged:
        asyncio.run(stage.in_between(Clock(), way))
    elif way.channel is not None:
        asyncio.run(stage.on_bus(Clock(), way.channel, way))
    else:
        asyncio.run(stage.in_memory(Clock()))
