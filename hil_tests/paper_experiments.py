"""The three experiments of paper 000 rebuilt: the online against the fixed model, beside the paper's own figures.

`python -m hil_tests.paper_experiments` simulates each of them for several seeds (`paper_trials`), runs the paper's
method and its comparison over them with the paper's thresholds, windows and warm-up, prints one table and draws the
figures.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import nan
from pathlib import Path

import click
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from detectors.thruster.paper import FixedPolynomial, OnlinePolynomial, PaperStep
from detectors.thruster.sample import ThrusterSample
from detectors.thruster.search import SearchName
from detectors.verdict import Level
from hil_tests.paper_trials import TRIALS, Fault, Trial
from hil_tests.paper_vehicles import PERIOD_S

FloatArray = NDArray[np.float64]

# The paper gives windows of 50 to 500 and a warm-up of 500; the highest order and the longest delay it leaves open.
ORDER_MAX = 3
DELAY_MAX = 10
# Table 4: MAE in rpm of the online, the new-built online and the fixed model, by experiment.
PAPER_MAE = ((10.54, 0.25, 16.98), (1.70, 0.44, 5.53), (2.91, 0.24, 258.23))
PAPER_RELEARNT = (None, 43, None)  # samples of the fault until its model has been learnt (section 6.3)


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """What a rule said of every sample of a trial.

    Attributes:
        level: (N,) as of `Level`.
        residual_rpm: (N,) by the model in force after the sample.
        forecast_residual_rpm: (N,) by the model in force before it: what a prediction is really worth.
        refitted: (N,) where the model was learnt anew.
    """

    level: NDArray[np.int_]
    residual_rpm: FloatArray
    forecast_residual_rpm: FloatArray
    refitted: NDArray[np.bool_]


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """One trial under both rules."""

    trial: Trial
    online: Trace
    fixed: Trace


@dataclass(frozen=True, slots=True)
class Row:
    """A line of the table: what was measured, in the paper and here."""

    experiment: str
    quantity: str
    paper: str
    here: str


def run(trial: Trial, search: SearchName = "swarm", seed: int = 0) -> Run:
    """Both rules over one trial, with the paper's settings."""
    arguments = {"order_max": ORDER_MAX, "delay_max": DELAY_MAX, "threshold_rpm": trial.threshold_rpm, "seed": seed}
    online = OnlinePolynomial(search=search, **arguments)  # type: ignore[arg-type]
    fixed = FixedPolynomial(search=search, **arguments)  # type: ignore[arg-type]
    return Run(trial, _trace(trial, online), _trace(trial, fixed))


def mae_rpm(trace: Trace) -> float:
    """Mean absolute error of the predictions, of all samples after the warm-up, faulty ones included."""
    return float(np.nanmean(np.abs(trace.forecast_residual_rpm)))


def new_built_mae_rpm(trace: Trace) -> float:
    """Mean absolute residual of newly built models at the sample that they were built for, where they were accepted.

    This is how the table's middle column is read here; the paper does not define it.
    """
    accepted = trace.refitted & (trace.level == Level.NORMAL)
    return float(np.mean(np.abs(trace.residual_rpm[accepted])))


def false_alarms(run: Run, trace: Trace) -> int:
    """Samples of FAULT before anything is broken."""
    healthy = run.trial.faults[0].sample if run.trial.faults else len(trace.level)
    return int(np.count_nonzero(trace.level[:healthy] == Level.FAULT))


def samples_to_finding(trace: Trace, fault: Fault) -> float:
    """Samples from the fault's first to the first new FAULT, both counted (1 = at once); NaN where it is missed."""
    is_fault = trace.level == Level.FAULT
    begins = np.flatnonzero(is_fault[1:] & ~is_fault[:-1]) + 1
    found = begins[(begins >= fault.sample) & (begins < fault.until)]
    return float(found[0] - fault.sample + 1) if len(found) else nan


def samples_to_relearn(trace: Trace, fault: Fault) -> float:
    """Samples from a fault's first until the model that knows it: the last FAULT before anything else happens."""
    faulty = np.flatnonzero(trace.level[fault.sample : fault.until] == Level.FAULT)
    return float(faulty[-1] + 1) if len(faulty) else nan


def rows(experiment: int, runs: Sequence[Run]) -> list[Row]:
    """The table's lines for one experiment (0, 1, 2), from its runs with different seeds."""
    trial = runs[0].trial
    online, new_built, fixed = PAPER_MAE[experiment]
    lines = [
        ("MAE online, rpm", f"{online:.2f}", _spread([mae_rpm(r.online) for r in runs])),
        ("MAE new-built online, rpm", f"{new_built:.2f}", _spread([new_built_mae_rpm(r.online) for r in runs])),
        ("MAE fixed, rpm", f"{fixed:.2f}", _spread([mae_rpm(r.fixed) for r in runs])),
        ("online lower by, %", f"{100 * (1 - online / fixed):.1f}", _spread([_lower_by(r) for r in runs])),
        ("false alarms online", "none", _alarms(runs, lambda r: r.online)),
        ("false alarms fixed", "yes", _alarms(runs, lambda r: r.fixed)),
    ]
    for fault in trial.faults:
        paper = str(fault.found) if fault.found is not None else "found"
        delays = [samples_to_finding(r.online, fault) for r in runs]
        lines.append((f"{fault.name}: found at its sample no.", paper, _found(delays)))
    relearnt = PAPER_RELEARNT[experiment]
    if relearnt is not None:
        again = [samples_to_relearn(r.online, trial.faults[0]) for r in runs]
        lines.append((f"{trial.faults[0].name}: learnt after samples", str(relearnt), _spread(again)))
    return [Row(trial.name, *line) for line in lines]


