"""The plot of a demonstration's thruster: its speed, prediction, residual, threshold and level over time."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from detectors.verdict import Level
from hil_tests.demo.axes import COLOURS, EVENT, MEASURED, ONSET, PREDICTED, TOLD, WORDS, draw_strip, mark, styled
from hil_tests.demo.record import Judged
from hil_tests.demo.summary import Found


def draw(
    path: Path, history: Sequence[Judged], found: Found, *, start_s: float, lasted_s: float, freed_s: float
) -> None:
    """Write the plot as PNG.

    Args:
        path: of the picture.
        history: what the gateway saw of the thruster and said.
        found: what came of the weeds in it.
        start_s: what is zero on the time axis.
        lasted_s: how long the demonstration ran.
        freed_s: when the weeds were gone again, from the start.
    """
    with styled():
        figure = Figure(figsize=(13.0, 8.5), layout="constrained")
        speed, residual, level = figure.subplots(3, 1, sharex=True, height_ratios=(5, 3.4, 0.7))
        if history:
            _draw_history(speed, residual, level, history, start_s)
        for axes in (speed, residual, level):
            mark(axes, found.trouble.onset_s - start_s, lasted_s, ONSET, "--", "weeds catch")
            mark(axes, found.text_s - start_s, lasted_s, TOLD, "-", "pilot told (STATUSTEXT)")
            mark(axes, freed_s, lasted_s, EVENT, "--", "cut free")
        if speed.get_legend_handles_labels()[0]:
            speed.legend(loc="upper left", ncols=6, framealpha=0.9)
        level.set_xlabel("seconds since the start")
        figure.suptitle(_title(found, start_s), fontsize=14, fontweight="bold")
        figure.savefig(path, dpi=110)


def _draw_history(speed: Axes, residual: Axes, level: Axes, history: Sequence[Judged], start_s: float) -> None:
    time_s = np.array([one.sample.time_s - start_s for one in history])
    measured = np.array([one.sample.speed_rpm for one in history])
    predicted, threshold, off = (
        np.array([getattr(one.verdict, name) for one in history])
        for name in ("predicted_rpm", "threshold_rpm", "residual_rpm")
    )
    judged = np.array([one.verdict.level != Level.UNKNOWN for one in history])
    threshold = np.where(judged, threshold, np.nan)  # nothing is held against it meanwhile
    _draw_speed(speed, time_s, measured, predicted, threshold)
    _draw_residual(residual, time_s, off, threshold)
    draw_strip(level, time_s, [one.verdict.level for one in history], COLOURS, WORDS, "level")


def _draw_speed(
    axes: Axes,
    time_s: NDArray[np.float64],
    measured: NDArray[np.float64],
    predicted: NDArray[np.float64],
    threshold: NDArray[np.float64],
) -> None:
    axes.fill_between(
        time_s, predicted - threshold, predicted + threshold, color=PREDICTED, alpha=0.25, lw=0, label="threshold"
    )
    axes.plot(time_s, predicted, color=PREDICTED, lw=1.6, label="predicted")
    axes.plot(time_s, measured, color=MEASURED, lw=1.1, label="measured")
    both = np.concatenate([measured, predicted[np.isfinite(predicted)]])
    low, high = float(both.min()), float(both.max())
    margin = 0.12 * max(high - low, 1.0)
    axes.set_ylim(low - margin, high + 2.2 * margin)
    axes.set_ylabel("speed, rpm")


def _draw_residual(
    axes: Axes, time_s: NDArray[np.float64], residual: NDArray[np.float64], threshold: NDArray[np.float64]
) -> None:
    axes.fill_between(time_s, -threshold, threshold, color=PREDICTED, alpha=0.25, lw=0)
    axes.plot(time_s, residual, color=MEASURED, lw=1.0)
    finite = np.abs(residual[np.isfinite(residual)])
    limit = 1.15 * float(finite.max()) if finite.size and finite.max() > 0.0 else 1.0
    axes.set_ylim(-limit, limit)
    axes.set_ylabel("measured - predicted, rpm")


def _title(found: Found, start_s: float) -> str:
    subject = found.trouble.subject.capitalize()
    if not isfinite(found.trouble.shown_s):
        return f"{subject}: no weeds yet"
    shown_s = found.trouble.shown_s - start_s
    if not isfinite(found.text_s):
        return f"{subject}: weeds show at {shown_s:.1f} s, the pilot was not told"
    return f"{subject}: weeds show at {shown_s:.2f} s, the pilot is told {found.latency_s:.2f} s later"
