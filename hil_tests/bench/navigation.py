"""`gateway bench navigation`: the navigation detector beside the methods of paper 003, on recordings and dives."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import get_args

import click
from rich.console import Console

from detectors.navigation import NavigationDetector, Sensor
from detectors.navigation.config import MethodName
from hil_tests.bench.figures import console_beside, shared_options, write
from hil_tests.bench.navigation_measure import (
    METHODS,
    RECORDINGS,
    Group,
    Options,
    Rate,
    group_of,
    judge_all,
    judge_paper,
    judge_positions,
    judge_slow,
    rates_of,
)
from hil_tests.bench.navigation_paper import PaperScore
from hil_tests.bench.navigation_pictures import draw
from hil_tests.bench.navigation_positions import errors_m
from hil_tests.bench.navigation_scores import named
from hil_tests.bench.navigation_tables import (
    alarms_table,
    found_table,
    named_table,
    paper_table,
    places_table,
    positions_table,
    rates_table,
)
from hil_tests.bench.navigation_timing import navigation_watch
from hil_tests.bench.navigation_trace import MakeWatch
from hil_tests.bench.tables import timing_table
from hil_tests.bench.timing import Timing
from hil_tests.bench.timing import measure as measure_time
from hil_tests.dives import Style
from hil_tests.processes import processes, results

NOTE = (
    "own: the method's threshold as it stands; x: the multiple of it at which it has no more false alarms an hour "
    "than the default with its own, set on all other dives than the one judged. 16 st.: on the paper's filter, which "
    "learns nothing of the mounting. Cells: share found, median seconds; what is not found, or was in alarm "
    "before, counts as for ever"
)


@dataclass(frozen=True, slots=True)
class Figures:
    """All that was measured.

    Attributes:
        options: what was measured.
        groups: recordings, random dives.
        named: by group and faulty sensor, how often which sensor was named first.
        paper: paper 003's protocol, on the recordings.
        positions: last and greatest error of each dive, by variant.
        rates: slower IMUs.
        cost: of a second of data, beside a plain filter.
    """

    options: Options
    groups: list[Group]
    named: dict[str, Mapping[Sensor, Counter[str]]]
    paper: list[PaperScore]
    positions: dict[str, list[tuple[float, float]]]
    rates: list[Rate]
    cost: Timing


def measure(
    options: Options,
    jobs: int,
    console: Console,
    folder: Path | None = None,
    make: MakeWatch = NavigationDetector,
) -> Figures:
    """Measures, and prints the tables.

    Args:
        folder: for figures; None: none are drawn.
        make: makes the detector.
    """
    with processes(jobs) as pool:
        judged = judge_all(pool, options, make)
        paper = judge_paper(pool, options, make, judged)
        slow = judge_slow(pool, options, make)
        ways = judge_positions(pool, options, make)
        pictures = draw(folder, pool, options, make, ways) if folder is not None else []
    with processes(1) as pool:  # alone: nothing else shall slow down one side of a ratio
        (timing,) = results([pool.submit(_time)], "cost")
    by_group = {
        name: [one for one in judged if one.group == name] for name in dict.fromkeys(one.group for one in judged)
    }
    figures = Figures(
        options=options,
        groups=[group_of(name, options, part) for name, part in by_group.items()],
        named={name: named(part) for name, part in by_group.items()},
        paper=paper,
        positions=errors_m(ways),
        rates=rates_of(options, judged, slow),
        cost=timing,
    )
    show(figures, console)
    for picture in pictures:
        console.print(f"drawn: {picture}", soft_wrap=True)
    return figures


def show(figures: Figures, console: Console) -> None:
    """Prints the tables."""
    if figures.groups:
        console.print(alarms_table({group.name: group.healthy for group in figures.groups}), f"[dim]{NOTE}[/dim]")
    for group in figures.groups:
        console.print(found_table(f"{group.name}, all at one rate of false alarms", group.found))
        console.print(found_table(f"{group.name}, at the methods' own thresholds", group.own))
        console.print(places_table(group.name, group.straight, group.turning))
    if figures.groups:
        console.print(named_table(figures.named))
    if figures.paper:
        console.print(paper_table(figures.paper))
    if figures.positions:
        console.print(positions_table(figures.positions))
    if figures.rates:
        console.print(rates_table(figures.rates))
    console.print(timing_table([figures.cost]))


def _time() -> Timing:
    return measure_time(navigation_watch())


@click.command(short_help="Navigation sensors: four methods, recordings, random dives.")
@click.option(
    "--runs", type=click.IntRange(min=0), default=Options().runs, show_default=True, help="Random dives of 400 s."
)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of the first dive.")
@click.option(
    "--style", type=click.Choice(get_args(Style)), default="plain", show_default=True,
    help="plain: all sensors work; rough: gaps, single wrong and lost samples, with nothing broken.",
)  # fmt: skip
@click.option(
    "--only", type=click.Choice(METHODS), multiple=True, help="Only this method and the default (repeatable)."
)
@click.option(
    "--recordings", type=click.Path(path_type=Path, file_okay=False), default=RECORDINGS, show_default=False,
    help="Folder with recordings (.npz). [default: ../shared/data/snapir beside the project]",
)  # fmt: skip
@click.option(
    "--plain/--no-plain", default=True, show_default=True, help="Chi-square and CUSUM on the paper's filter, too."
)
@click.option(
    "--both", is_flag=True, help="Each fault on a straight leg and in a turn, not in turns the one or other."
)
@click.option("--slow/--no-slow", default=True, show_default=True, help="With slower IMUs, too.")
@click.option(
    "--folds", type=click.Path(path_type=Path, file_okay=False, exists=True),
    help="Folder of LSTMs that have not seen the recording which they are named after: gateway train leave-one-out "
    "makes it. [default: the LSTM that ships, which has seen all]",
)  # fmt: skip
@click.option(
    "--positions", type=click.IntRange(min=0), default=Options().positions, show_default=True,
    help="Dives of 1000 s with a DVL that fails five times.",
)  # fmt: skip
@click.option("--figures", "folder", type=click.Path(path_type=Path, file_okay=False), help="Folder for two figures.")
@shared_options
def navigation(
    *,
    runs: int,
    seed: int,
    style: Style,
    only: tuple[MethodName, ...],
    recordings: Path,
    plain: bool,
    both: bool,
    slow: bool,
    folds: Path | None,
    positions: int,
    folder: Path | None,
    jobs: int,
    json_file: str | None,
) -> None:
    """Compare the navigation detector with the three methods of paper 003, with faults put into healthy dives."""
    options = Options(runs, seed, style, recordings, only, plain, both, slow, folds, positions)
    write({"navigation": measure(options, jobs, console_beside(json_file), folder)}, json_file)
