"""The command `gateway bench`: ours against the peers, side by side, in one run."""

from __future__ import annotations

import json
import os
import platform
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from importlib.metadata import version
from multiprocessing import get_context
from pathlib import Path
from typing import TypeVar, get_args

import click
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from hil_tests.bench.detection import CONTENDERS, Finding, Score, judge, score
from hil_tests.bench.speed import Timing
from hil_tests.bench.tables import detection_table, speed_table
from hil_tests.bench.works import WORKS, paper_run, time_work
from hil_tests.paper_experiments import Row
from hil_tests.paper_experiments import rows as paper_rows
from hil_tests.paper_experiments import table as paper_table
from hil_tests.paper_trials import TRIALS
from hil_tests.random_runs import Style

DEFAULT_RUNS = 12
# Libraries of linear algebra start a thread per core, for matrices that are far too small for it; the runs are what
# is spread over the cores. Read when numpy is loaded, hence set before the processes start.
ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS"), "1")
TARGET = "target: no alarm in a healthy run; 7 % found in 95 % of the runs within 20 samples, 3 % in half within 100"
T = TypeVar("T")


@dataclass(frozen=True, slots=True)
class Results:
    """All that was measured; `findings` is what `detection` sums up, so that a single run can be looked into."""

    runs: int
    first_seed: int
    style: Style
    detection: list[Score]
    speed: list[Timing]
    paper: list[Row]
    findings: list[Finding]


@click.command()
@click.option(
    "--runs", type=click.IntRange(min=0), default=DEFAULT_RUNS, show_default=True,
    help="Random runs: so many healthy, so many with a 7 % loss of speed, so many with 3 %. 200 is the whole target.",
)  # fmt: skip
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of the first run.")
@click.option(
    "--style", type=click.Choice(get_args(Style)), default="plain", show_default=True,
    help="plain: the target's wording; varied: also correlated noise, quantised speeds, ...",
)  # fmt: skip
@click.option("--only", type=click.Choice(list(CONTENDERS)), multiple=True, help="Only this detector (repeatable).")
@click.option("--speed/--no-speed", default=True, show_default=True, help="Time our code beside the peers' as well.")
@click.option(
    "--paper", "paper_seeds", type=click.IntRange(min=0), default=3, show_default=True,
    help="Simulations of each of the paper's three experiments, for its own figures beside ours.",
)  # fmt: skip
@click.option("--jobs", type=click.IntRange(min=1), default=os.cpu_count() or 1, show_default=True, help="Processes.")
@click.option("--json", "json_file", type=click.Path(dir_okay=False, allow_dash=True), help="Write the figures, too.")
def bench(
    *,
    runs: int,
    seed: int,
    style: Style,
    only: tuple[str, ...],
    speed: bool,
    paper_seeds: int,
    jobs: int,
    json_file: str | None,
) -> None:
    """Compare the thruster detector with its peers, on the same random runs, and our code's speed with theirs.

    The peers river and PyOD come with: pip install 'thruster-gateway[bench]'
    """
    console = Console(stderr=json_file == "-")
    chosen = _available(only or tuple(CONTENDERS), console) if runs else []
    with _processes(jobs) as pool:
        findings = _detect(pool, chosen, range(seed, seed + runs), style)
        rows = _rebuild_paper(pool, range(paper_seeds))
    with _processes(1) as pool:  # alone: nothing else shall slow down one side of a ratio
        timings = _time(pool) if speed else []
    detection = [score(name, findings) for name in chosen]
    results = Results(runs, seed, style, detection, timings, rows, findings)
    if detection:
        console.print(detection_table(detection, style), f"[dim]{TARGET}[/dim]")
    if timings:
        console.print(speed_table(timings))
    if rows:
        console.print(paper_table(rows, paper_seeds))
    if json_file is not None:
        _write(results, json_file)


def _available(names: Sequence[str], console: Console) -> list[str]:
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


@contextmanager
def _processes(jobs: int) -> Iterator[ProcessPoolExecutor]:
    """Fresh processes, each with one thread for linear algebra."""
    before = {name: os.environ.get(name) for name in ONE_THREAD}
    os.environ.update(ONE_THREAD)
    try:
        with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
            yield pool
    finally:
        for name, value in before.items():
            os.environ.pop(name)
            if value is not None:
                os.environ[name] = value


def _detect(pool: ProcessPoolExecutor, names: Sequence[str], seeds: range, style: Style) -> list[Finding]:
    futures = [pool.submit(judge, name, seed, style) for seed in seeds for name in names]
    list(_as_they_come(futures, "detection"))
    return [finding for future in futures for finding in future.result()]


def _rebuild_paper(pool: ProcessPoolExecutor, seeds: range) -> list[Row]:
    """Lines of the table of paper 000's experiments, each simulated with every seed."""
    futures = [pool.submit(paper_run, number, seed) for number in range(len(TRIALS)) for seed in seeds]
    list(_as_they_come(futures, "paper"))
    runs = [future.result() for future in futures]
    by_experiment = [runs[start : start + len(seeds)] for start in range(0, len(runs), max(len(seeds), 1))]
    return [row for number, of_one in enumerate(by_experiment) for row in paper_rows(number, of_one)]


def _time(pool: ProcessPoolExecutor) -> list[Timing]:
    futures = [pool.submit(time_work, work) for work in WORKS]
    list(_as_they_come(futures, "speed"))
    return [future.result() for future in futures]


def _as_they_come(futures: Sequence[Future[T]], what: str) -> Iterator[T]:
    """Results in the order in which they are ready, under a progress bar; after an error no more work is begun."""
    columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn()
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        try:
            for future in progress.track(as_completed(futures), total=len(futures), description=what):
                yield future.result()
        except BaseException:
            for future in futures:
                future.cancel()
            raise


def _write(results: Results, file: str) -> None:
    machine = {"python": platform.python_version(), "processors": os.cpu_count(), "architecture": platform.machine()}
    packages = {name: version(name) for name in ("numpy", "scipy", "dronecan", "cantools", "python-can", "pymavlink")}
    text = json.dumps({**asdict(results), "machine": machine, "packages": packages}, indent=2)
    if file == "-":
        click.echo(text)
    else:
        Path(file).write_text(text + "\n", encoding="utf-8")
