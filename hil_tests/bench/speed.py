"""`gateway bench speed`: the speed detector's estimators side by side, on random missions and on recordings."""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import get_args

import click
from rich.console import Console

from detectors.speed.config import EstimatorName
from hil_tests.bench.figures import console_beside, shared_options, write
from hil_tests.bench.speed_detection import Finding, Score, score
from hil_tests.bench.speed_tables import errors_table, found_table, missions_table
from hil_tests.bench.speed_ways import FINE, MISSIONS, RECORDED, judge_mission, judge_recording
from hil_tests.missions import KINDS, Style
from hil_tests.missions.water import WaterKind
from hil_tests.paper_experiments import Row
from hil_tests.processes import processes, results
from hil_tests.speed_experiments import blimp_rows, simulation_rows
from hil_tests.speed_experiments import table as paper_table

ESTIMATORS: tuple[EstimatorName, ...] = get_args(EstimatorName)
DATA = Path(__file__).parents[3] / "shared" / "data"
NOISE_BANDS_M = ((0.0, 0.3), (0.3, 1.0), (1.0, inf))
# How much the way after the onset tells of the speed, by the time that an ideal observer needs.
EXCITED = (("ideal to 15 s", 0.0, 15.0), ("ideal 15 to 45 s", 15.0, 45.0), ("ideal later, never", 45.0, inf))
TARGET = (
    "target: no FAULT in a healthy mission; with excitation, a 30 % loss found in 95 %, median below 15 s at 10 Hz "
    "and 0.1 m. Time to find: where nothing was found, or a FAULT came before, it counts as for ever. ideal: median "
    "time that an observer takes who knows heading, noise and the instant of a change, but not what has changed"
)


@dataclass(frozen=True, slots=True)
class Options:
    """What is measured.

    Attributes:
        missions: so many healthy, so many with a loss, so many with a loss and fine sensors.
        first_seed, style: of them. loss: of speed.
        only: estimators; none: all.
        recordings: folder with those of `RECORDED`; what is not there is left out.
        paper_seeds: noises of the blimp test of paper 002, which is rebuilt with its simulation; 0: neither.
    """

    missions: int = 8
    first_seed: int = 0
    style: Style = "plain"
    loss: float = 0.3
    only: tuple[EstimatorName, ...] = ()
    recordings: Path = DATA
    paper_seeds: int = 3

    @property
    def estimators(self) -> tuple[EstimatorName, ...]:
        """Those to be measured."""
        return self.only or ESTIMATORS


@dataclass(frozen=True, slots=True)
class Figures:
    """All that was measured.

    Attributes:
        options: what was measured.
        estimators: by name of the set of ways, a score for each estimator.
        by_kind: by estimator, scores for kinds of courses, bands of noise and so on.
        paper: lines of the table of paper 002's experiments.
        findings: what the scores sum up, so that a single way can be looked into.
    """

    options: Options
    estimators: dict[str, list[Score]]
    by_kind: dict[str, list[Score]]
    paper: list[Row]
    findings: list[Finding]


def measure(options: Options, jobs: int, console: Console) -> Figures:
    """Measures, and prints the tables."""
    with processes(jobs) as pool:
        findings = _judge_all(pool, options)
        rows = _rebuild_paper(pool, options.paper_seeds)
    groups = list(dict.fromkeys(one.group for one in findings))
    estimators = {group: _by_estimator(options, [one for one in findings if one.group == group]) for group in groups}
    names: tuple[str, ...] = options.estimators
    by_kind = {name: by_kind_of_mission([one for one in findings if one.estimator == name]) for name in names}
    for table in (found_table, errors_table):
        console.print(table(estimators))
    if options.missions:
        console.print(missions_table(names[0], by_kind[names[0]]), f"[dim]{TARGET}[/dim]")
        console.print(_to_look_into(names[0], findings), soft_wrap=True)
    if rows:
        console.print(paper_table(rows))
    return Figures(options, estimators, by_kind, rows, findings)


