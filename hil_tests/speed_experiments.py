"""The simulation and the blimp test of paper 002 rebuilt: its method to the letter, beside the paper's own figures.

`python -m hil_tests.speed_experiments` runs both (`speed_trials`), the simulation also at other sampling rates and
with the law integrated exactly, prints one table and draws figures like the paper's 1, 2, 3 and 11.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import isfinite
from pathlib import Path

import click
import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from hil_tests.paper_experiments import Row
from hil_tests.speed_figures import figure
from hil_tests.speed_traces import (
    SpeedTrace,
    false_alarms,
    found_s,
    judge_exactly,
    judge_to_the_letter,
    kept_share,
    unsettled_until_s,
)
from hil_tests.speed_trials import BLIMP_RANGE, SpeedTrial, blimp_trial, ocean_trial

FloatArray = NDArray[np.float64]

BLIMP_RANGES = (0.05, BLIMP_RANGE, 0.1)
OTHER_RATES_HZ = (50.0, 1.0, 0.2)
SHOWN_S = (0.0, 20.0, 100.0, 300.0)
NOT_THERE = "-"  # what the paper does not show
SHORT = "flag 0 from, samples of 1 before 200 s, flag 1 from"


def simulation_rows() -> list[Row]:
    """The simulation to the letter, with the heading turning evenly as printed and in steps as its words have it."""
    return [row for stepped in (False, True) for row in _simulation_rows(ocean_trial(stepped=stepped))]


def further_rows() -> list[Row]:
    """What the paper does not show: other sampling rates by either integration, and F_M without an outside model."""
    rows = []
    for rate_hz in OTHER_RATES_HZ:
        trial = ocean_trial(rate_hz)
        for how, judge in (("explicit step", judge_to_the_letter), ("integrated exactly", judge_exactly)):
            rows.append(Row(trial.name, f"{how}: {SHORT}", NOT_THERE, _flags_in_short(judge(trial), trial.fault_s)))
    trial = ocean_trial()
    alone = replace(trial, config=replace(trial.config, flow_model=None))
    short = _flags_in_short(judge_to_the_letter(alone), trial.fault_s)
    rows.append(Row(f"{trial.name}, F_M as learnt", f"explicit step: {SHORT}", NOT_THERE, short))
    return rows


def blimp_rows(seeds: Sequence[int]) -> list[Row]:
    """The blimp test, over noises and over normal ranges, which the paper shows without numbers."""
    rows = []
    for half_range in BLIMP_RANGES:
        trials = [blimp_trial(seed, half_range=half_range) for seed in seeds]
        traces = [judge_to_the_letter(trial) for trial in trials]
        name = f"blimp, range +-{100.0 * half_range:.0f} %"
        early = sum(false_alarms(trace, 4.0) for trace in traces)
        rows += [
            Row(name, "thruster disabled at 4 s, flag 1 from, s", "4.43", _spread([found_s(t, 4.0) for t in traces])),
            Row(name, "flag 0 until then from, s", "0", _spread([unsettled_until_s(t, 4.0) for t in traces])),
            Row(name, "samples of flag 1 before", "0", str(early)),
            Row(name, "learnt speed at 4 s, mm/s", "18.5", _spread([1e3 * _at(t, 4.0) for t in traces])),
        ]
    return rows


def table(rows: Sequence[Row]) -> Table:
    """The rows as a table to print."""
    result = Table(title="Paper 002, simulation and blimp test: its figures and ours")
    for column in ("experiment", "quantity", "paper", "here"):
        result.add_column(column, justify="left" if column in ("experiment", "quantity") else "right")
    previous = ""
    for row in rows:
        if previous and row.experiment != previous:
            result.add_section()
        result.add_row(row.experiment if row.experiment != previous else "", row.quantity, row.paper, row.here)
        previous = row.experiment
    return result


@click.command()
@click.option(
    "--seeds", default=5, show_default=True, type=click.IntRange(1), help="Noises of the blimp's positions."
)
@click.option(
    "--out", default="speed_experiments.png", show_default=True, type=click.Path(path_type=Path, dir_okay=False)
)
def main(seeds: int, out: Path) -> None:
    """Rebuild simulation and blimp test of the speed paper and print its figures beside ours."""
    rows = simulation_rows() + further_rows() + blimp_rows(range(seeds))
    Console().print(table(rows))
    ocean, blimp = ocean_trial(), blimp_trial()
    figure(ocean, judge_to_the_letter(ocean), blimp, judge_to_the_letter(blimp)).savefig(out, dpi=100)
    Console().print(f"trajectory, errors, speeds and flags drawn in {out}")


def _simulation_rows(trial: SpeedTrial) -> list[Row]:
    trace = judge_to_the_letter(trial)
    after_mps, end_mps = _at(trace, 199.0), _at(trace, 300.0)
    lines = [
        ("flag 0 until the fault from, s", "about 10", f"{unsettled_until_s(trace, trial.fault_s):.1f}"),
        ("samples of flag 1 before the fault", "0", str(false_alarms(trace, trial.fault_s))),
        ("speed falls at 200 s, flag 1 from, s", "200", f"{found_s(trace, trial.fault_s):.1f}"),
        ("share of flag 1 from there on", "1", f"{kept_share(trace, trial.fault_s):.3g}"),
        ("learnt speed at 199 and 300 s, m/s", "1 and 0.5", f"{after_mps:.3f} and {end_mps:.3f}"),
    ]
    numbers = [_number(trace, time_s) for time_s in SHOWN_S]
    for name, errors in _errors(trial, trace).items():
        at = ", ".join(f"{error:.3f}" for error in errors[numbers])
        lines.append((f"{name}, at {', '.join(f'{s:g}' for s in SHOWN_S)} s", "about 0 from 100 s on", at))
    return [Row(trial.name, *line) for line in lines]


def _errors(trial: SpeedTrial, trace: SpeedTrace) -> dict[str, FloatArray]:
    """(N,) each: how far from the truth the way, the flow where the vehicle is, and the parameters are."""
    errors = {
        "error of the way, m": np.linalg.norm(trace.localisation_error_m, axis=1),
        "of the flow at the vehicle, m/s": np.linalg.norm(trace.flow_mps - trial.flow_mps, axis=1),
    }
    if trial.true_flow is not None:
        apart = np.linalg.norm(trace.parameters - trial.true_flow.parameters, axis=2)
        errors["of the first component's parameters, m/s"] = apart[:, 0]
        errors["of the second component's parameters, m/s"] = apart[:, 1]
    return errors


def _flags_in_short(trace: SpeedTrace, fault_s: float) -> str:
    """What `SHORT` names."""
    settled_s, after_s = unsettled_until_s(trace, fault_s), found_s(trace, fault_s)
    settled = f"{settled_s:.1f} s" if isfinite(settled_s) else "never"
    return f"{settled}, {false_alarms(trace, fault_s)}, {after_s:.1f} s"


def _number(trace: SpeedTrace, time_s: float) -> int:
    return int(np.argmin(np.abs(trace.time_s - time_s)))


def _at(trace: SpeedTrace, time_s: float) -> float:
    return float(trace.speed_mps[_number(trace, time_s)])


def _spread(values: Sequence[float]) -> str:
    known = [value for value in values if np.isfinite(value)]
    if not known:
        return "never"
    return f"{np.median(known):.3g} ({min(known):.3g} to {max(known):.3g}), in {len(known)} of {len(values)}"


if __name__ == "__main__":
    main()
