"""`gateway hil play`: scenarios played and judged."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import chain, count
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskID, TextColumn, TimeElapsedColumn

if TYPE_CHECKING:
    from hil_tests.playback.way import Way
    from hil_tests.report.outcome import Outcome

REPORT, JUNIT = "report.html", "junit.xml"
PASSED, FAILED, UNPLAYED = 0, 1, 2


@click.command(short_help="Play scenarios, and judge what the gateway makes of them.")
@click.argument("scenario", nargs=-1)
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path("out/hil"),
    show_default=True,
    help=f"Folder for {REPORT}, {JUNIT}, and one folder for each scenario with all that was recorded.",
)
@click.option("--tag", "tags", multiple=True, help="Only scenarios with this tag; may be given several times.")
@click.option("--realtime", is_flag=True, help="At the pace of the clock, in memory; without: as fast as it goes.")
@click.option("--can", "channel", metavar="CHANNEL", help="On this SocketCAN interface, in real time: vcan0.")
@click.option(
    "--mavlink",
    "autopilot",
    metavar="ENDPOINT",
    help="A real autopilot, or its simulator: udpin:127.0.0.1:14550. With --can, ESCs and sensors are played to it.",
)
@click.option(
    "--bridge", metavar="CAN:CAN", help="In the middle of a real bus, the autopilot's side first: can0:can1."
)
@click.option("--gateway", metavar="ENDPOINT", help="With --bridge: one that runs elsewhere; judged by its texts.")
@click.option("--transmit", metavar="WHAT", help="What may be put onto a real bus: 7E0,node:20-27; all.")
@click.option("--while-armed", is_flag=True, help="The autopilot may be armed: its thrusters may turn.")
@click.option("--no-autopilot", is_flag=True, help="There is no autopilot on the real bus that could be armed.")
@click.option("--seed", type=click.IntRange(min=0), help="Of all chance, in place of the scenario's own.")
@click.option(
    "--jobs",
    type=click.IntRange(min=1),
    default=os.cpu_count() or 1,
    show_default="one for each core",
    help="Scenarios that are played at a time, in virtual time.",
)
def play(
    scenario: tuple[str, ...], out: Path, tags: tuple[str, ...], seed: int | None, jobs: int, **way: Any
) -> None:
    """Play scenarios, and judge what the gateway makes of them.

    SCENARIO is a file, a folder of files, or the name of one that ships (`gateway hil list`). None: all that ship.

    \b
    nothing more            vehicle and gateway in memory, in virtual time: minutes take seconds
    --can vcan0             simulated nodes on a real bus, and the gateway as the program that runs on your vehicle
    --can can0 --mavlink E  a real autopilot or its simulator; only ESCs and sensors are simulated
    --bridge can0:can1      in the middle of real hardware: faults change what passes, in flight

    Nothing is put onto a bus that is not virtual without --transmit, nor while an autopilot is armed, or may be.

    Exit code 0: all passed; 1: some did not; 2: some could not be played.
    """
    from drivers.can.port import CanPortError
    from hil_tests.bridge.permission import RefusedError

    console = Console()
    # what was played is told then as well, and nobody plays on
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        how = _way(**way)
        stage = _Stage(_chosen(scenario, tags), out, {} if seed is None else {"seed": seed}, console)
        out.mkdir(parents=True, exist_ok=True)
        try:
            outcomes = stage.at_once(jobs) if how.is_virtual and len(stage.paths) > 1 else stage.in_turn(how)
        except KeyboardInterrupt as error:  # click would end with 1: as if they had been judged
            _report(stage.told, out, console)
            played = f"{len(stage.told)} of {len(stage.paths)}"
            raise _unplayed(f"interrupted; {played} scenarios had been played") from error
        _report(outcomes, out, console)
    except (RefusedError, CanPortError, OSError, ValueError) as error:
        raise _unplayed(_words(error)) from error
    finally:
        signal.signal(signal.SIGTERM, before)
    raise click.exceptions.Exit(_exit_code(outcomes))


def _unplayed(reason: str) -> click.exceptions.Exit:
    click.echo(f"Error: {reason}", err=True)
    return click.exceptions.Exit(UNPLAYED)


def _words(error: Exception) -> str:
    if isinstance(error, OSError) and error.filename is not None:
        return f"{error.filename}: {error.strerror}"
    return str(error)


def _way(*, bridge: str | None, transmit: str | None, while_armed: bool, no_autopilot: bool, **others: Any) -> Way:
    """What the options come to.

    Raises:
        ValueError: one cannot be read, or they do not go together.
    """
    from hil_tests.bridge.options import parse_buses
    from hil_tests.bridge.permission import Granted
    from hil_tests.bridge.transmission import parse_transmission
    from hil_tests.playback.way import Way

    named = None if transmit is None else parse_transmission(transmit)
    buses = None if bridge is None else parse_buses(bridge)
    return Way(bridge=buses, granted=Granted(named, while_armed, no_autopilot), **others)


def _chosen(named: Sequence[str], tags: Sequence[str]) -> list[Path]:
    """The files to play, all of them checked: who waits for an hour does not want to hear of a slip at its end.

    Raises:
        ValueError: there is no such scenario, none with these tags, or one of them has problems.
    """
    from hil_tests.playback.scenario_commands import problems_in
    from hil_tests.scenario.loading import load_scenario
    from hil_tests.scenario.shelf import scenario_files

    paths = scenario_files(named)
    problems = list(problems_in(paths))
    if problems:
        raise ValueError("\n".join(problems))
    chosen = [path for path in paths if set(tags) <= set(load_scenario(path).tags)]
    if not chosen:
        raise ValueError(f"none of {len(paths)} scenarios has the tags {', '.join(tags)}")
    return chosen


@dataclass(frozen=True, slots=True)
class _Stage:
    """Where scenarios are played, and told of while they are.

    Attributes:
        told: what came of those that have come to their end.
    """

    paths: Sequence[Path]
    out: Path
    changes: dict[str, Any]
    console: Console
    told: list[Outcome] = field(default_factory=list)

    def at_once(self, jobs: int) -> list[Outcome]:
        """In virtual time, several at a time."""
        from hil_tests.playback.batch import Job, play_jobs

        work = [Job(path, folder, self.changes) for path, folder in self._folders().items()]
        with self._bar(len(work)) as (bar, task):

            def done(outcome: Outcome) -> None:
                bar.advance(task)
                self._tell(outcome, bar.console)

            return play_jobs(work, jobs, done)

    def in_turn(self, way: Way) -> list[Outcome]:
        """One after the other: in real time, or where there is but one."""
        from hil_tests.playback.play import play_file
        from hil_tests.scenario.loading import load_scenario

        outcomes = []
        for path, folder in self._folders().items():
            with self._bar(load_scenario(path).duration_s, path.stem) as (bar, task):

                def show(since_s: float, bar: Progress = bar, task: TaskID = task) -> None:
                    bar.update(task, completed=since_s)

                outcomes.append(play_file(path, folder, way, show, self.changes))
            self._tell(outcomes[-1], self.console)
        return outcomes

    def _folders(self) -> dict[Path, Path]:
        """Each scenario's own, by its file; of one name there may be several, in different folders."""
        folders: dict[Path, Path] = {}
        for path in self.paths:
            names = chain([path.stem], (f"{path.stem}-{number}" for number in count(2)))
            folders[path] = next(one for name in names if (one := self.out / name) not in folders.values())
        return folders

    @contextmanager
    def _bar(self, total: float, what: str = "scenarios") -> Iterator[tuple[Progress, TaskID]]:
        columns = TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn()
        hidden = not self.console.is_terminal
        with Progress(*columns, console=self.console, transient=True, disable=hidden) as bar:
            yield bar, bar.add_task(what, total=total)

    def _tell(self, outcome: Outcome, console: Console) -> None:
        self.told.append(outcome)
        from hil_tests.report.table import line_of

        console.print(line_of(outcome), highlight=False, soft_wrap=True)


def _report(outcomes: Sequence[Outcome], out: Path, console: Console) -> None:
    """What came of them, as a page, for CI, and as a table."""
    from hil_tests.report.html import write_report
    from hil_tests.report.junit import write_junit
    from hil_tests.report.table import table_of

    write_report(outcomes, out / REPORT)
    write_junit(outcomes, out / JUNIT)
    console.print(table_of(outcomes))
    console.print(f"report: {out / REPORT}", highlight=False, markup=False, soft_wrap=True)


def _exit_code(outcomes: Sequence[Outcome]) -> int:
    from hil_tests.report.expectations import passed

    if any(outcome.broken is not None for outcome in outcomes):
        return UNPLAYED
    return PASSED if all(map(passed, outcomes)) else FAILED