@click.command(short_help="Speed and flow: four estimators, missions, recordings.")
@click.option(
    "--missions", type=click.IntRange(min=0), default=Options().missions, show_default=True,
    help="Random missions: so many healthy, so many with a loss of speed, so many of these seen at 10 Hz and 0.1 m. "
    "1000 is the whole target.",
)  # fmt: skip
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of the first mission.")
@click.option(
    "--style", type=click.Choice(get_args(Style)), default="plain", show_default=True,
    help="plain: the target's wording; rough: also gaps, outliers, jumps, currents that set in, ...",
)  # fmt: skip
@click.option(
    "--loss", type=click.FloatRange(0.0, 1.0, min_open=True, max_open=True), default=Options().loss,
    show_default=True, help="Of speed, relative.",
)  # fmt: skip
@click.option("--only", type=click.Choice(ESTIMATORS), multiple=True, help="Only this estimator (repeatable).")
@click.option(
    "--recordings", type=click.Path(path_type=Path, file_okay=False), default=DATA, show_default=False,
    help="Folder with kvlcc2 and snapir; what is not there is left out. [default: ../shared/data beside the project]",
)  # fmt: skip
@click.option(
    "--paper", "paper_seeds", type=click.IntRange(min=0), default=Options().paper_seeds, show_default=True,
    help="Noises for the paper's blimp test, which is rebuilt with its simulation; 0 for neither.",
)  # fmt: skip
@shared_options
def speed(
    *,
    missions: int,
    seed: int,
    style: Style,
    loss: float,
    only: tuple[EstimatorName, ...],
    recordings: Path,
    paper_seeds: int,
    jobs: int,
    json_file: str | None,
) -> None:
    """Compare the speed detector's estimators, the paper's among them, on the same random missions and recordings."""
    options = Options(missions, seed, style, loss, only, recordings, paper_seeds)
    write({"speed": measure(options, jobs, console_beside(json_file))}, json_file)


def by_kind_of_mission(findings: list[Finding]) -> list[Score]:
    """One estimator's scores for each kind of course and of water, each band of noise, and with fine sensors."""
    drawn = [one for one in findings if one.group == MISSIONS]
    parts = {
        **{kind: [one for one in drawn if one.kind == kind] for kind in KINDS},
        **{f"{water} flow": [one for one in drawn if one.water == water] for water in get_args(WaterKind)},
        **{_band(low, high): [one for one in drawn if low <= one.noise_m < high] for low, high in NOISE_BANDS_M},
        **{
            name: [one for one in drawn if one.loss and low_s < _ideal_s(one) <= high_s]
            for name, low_s, high_s in EXCITED
        },
        FINE: [one for one in findings if one.group == FINE],
    }
    return [score(name, part) for name, part in parts.items() if part]


def _band(low_m: float, high_m: float) -> str:
    return f"noise from {low_m:g} m" if high_m == inf else f"noise {low_m:g} to {high_m:g} m"


def _to_look_into(estimator: str, findings: list[Finding]) -> str:
    """Seeds of the missions that went wrong."""
    own = [one for one in findings if one.estimator == estimator and one.group == MISSIONS]
    alarmed = sorted({one.seed for one in own if one.alarms})
    missed = sorted({one.seed for one in own if one.loss and not one.alarms and one.delay_s is None})
    return f"seeds with a false FAULT: {_listed(alarmed)}; with a loss not found: {_listed(missed)}"


def _listed(seeds: list[int]) -> str:
    return ", ".join(map(str, seeds)) or "none"


def _ideal_s(finding: Finding) -> float:
    return inf if finding.ideal_s is None else finding.ideal_s


def _by_estimator(options: Options, findings: list[Finding]) -> list[Score]:
    return [score(name, (one for one in findings if one.estimator == name)) for name in options.estimators]


def _judge_all(pool: ProcessPoolExecutor, options: Options) -> list[Finding]:
    seeds = range(options.first_seed, options.first_seed + options.missions)
    futures = [
        pool.submit(judge_mission, name, seed, options.style, options.loss)
        for seed in seeds
        for name in options.estimators
    ]
    futures += [
        pool.submit(judge_recording, estimator, name, path, water)
        for estimator in options.estimators
        for name, recorded in RECORDED.items()
        for path in sorted(options.recordings.glob(recorded.pattern))
        for water in recorded.waters
    ]
    return [finding for findings in results(futures, "speed runs") for finding in findings]


def _rebuild_paper(pool: ProcessPoolExecutor, seeds: int) -> list[Row]:
    """Lines of the table of paper 002's experiments."""
    futures = [pool.submit(simulation_rows), pool.submit(blimp_rows, range(seeds))] if seeds else []
    return [row for rows in results(futures, "paper 002") for row in rows]
