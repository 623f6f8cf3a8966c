"""`gateway bench replay`: a long dive from its logs to its findings, beside the time that the dive took."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import click
from rich.console import Console
from rich.table import Table

from gateway.config import load
from gateway.replay.log_input import log_input
from gateway.replay.reels import reels
from gateway.replay.session import replay as replay_logs
from hil_tests.bench.dive_log import RATE_HZ, THRUSTERS, write_candump, write_config, write_tlog
from hil_tests.bench.figures import console_beside, shared_options, write
from hil_tests.processes import processes, results

MINUTES, FEW_MINUTES = 60, 6


@dataclass(frozen=True, slots=True)
class Figures:
    """One replay.

    Attributes:
        dive_s: time of the dive.
        frames, messages: of CAN, of MAVLink.
        wall_s, cpu_s: for the replay, of all its threads and processes.
        times_real_time: `dive_s` over `wall_s`.
        faults: found; the dive is healthy.
    """

    dive_s: float
    frames: int
    messages: int
    wall_s: float
    cpu_s: float
    times_real_time: float
    faults: int


def replayed(seconds: int, jobs: int) -> Figures:
    """Writes the logs of a dive into a folder of its own, and replays them."""
    with TemporaryDirectory(prefix="gateway-bench-") as folder:
        config, candump, tlog = (Path(folder) / name for name in ("config.toml", "dive.log", "dive.tlog"))
        write_config(config)
        frames, messages = write_candump(candump, seconds), write_tlog(tlog, seconds)
        wall_s, cpu_s = time.perf_counter(), _cpu_s()
        settings = load(config)
        logs = [log_input(str(path), settings.links()) for path in (candump, tlog)]
        result = replay_logs(settings, reels(logs, settings), Path(folder) / "findings.jsonl", jobs=jobs)
        wall_s, cpu_s = time.perf_counter() - wall_s, _cpu_s() - cpu_s
    return Figures(
        result.duration_s, frames, messages, wall_s, cpu_s, result.duration_s / wall_s, result.findings["FAULT"]
    )


def _cpu_s() -> float:
    """Of this process and of those that it has begun and that have ended."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def measure(minutes: int, jobs: int, console: Console) -> Figures:
    """Measures, and prints the table."""
    with processes(1) as pool:
        [figures] = results([pool.submit(replayed, 60 * minutes, jobs)], "dive")
    console.print(_table(figures))
    return figures


@click.command(short_help="A long dive from its logs to its findings.")
@click.option(
    "--minutes", type=click.IntRange(min=1), default=MINUTES, show_default=True, help="Of the dive that is replayed."
)
@shared_options
def replay(*, minutes: int, jobs: int, json_file: str | None) -> None:
    """Replay the logs of a healthy dive: eight thrusters on DroneCAN, speed watched over MAVLink.

    The logs take 3.5 MB a minute in the folder for temporary files. --jobs: processes for the detectors.
    """
    write({"replay": measure(minutes, jobs, console_beside(json_file))}, json_file)


def _table(figures: Figures) -> Table:
    table = Table(title=f"A dive of {THRUSTERS} thrusters at {RATE_HZ} Hz, from its logs to its findings")
    for heading in (
        "dive, s",
        "CAN frames",
        "MAVLink\nmessages",
        "replay, s",
        "CPU, s",
        "times\nreal time",
        "faults",
    ):
        table.add_column(heading, justify="right")
    table.add_row(
        f"{figures.dive_s:.0f}",
        str(figures.frames),
        str(figures.messages),
        f"{figures.wall_s:.1f}",
        f"{figures.cpu_s:.1f}",
        f"{figures.times_real_time:.0f}",
        str(figures.faults),
    )
    return table
