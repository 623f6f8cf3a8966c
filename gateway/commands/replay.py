"""`gateway replay`: recordings through the pipeline of `gateway run`, as fast as this machine can."""

from __future__ import annotations

import errno
from pathlib import Path

import click
from rich.console import Console

from gateway.commands.options import config_argument, offset_option
from gateway.commands.replaying import DIFF, FINDINGS, PHASES, SUMMARY, Request, replayed
from gateway.problems import ConfigError
from gateway.report import PAGE, PICTURES
from gateway.severity import Severity

CLEAN, FAULTS, FAILED = 0, 1, 2


@click.command(short_help="Judge recorded dives with CONFIG.")
@config_argument
@click.argument("log", nargs=-1, required=True)
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    required=True,
    help=f"Folder for {FINDINGS}, {SUMMARY} and {PAGE}; those of an earlier replay are replaced.",
)
@offset_option
@click.option(
    "--from",
    "begin",
    metavar="TIME",
    help="Tell what is found from here on; what comes before is learnt from. The time since the beginning (90, 5:00, "
    "1:02:03), or UTC (14:05:00Z, 2026-11-22T14:05:00Z).",
)
@click.option("--to", "end", metavar="TIME", help="Judge until here.")
@click.option(
    "--detector",
    "detectors",
    multiple=True,
    type=click.Choice(["thruster", "speed", "navigation"]),
    help="Have only this one judge; may be given again.",
)
@click.option(
    "--phases",
    type=click.IntRange(2, 64),
    metavar="N",
    help=f"Judge N times, each with samples taken a little later, and say which findings depend on that: {PHASES}.",
)
@click.option(
    "--against",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="CONFIG",
    help=f"Judge with this configuration, too, and say what it would find otherwise: {DIFF}.",
)
@click.option("--no-report", "report", is_flag=True, flag_value=False, default=True, help=f"Write no {PAGE}.")
@click.option("--plots", is_flag=True, help=f"Write the report's figures as PNG and SVG, too, into {PICTURES}.")
@click.option("-v", "--verbose", is_flag=True, help="Print all findings, also that something is well.")
def replay(
    config: Path,
    log: tuple[str, ...],
    out: Path,
    offsets: tuple[str, ...],
    begin: str | None,
    end: str | None,
    detectors: tuple[str, ...],
    phases: int | None,
    against: Path | None,
    report: bool,
    plots: bool,
    verbose: bool,
) -> None:
    """Judge recorded dives by the very code that judges live: the same readings give the same findings.

    \b
    ours       .mcap of gateway run: with what it had learnt before, and all of it; the findings are the same
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
    least = Severity.INFO if verbose else Severity.NOTICE
    try:
        request = Request(
            config, log, out, offsets, begin, end, detectors, phases or 1, against, least, report, plots
        )
        account = replayed(request, console)
    except (ConfigError, ValueError, OSError) as error:
        raise _failed(_words(error, out)) from error
    except KeyboardInterrupt as error:  # click would end with 1: as if faults were found
        raise _failed(f"interrupted; what was found until then is in {out / FINDINGS}") from error
    for line in account.lines:
        console.print(line, highlight=False, markup=False, soft_wrap=True)
    if account.unusable:
        raise _failed(account.unusable)
    raise click.exceptions.Exit(FAULTS if account.faulty else CLEAN)


def _failed(reason: str) -> click.exceptions.Exit:
    click.echo(f"Error: {reason}", err=True)
    return click.exceptions.Exit(FAILED)


def _words(error: Exception, out: Path) -> str:
    if not isinstance(error, OSError):
        return str(error)
    if error.filename is None and error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG):
        return f"{out}: {error.strerror}; make room, or name another folder by --out"
    return f"{error.filename}: {error.strerror}" if error.filename is not None else str(error)