def table(all_rows: Sequence[Row], seeds: int) -> Table:
    """The rows as a table to print."""
    result = Table(title=f"Paper 000, section 6: its figures and ours (median, least to greatest of {seeds} seeds)")
    for column in ("experiment", "quantity", "paper", "here"):
        result.add_column(column, justify="left" if column in ("experiment", "quantity") else "right")
    previous = ""
    for row in all_rows:
        if previous and row.experiment != previous:
            result.add_section()
        result.add_row(row.experiment if row.experiment != previous else "", row.quantity, row.paper, row.here)
        previous = row.experiment
    return result


def figure(runs: Sequence[Run]) -> Figure:
    """Like the paper's figures 8-10, 12, 13, 15, 17, 19 and 20: a row for each run, residuals over samples."""
    result = Figure(figsize=(17.0, 4.0 * len(runs)), layout="constrained")
    axes = result.subplots(len(runs), 3, squeeze=False)
    for row, one in zip(axes, runs, strict=True):
        _draw_signals(row[0], one.trial)
        _draw_residuals(row[1], one.trial, one.online, "online model")
        _draw_residuals(row[2], one.trial, one.fixed, "fixed model")
    return result


@click.command()
@click.option(
    "--seeds", default=10, show_default=True, type=click.IntRange(1), help="Simulations of each experiment."
)
@click.option("--search", default="swarm", show_default=True, type=click.Choice(["swarm", "exact"]))
@click.option(
    "--out", default="paper_experiments.png", show_default=True, type=click.Path(path_type=Path, dir_okay=False)
)
def main(seeds: int, search: SearchName, out: Path) -> None:
    """Rebuild the three experiments of the thruster paper and print its figures beside ours."""
    experiments = [[run(simulate(seed), search, seed) for seed in range(seeds)] for simulate in TRIALS]
    all_rows = [row for number, runs in enumerate(experiments) for row in rows(number, runs)]
    Console().print(table(all_rows, seeds))
    figure([runs[0] for runs in experiments]).savefig(out, dpi=100)
    Console().print(f"residuals of seed 0 drawn in {out}")


def _trace(trial: Trial, rule: OnlinePolynomial | FixedPolynomial) -> Trace:
    pairs = zip(trial.command.tolist(), trial.speed_rpm.tolist(), strict=True)
    steps: list[PaperStep] = [rule.step(ThrusterSample(i * PERIOD_S, u, v)) for i, (u, v) in enumerate(pairs)]
    return Trace(
        np.array([step.level for step in steps], dtype=np.int_),
        np.array([step.residual_rpm for step in steps]),
        np.array([step.forecast_residual_rpm for step in steps]),
        np.array([step.refitted for step in steps]),
    )


def _lower_by(run: Run) -> float:
    return 100.0 * (1.0 - mae_rpm(run.online) / mae_rpm(run.fixed))


def _spread(values: Sequence[float]) -> str:
    known = [value for value in values if np.isfinite(value)]
    if not known:
        return "-"
    return f"{np.median(known):.4g} ({min(known):.3g} to {max(known):.3g})"


def _alarms(runs: Sequence[Run], trace: Callable[[Run], Trace]) -> str:
    alarmed = sum(false_alarms(r, trace(r)) > 0 for r in runs)
    return f"in {alarmed} of {len(runs)} runs"


def _found(delays: Sequence[float]) -> str:
    found = sum(np.isfinite(delay) for delay in delays)
    return f"{_spread(delays)}, in {found} of {len(delays)} runs"


def _draw_signals(axes: Axes, trial: Trial) -> None:
    axes.plot(trial.speed_rpm, color="tab:blue", linewidth=0.7, label="measured speed, rpm")
    axes.set(title=trial.name, xlabel="sample", ylabel="rpm")
    command = axes.twinx()
    command.plot(trial.command, color="tab:orange", linewidth=0.7, label="command")
    command.set_ylabel("command")
    axes.legend(handles=[*axes.get_lines(), *command.get_lines()], loc="lower left", fontsize="small")
    _mark_faults(axes, trial)


def _draw_residuals(axes: Axes, trial: Trial, trace: Trace, name: str) -> None:
    bound = trial.threshold_rpm
    axes.plot(trace.forecast_residual_rpm, color="tab:blue", linewidth=0.6, label="residual before any update")
    refits = np.flatnonzero(trace.refitted)
    axes.plot(refits, trace.residual_rpm[refits], ".", color="tab:green", markersize=4, label="of a model built here")
    faults = np.flatnonzero(trace.level == Level.FAULT)
    axes.plot(faults, np.full(len(faults), -4.6 * bound), "|", color="tab:red", label="FAULT")
    axes.axhline(bound, color="black", linewidth=0.6, linestyle="--")
    axes.axhline(-bound, color="black", linewidth=0.6, linestyle="--")
    axes.set(
        title=f"{name}, threshold {bound:g} rpm",
        xlabel="sample",
        ylabel="residual, rpm",
        ylim=(-5 * bound, 5 * bound),
    )
    axes.set_xlim(0, len(trial.command))
    axes.legend(loc="upper left", fontsize="small")
    _mark_faults(axes, trial)


def _mark_faults(axes: Axes, trial: Trial) -> None:
    for fault in trial.faults:
        axes.axvline(fault.sample, color="tab:red", linewidth=0.8, linestyle=":")


if __name__ == "__main__":
    main()
