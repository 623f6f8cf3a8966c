"""`gateway replay`: recordings through the pipeline of `gateway run`, as fast as this machine can."""

from __future__ import annotations

import os
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click
from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn

from gateway.config import Config, load
from gateway.findings import Finding
from gateway.problems import ConfigError
from gateway.replay.log_input import LogInput, log_input
from gateway.severity import Severity

if TYPE_CHECKING:
    from gateway.replay.session import Progress as Place
    from gateway.replay.session import ReplayResult

FINDINGS, SUMMARY = "findings.jsonl", "summary.txt"
CLEAN, FAULTS, FAILED = 0, 1, 2


@click.command(short_help="Judge recorded dives with CONFIG.")
@click.argument("config", type=click.Path(path_type=Path, dir_okay=False))
@click.argument("log", nargs=-1, required=True)
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    required=True,
    help=f"Folder for {FINDINGS} and {SUMMARY}; those of an earlier replay are replaced.",
)
@click.option(
    "--offset",
    "offsets",
    multiple=True,
    metavar="LOG=SECONDS",
    help="Added to the times of LOG, whose clock was another; left out: found, where the logs show it.",
)
@click.option("-v", "--verbose", is_flag=True, help="Print all findings, also that something is well.")
def replay(config: Path, log: tuple[str, ...], out: Path, offsets: tuple[str, ...], verbose: bool) -> None:
    """Judge recorded dives by the very code that judges live: the same readings give the same findings.

    \b
    CAN        candump (-l, or printed with times), ASC, BLF, TRC; gzip or not
    MAVLink    .tlog, also with the CAN frames that an autopilot forwards
    ArduPilot  dataflash .BIN
    PX4        .ulg

    Several logs of one dive are merged by their times. An interface in a log of CAN is the bus of CONFIG with that
    channel or name; any other is named: can0=dive.log. What is damaged is passed over, and told with its place.

    Exit code 0: nothing found; 1: faults found; 2: failed.
    """
    console = Console()
    try:
        out.mkdir(parents=True, exist_ok=True)
        least = Severity.INFO if verbose else Severity.NOTICE
        result = _replayed(load(config), log, offsets, out, console, least)
    except (ConfigError, ValueError, OSError) as error:
        click.echo(f"Error: {error}", err=True)
        raise click.exceptions.Exit(FAILED) from error
    lines = result.lines()
    (out / SUMMARY).write_text("\n".join(lines) + "\n", encoding="utf-8")
    for line in lines:
        console.print(line, highlight=False, markup=False, soft_wrap=True)
    if result.begin_s is None:
        click.echo("Error: nothing in these logs is of a link of the configuration", err=True)
        raise click.exceptions.Exit(FAILED)
    raise click.exceptions.Exit(FAULTS if result.faulty else CLEAN)


def _replayed(
    config: Config, logs: tuple[str, ...], offsets: tuple[str, ...], out: Path, console: Console, least: Severity
) -> ReplayResult:
    # with all detectors and log readers: no other command should wait for them
    from gateway.replay.clocks import on_one_clock
    from gateway.replay.session import grouped
    from gateway.replay.session import replay as replay_logs

    inputs = [log_input(one, config.links()) for one in logs]
    timed = on_one_clock(grouped(inputs, config), config, _offsets_s(offsets, inputs))
    columns = (SpinnerColumn(), TextColumn("{task.description}"))
    begin_s = time.perf_counter()
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("reading")

        def show(place: Place) -> None:
            speed = place.dive_s / max(time.perf_counter() - begin_s, 1e-3)
            bar.update(task, description=f"{_clock(place.dive_s)} of the dive, {speed:.0f} times real time")
            for finding in place.findings:
                if finding.severity <= least:
                    _print(bar.console, finding)

        return replay_logs(config, timed, out / FINDINGS, show, jobs=os.cpu_count() or 1)


def _offsets_s(offsets: tuple[str, ...], logs: Sequence[LogInput]) -> dict[Path, float]:
    """What the user gave, by log.

    Raises:
        ValueError: no number, or a log that is not replayed.
    """
    given_s: dict[Path, float] = {}
    for text in offsets:
        name, _, number = text.rpartition("=")
        path = next((log.path for log in logs if name in (str(log.path), log.path.name)), None)
        if path is None:
            raise ValueError(f"--offset {text}: want LOG=SECONDS, of {', '.join(str(log.path) for log in logs)}")
        try:
            given_s[path] = float(number)
        except ValueError:
            raise ValueError(f"--offset {text}: {number!r} is no number of seconds") from None
    return given_s


def _print(console: Console, finding: Finding) -> None:
    style = {Severity.CRITICAL: "bold red", Severity.ERROR: "red", Severity.WARNING: "yellow"}.get(finding.severity)
    text = f"{finding.time_s:.2f} {finding.level.name:7} {finding.text}"
    console.print(text, style=style, highlight=False, markup=False, soft_wrap=True)


def _clock(seconds: float) -> str:
    minutes, second = divmod(int(seconds), 60)
    return f"{minutes // 60}:{minutes % 60:02}:{second:02}"
