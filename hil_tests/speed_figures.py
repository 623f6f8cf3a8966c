"""Figures like those of paper 002: its simulation (1, 2 and 3) and its blimp (11)."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from hil_tests.speed_traces import SpeedTrace
from hil_tests.speed_trials import SpeedTrial

TRUE, LEARNT, NORMAL, FAULT = "black", "tab:blue", "tab:green", "tab:red"


def figure(ocean: SpeedTrial, of_ocean: SpeedTrace, blimp: SpeedTrial, of_blimp: SpeedTrace) -> Figure:
    """Way, errors, speed and flags of the simulation; speed and flags of the blimp."""
    result = Figure(figsize=(15.0, 11.0), layout="constrained")
    grid = result.add_gridspec(4, 3, height_ratios=(2.0, 1.0, 2.0, 1.0))
    _draw_way(result.add_subplot(grid[:2, 0]), ocean, of_ocean)
    _draw_localisation_error(result.add_subplot(grid[:2, 1]), of_ocean)
    _draw_speed(result.add_subplot(grid[0, 2]), ocean, of_ocean, "figure 2: simulation")
    _draw_flag(result.add_subplot(grid[1, 2]), ocean, of_ocean)
    for column, axis in enumerate(("first", "second")):
        title = f"figure 3: {axis} component's parameters"
        _draw_parameters(result.add_subplot(grid[2:, column]), ocean, of_ocean, column, title)
    _draw_speed(result.add_subplot(grid[2, 2]), blimp, of_blimp, "figure 11: blimp")
    _draw_flag(result.add_subplot(grid[3, 2]), blimp, of_blimp)
    return result


def _draw_way(axes: Axes, trial: SpeedTrial, trace: SpeedTrace) -> None:
    true = np.array([(sample.north_m, sample.east_m) for sample in trial.samples])
    learnt = true - trace.localisation_error_m
    axes.plot(*true.T, color=TRUE, lw=2.0, label="true")
    axes.plot(*learnt.T, color=FAULT, lw=1.0, ls="--", label="learnt")
    arrows = slice(None, None, max(1, len(true) // 40))
    axes.quiver(
        *true[arrows].T, *trace.flow_mps[arrows].T, color=LEARNT, width=0.004, angles="xy", label="learnt flow"
    )
    axes.set(title="figure 1a: way", xlabel="first coordinate, m", ylabel="second coordinate, m")
    axes.set_aspect("equal", adjustable="datalim")
    axes.legend(loc="upper left")


def _draw_localisation_error(axes: Axes, trace: SpeedTrace) -> None:
    axes.plot(trace.time_s, np.linalg.norm(trace.localisation_error_m, axis=1), color=LEARNT)
    axes.set(title="figure 1b: error of the learnt way", xlabel="time, s", ylabel="m")
    axes.grid(alpha=0.3)


def _draw_parameters(axes: Axes, trial: SpeedTrial, trace: SpeedTrace, component: int, title: str) -> None:
    if trial.true_flow is None:
        raise ValueError(f"trial {trial.name}: want one whose flow is of the basis")
    errors = trial.true_flow.parameters[component] - trace.parameters[:, component]
    axes.plot(trace.time_s, errors, label=[f"i = {number + 1}" for number in range(errors.shape[1])])
    axes.axhline(0.0, color="black", lw=0.6)
    axes.set(title=title, xlabel="time, s", ylabel="true - learnt, m/s")
    axes.grid(alpha=0.3)
    axes.legend()


def _draw_speed(axes: Axes, trial: SpeedTrial, trace: SpeedTrace, title: str) -> None:
    axes.plot(trace.time_s, trial.speed_mps, color=TRUE, lw=1.0, label="true")
    axes.plot(trace.time_s, trace.speed_mps, color=LEARNT, label="learnt")
    for bound, label in ((trial.config.speed_min_mps, "normal range"), (trial.config.speed_max_mps, None)):
        if bound is not None:
            axes.axhline(bound, color=NORMAL, lw=1.0, label=label)
    axes.axvline(trial.fault_s, color=FAULT, lw=0.8, ls=":")
    axes.set(title=title, ylabel="speed, m/s")
    axes.legend(fontsize="small")


def _draw_flag(axes: Axes, trial: SpeedTrial, trace: SpeedTrace) -> None:
    axes.step(trace.time_s, trace.flag, where="post", color=LEARNT)
    axes.axvline(trial.fault_s, color=FAULT, lw=0.8, ls=":")
    axes.set(xlabel="time, s", ylabel="flag", yticks=(0, 1, 2), ylim=(-0.2, 2.2))
