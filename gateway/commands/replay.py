"""`gateway replay`: recordings through the pipeline of `gateway run`, as fast as this machine can."""

from __future__ import annotations

import os
import time
from pathlib import Path
from typing import TYPE_CHECKING

import click
from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn

from gateway.config import Config, load
from gateway.findings import Finding
from gateway.problems import ConfigError
from gateway.replay.log_input import log_input
from gateway.replay.offsets import offsets_s
from gateway.severity import Severity

if TYPE_CHECKING:
    from gateway.replay.result import ReplayResult
    from gateway.replay.session import Progress as Place

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

    Several logs of one dive are merged by their times; parts of one log may be named in any order. An interface in a
    log of CAN is the bus of CONFIG with that channel or name; any other is named: can0=dive.log. What is damaged is
    passed over, and told with its place. Findings are told by the time since the beginning.

    Exit code 0: nothing found; 1: faults found; 2: failed, or nothing could be judged.
    """
    console = Console()
    try:
        out.mkdir(parents=True, exist_ok=True)
        least = Severity.INFO if verbose else Severity.NOTICE
        result, found = _replayed(load(config), log, offsets, out, console, least)
        lines = result.lines()
        (out / SUMMARY).write_text("\n".join([*lines, "", *found]) + "\n", encoding="utf-8")
    except (ConfigError, ValueError, OSError) as error:
        raise _failed(_words(error)) from error
    except KeyboardInterrupt as error:  # click would end with 1: as if faults were found
        raise _failed(f"interrupted; what was found until then is in {out / FINDINGS}") from error
    for line in lines:
        console.print(line, highlight=False, markup=False, soft_wrap=True)
    if result.begin_s is None:
        raise _failed("nothing in these logs is of a link of the configuration")
    if not result.judged:
        raise _failed("nothing could be judged: see what each needs in the configuration, and what these logs have")
    raise click.exceptions.Exit(FAULTS if result.faulty else CLEAN)


def _failed(reason: str) -> click.exceptions.Exit:
    click.echo(f"Error: {reason}", err=True)
    return click.exceptions.Exit(FAILED)


def _words(error: Exception) -> str:
    if isinstance(error, OSError) and error.filename is not None:
        return f"{error.filename}: {error.strerror}"
    return str(error)


def _replayed(
    config: Config, logs: tuple[str, ...], offsets: tuple[str, ...], out: Path, console: Console, least: Severity
) -> tuple[ReplayResult, list[str]]:
    """What a replay came to, and what it has found, in lines."""
    # with all detectors and log readers: no other command should wait for them
    from gateway.outlet import NOTES
    from gateway.replay.reels import reels
    from gateway.replay.session import replay as replay_logs

    inputs = [log_input(one, config.links()) for one in logs]
    given_s = offsets_s(offsets, inputs)
    found: list[str] = []
    begin_s = time.perf_counter()
    columns = (SpinnerColumn(), TextColumn("{task.description}"))
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("reading")

        def show(place: Place) -> None:
            speed = place.dive_s / max(time.perf_counter() - begin_s, 1e-3)
            bar.update(task, description=f"{_clock(place.dive_s)} of the dive, {speed:.0f} times real time")
            for finding in place.findings:
                if finding.severity <= least:
                    found.append(_line(finding, place.begin_s, note=finding.detector in NOTES))
                    bar.console.print(found[-1], style=_STYLES.get(finding.severity), highlight=False, markup=False)

        return replay_logs(
            config, reels(inputs, config, given_s), out / FINDINGS, show, jobs=os.cpu_count() or 1
        ), found


_STYLES = {Severity.CRITICAL: "bold red", Severity.ERROR: "red", Severity.WARNING: "yellow"}


def _line(finding: Finding, begin_s: float, note: bool) -> str:
    """With its time since the beginning. A note says how what was asked went, and not how well the vehicle is."""
    level = "" if note else finding.level.name
    return f"{_clock(finding.time_s - begin_s)} {level:7} {finding.text}"


def _clock(seconds: float) -> str:
    minutes, second = divmod(int(max(seconds, 0.0)), 60)
    return f"{minutes // 60}:{minutes % 60:02}:{second:02}"
