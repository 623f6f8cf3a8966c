"""`gateway bench thruster`: the thruster detector beside its peers on random runs, and paper 000's figures."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from typing import get_args

import click
from rich.console import Console

from hil_tests.bench.figures import console_beside, shared_options, write
from hil_tests.bench.tables import detection_table
from hil_tests.bench.thruster_detection import CONTENDERS, Finding, Score, judge, score
from hil_tests.paper_experiments import Row, Run, run
from hil_tests.paper_experiments import rows as paper_rows
from hil_tests.paper_experiments import table as paper_table
from hil_tests.paper_trials import TRIALS
from hil_tests.processes import processes, results
from hil_tests.random_runs import Style

TARGET = "target: no alarm in a healthy run; 7 % found in 95 % of the runs within 20 samples, 3 % in half within 100"


@dataclass(frozen=True, slots=True)
class Options:
    """What is measured.

    Attributes:
        runs: so many healthy, and so many with each loss; first_seed: of the first. style: of them.
        only: contenders; none: all.
        paper_seeds: simulations of each of the paper's experiments.
    """

    runs: int = 12
    first_seed: int = 0
    style: Style = "plain"
    only: tuple[str, ...] = ()
    paper_seeds: int = 3


@dataclass(frozen=True, slots=True)
class Figures:
    """All that was measured; `findings` is what `detection` sums up, so that a single run can be looked into."""

    options: Options
    detection: list[Score]
    paper: list[Row]
    findings: list[Finding]


def measure(options: Options, jobs: int, console: Console) -> Figures:
    """Measures, and prints the tables."""
    chosen = available(options.only or tuple(CONTENDERS), console) if options.runs else []
    with processes(jobs) as pool:
        findings = _detect(pool, chosen, options)
        rows = _rebuild_paper(pool, range(options.paper_seeds))
    detection = [score(name, findings) for name in chosen]
    if detection:
        console.print(detection_table(detection, options.style), f"[dim]{TARGET}[/dim]")
    if rows:
        console.print(paper_table(rows, options.paper_seeds))
    return Figures(options, detection, rows, findings)


@click.command(short_help="Thruster faults: ours beside its peers.")
@click.option(
    "--runs", type=click.IntRange(min=0), default=Options().runs, show_default=True,
    help="Random runs: so many healthy, so many with a 7 % loss of speed, so many with 3 %. 200 is the whole target.",
)  # fmt: skip
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of the first run.")
@click.option(
    "--style", type=click.Choice(get_args(Style)), default="plain", show_default=True,
    help="plain: the target's wording; varied: also correlated noise, quantised speeds, ...",
)  # fmt: skip
@click.option("--only", type=click.Choice(list(CONTENDERS)), multiple=True, help="Only this detector (repeatable).")
@click.option(
    "--paper", "paper_seeds", type=click.IntRange(min=0), default=Options().paper_seeds, show_default=True,
    help="Simulations of each of the paper's three experiments, for its own figures beside ours.",
)  # fmt: skip
@shared_options
def thruster(
    *,
    runs: int,
    seed: int,
    style: Style,
    only: tuple[str, ...],
    paper_seeds: int,
    jobs: int,
    json_file: str | None,
) -> None:
    """Compare the thruster detector with its peers, on the same random runs.

    The peers river and PyOD come with: pip install 'thruster-gateway[bench]'
    """
    options = Options(runs, seed, style, only, paper_seeds)
    write({"thruster": measure(options, jobs, console_beside(json_file))}, json_file)


def available(names: Sequence[str], console: Console) -> list[str]:
    """Those whose package is installed; says which are left out, and the way out."""
    missing = [name for name in names if not CONTENDERS[name].available]
    if missing:
        packages = " and ".join(sorted({CONTENDERS[name].package for name in missing}))
        console.print(
            f"left out, for {packages} cannot be found: {', '.join(missing)}. "
            "To have them: pip install 'thruster-gateway[bench]'",
            style="yellow", markup=False, highlight=False,
        )  # fmt: skip
    return [name for name in names if name not in missing]


def paper_run(number: int, seed: int) -> Run:
    """One of the paper's experiments (0, 1, 2), simulated with this seed, under its online and its fixed model."""
    return run(TRIALS[number](seed), seed=seed)


def _detect(pool: ProcessPoolExecutor, names: Sequence[str], options: Options) -> list[Finding]:
    seeds = range(options.first_seed, options.first_seed + options.runs)
    futures = [pool.submit(judge, name, seed, options.style) for seed in seeds for name in names]
    return [finding for findings in results(futures, "thruster runs") for finding in findings]


def _rebuild_paper(pool: ProcessPoolExecutor, seeds: range) -> list[Row]:
    """Lines of the table of paper 000's experiments, each simulated with every seed."""
    futures = [pool.submit(paper_run, number, seed) for number in range(len(TRIALS)) for seed in seeds]
    runs = results(futures, "paper 000")
    by_experiment = [runs[start : start + len(seeds)] for start in range(0, len(runs), max(len(seeds), 1))]
    return [row for number, of_one in enumerate(by_experiment) for row in paper_rows(number, of_one)]
