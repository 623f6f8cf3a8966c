"""`gateway commission`: what the configuration needs, learnt from recordings of healthy dives."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click
from rich.console import Console
from rich.progress import Progress, SpinnerColumn, TextColumn

from gateway.commands.options import config_argument, offset_option
from gateway.config import Config, load
from gateway.problems import ConfigError
from gateway.replay.offsets import offsets_s

if TYPE_CHECKING:
    from gateway.commissioning.dive import RecordedDive
    from gateway.commissioning.session import Commissioning

Tell = Callable[[str], None]

COMPLETE, INCOMPLETE, FAILED = 0, 1, 2


@click.command(short_help="Learn from healthy dives what CONFIG needs.")
@config_argument
@click.argument("log", nargs=-1, required=True)
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    required=True,
    help="Folder for the new configuration, vehicle.state and commissioning.html; not the one that CONFIG lies in.",
)
@click.option(
    "--false-alarms-per-hour",
    type=click.FloatRange(min=0.0, max=100.0, min_open=True),
    default=0.1,
    show_default=True,
    help="How many faults may be said of a healthy vehicle.",
)
@offset_option
@click.option("--healthy", is_flag=True, help="The dives are healthy, whatever is found in them: I know better.")
def commission(
    config: Path,
    log: tuple[str, ...],
    out: Path,
    false_alarms_per_hour: float,
    offsets: tuple[str, ...],
    healthy: bool,
) -> None:
    """Learn from healthy dives what CONFIG needs, and say how sure that is.

    LOG is what `gateway replay` takes. Logs of one folder are of one dive, or of dives one after the other; the more
    dives, the better. An hour with all usual manoeuvres is good; of less than ten minutes, not all is learnt.

    \b
    thrusters     curve, delay, lag; a threshold for the rate of false alarms; the first run knows them already
    [speed]       the normal speed over the thrust
    [navigation]  noise of the sensors, how the DVL is turned, and how much later its samples come

    CONFIG stays as it is: the new file is a copy with what was learnt, and says so behind each value. What dives do
    not show is refused, with the manoeuvre that is missing.

    Exit code 0: all was learnt; 1: something is missing, the rest was written; 2: failed, or nothing was learnt.
    """
    console = Console()
    try:
        found = _commissioned(_Request(config, log, offsets, out), false_alarms_per_hour, healthy, console)
    except (ConfigError, ValueError, OSError) as error:
        raise _failed(_words(error)) from error
    except KeyboardInterrupt as error:
        raise _failed("interrupted; nothing was written") from error
    if found.text is None:
        raise _failed(f"nothing was learnt, no configuration was written; plots are in {out}")
    raise click.exceptions.Exit(COMPLETE if found.complete else INCOMPLETE)


@dataclass(frozen=True, slots=True)
class _Request:
    """Which files go in, and where others come out."""

    source: Path
    logs: Sequence[str]
    offsets: Sequence[str]
    out: Path


def _commissioned(request: _Request, false_alarms_per_hour: float, healthy: bool, console: Console) -> Commissioning:
    # with all detectors and log readers: no other command should wait for them
    from gateway.commissioning.session import Wishes
    from gateway.commissioning.session import commission as learn
    from gateway.commissioning.table import print_tables
    from gateway.commissioning.writing import write

    source, out, config = request.source, request.out, load(request.source)
    if out.resolve() == source.resolve().parent:
        raise ValueError(f"--out {out}: {source} lies there, and stays as it is: want another folder")
    wishes = Wishes(false_alarms_per_hour, healthy)
    with _progress(console) as tell:
        dives = list(_dives(config, request, tell))
        if not dives:
            raise ValueError("nothing in these logs is of a link of the configuration: are they of this vehicle?")
        out.mkdir(parents=True, exist_ok=True)
        found = learn(source, config, dives, out, wishes, tell)
    print_tables(console, found)
    for path in write(found, config.vehicle.name, source, out):
        console.print(f"written: {path}", highlight=False, markup=False, soft_wrap=True)
    return found


def _dives(config: Config, request: _Request, tell: Tell) -> Iterator[RecordedDive]:
    from gateway.commissioning.reading import by_dive, named, read_dives
    from gateway.replay.log_input import log_input

    inputs = [log_input(one, config.links()) for one in request.logs]
    given_s, folders = offsets_s(request.offsets, inputs), by_dive(inputs)
    for folder, name in named(folders).items():

        def show(read_s: float, name: str = name) -> None:
            tell(f"{name}: {read_s / 60.0:.1f} minutes read")

        yield from read_dives(config, folders[folder], name, given_s, show, jobs=os.cpu_count() or 1)


@contextmanager
def _progress(console: Console) -> Iterator[Tell]:
    columns = (SpinnerColumn(), TextColumn("{task.description}"))
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("reading")

        def tell(what: str) -> None:
            bar.update(task, description=what)

        yield tell


def _failed(reason: str) -> click.exceptions.Exit:
    click.echo(f"Error: {reason}", err=True)
    return click.exceptions.Exit(FAILED)


def _words(error: Exception) -> str:
    if isinstance(error, OSError) and error.filename is not None:
        return f"{error.filename}: {error.strerror}"
    return str(error)
