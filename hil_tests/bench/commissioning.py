"""`gateway bench commissioning`: what is learnt from healthy dives, beside the truth and in dives not learnt from."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import click
from rich.console import Console
from rich.table import Table

from hil_tests.bench.commissioning_navigation import NavigationFigures, judge_navigation
from hil_tests.bench.commissioning_speed import SpeedRow, judge_speeds
from hil_tests.bench.figures import console_beside, shared_options, write
from hil_tests.bench.navigation_cases import Recorded
from hil_tests.bench.navigation_scores import Found
from hil_tests.processes import processes

DATA = Path(__file__).parents[3] / "shared" / "data"


@dataclass(frozen=True, slots=True)
class Options:
    """What is measured.

    Attributes:
        missions: random ones, for the speed.
        dives: recorded ones of which each is left out in turns, for navigation.
        recordings: folder with `kvlcc2` and `snapir`; what is not there is left out.
    """

    missions: int = 16
    dives: int = 4
    recordings: Path = DATA


@dataclass(frozen=True, slots=True)
class Figures:
    """All that was measured; `navigation`: None without recordings."""

    speed: list[SpeedRow]
    navigation: NavigationFigures | None


def measure(options: Options, jobs: int, console: Console) -> Figures:
    """Measures, and prints the tables."""
    sources = [Recorded(path) for path in sorted((options.recordings / "snapir").glob("*.npz"))]
    with processes(jobs) as pool:
        speed = judge_speeds(pool, options.missions, "plain", options.recordings)
        several = len(sources) > 1 and options.dives > 0
        navigation = judge_navigation(pool, sources, options.dives) if several else None
    console.print(speed_table(speed))
    if navigation is not None:
        console.print(foreseen_table(navigation))
        console.print(detection_table(navigation))
    return Figures(speed, navigation)


def speed_table(rows: list[SpeedRow]) -> Table:
    """One line for each group of ways."""
    table = Table(title="Normal speed learnt from one healthy way, against the true one")
    for heading in (
        "ways",
        "number",
        "refused",
        "error,\nmedian",
        "greatest",
        "error\nclaimed",
        "within\ntwice that",
    ):
        table.add_column(heading, justify="left" if heading == "ways" else "right")
    for row in rows:
        shares = (row.median, row.greatest, row.claimed)
        cells = [*(f"{100.0 * one:.1f} %" for one in shares), f"{100.0 * row.within:.0f} %"]
        table.add_row(row.group, str(row.ways), str(row.refused), *cells)
    return table


def foreseen_table(figures: NavigationFigures) -> Table:
    """One line for each settings."""
    table = Table(title=f"DVL in dives that nothing was learnt from, medians of {figures.foreseen[0].dive}")
    for heading in ("settings", "innovation,\nfirst 100 s", "whole dive", "surprise"):
        table.add_column(heading, justify="left" if heading == "settings" else "right")
    for one in figures.foreseen:
        table.add_row(one.settings, f"{one.beginning_mps:.3f} m/s", f"{one.whole_mps:.3f} m/s", f"{one.surprise:.2f}")
    return table


def detection_table(figures: NavigationFigures) -> Table:
    """False alarms and faults found, one line for each settings."""
    first = next(iter(figures.found.values()))
    table = Table(title="Faults in dives that nothing was learnt from: found, and median seconds")
    table.add_column("settings")
    for heading in ("false\nalarms", *(one.case for one in first)):
        table.add_column(heading, justify="right")
    for name, found in figures.found.items():
        healthy = figures.healthy[name]
        table.add_row(name, f"{healthy.events} in {healthy.hours:.2f} h", *map(_cell, found))
    return table


def _cell(one: Found) -> str:
    median = "-" if one.median_s is None else f"{one.median_s:.1f} s"
    return f"{one.found} of {one.trials}, {median}"


@click.command(short_help="What is learnt from healthy dives, beside the truth.")
@click.option("--missions", type=click.IntRange(min=0), default=Options().missions, show_default=True, help="Random.")
@click.option(
    "--dives", type=click.IntRange(min=0), default=Options().dives, show_default=True, help="Recordings left out."
)
@click.option(
    "--recordings", type=click.Path(path_type=Path, file_okay=False), default=DATA, show_default=False,
    help="Folder with recordings. [default: ../shared/data beside the project]",
)  # fmt: skip
@shared_options
def commissioning(*, missions: int, dives: int, recordings: Path, jobs: int, json_file: str | None) -> None:
    """Compare what gateway commission learns with the truth, and with the defaults in dives not learnt from."""
    options = Options(missions, dives, recordings)
    write({"commissioning": measure(options, jobs, console_beside(json_file))}, json_file)
