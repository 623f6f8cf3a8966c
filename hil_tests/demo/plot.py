"""The closing plot of a demonstration: one thruster's speed, prediction, residual, threshold and level over time."""

from __future__ import annotations

from collections.abc import Sequence
from math import isfinite
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from detectors.verdict import Level
from hil_tests.demo.record import Judged, Recording, Summary

COLOURS = {Level.UNKNOWN: "0.75", Level.NORMAL: "#4c9f70", Level.SUSPECT: "#e0a100", Level.FAULT: "#c8102e"}
WORDS = {Level.UNKNOWN: "learning", Level.NORMAL: "normal", Level.SUSPECT: "suspect", Level.FAULT: "FAULT"}
MEASURED, PREDICTED, ONSET, TOLD = "#1f4e79", "#e07b00", "#2e7d32", "#c8102e"


def draw(path: Path, recording: Recording, summary: Summary, start_s: float) -> None:
    """Write the plot as PNG.

    Args:
        path: of the picture.
        recording: what the gateway saw and said.
        summary: of the same demonstration.
        start_s: what is zero on the time axis.
    """
    history = recording.judged.get(summary.truth.thruster, [])
    with mpl.rc_context({"font.size": 11, "axes.grid": True, "grid.alpha": 0.3, "axes.axisbelow": True}):
        figure = Figure(figsize=(13.0, 8.5), layout="constrained")
        speed, residual, level = figure.subplots(3, 1, sharex=True, height_ratios=(5, 3.4, 0.7))
        if history:
            _draw_history(speed, residual, level, history, start_s)
        for axes in (speed, residual, level):
            _mark_events(axes, summary, start_s)
        if speed.get_legend_handles_labels()[0]:
            speed.legend(loc="upper left", ncols=5, framealpha=0.9)
        level.set_xlabel("seconds since the start")
        figure.suptitle(_title(summary, start_s), fontsize=14, fontweight="bold")
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
    _draw_level(level, time_s, [one.verdict.level for one in history])


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


def _draw_level(axes: Axes, time_s: NDArray[np.float64], levels: Sequence[Level]) -> None:
    """A strip of colour, one stretch for each time that a level lasted."""
    begins = [0, *(index for index in range(1, len(levels)) if levels[index] is not levels[index - 1])]
    width_s = max(float(time_s[-1] - time_s[0]), 1e-9)
    for begin, end in zip(begins, [*begins[1:], len(levels) - 1], strict=True):
        level = levels[begin]
        axes.axvspan(time_s[begin], time_s[end], color=COLOURS[level], lw=0)
        if time_s[end] - time_s[begin] > 0.06 * width_s:
            middle_s = 0.5 * (time_s[begin] + time_s[end])
            axes.text(middle_s, 0.5, WORDS[level], ha="center", va="center", color="white", fontweight="bold")
    axes.set_ylim(0.0, 1.0)
    axes.set_yticks([])
    axes.set_ylabel("level", rotation=0, ha="right", va="center")
    axes.grid(visible=False)
    axes.set_xlim(time_s[0], time_s[-1])


def _mark_events(axes: Axes, summary: Summary, start_s: float) -> None:
    events = (
        (summary.truth.onset_s, ONSET, "--", "weeds catch"),
        (summary.text_s, TOLD, "-", "pilot told (STATUSTEXT)"),
    )
    for time_s, colour, style, label in events:
        if isfinite(time_s) and time_s - start_s <= summary.lasted_s:
            axes.axvline(time_s - start_s, color=colour, ls=style, lw=1.8, label=label)


def _title(summary: Summary, start_s: float) -> str:
    thruster = f"Thruster {summary.truth.thruster}"
    if not isfinite(summary.truth.shown_s):
        return f"{thruster}: no weeds yet"
    if not isfinite(summary.text_s):
        return f"{thruster}: weeds show at {summary.truth.shown_s - start_s:.1f} s, the pilot was not told"
    return (
        f"{thruster}: weeds show at {summary.truth.shown_s - start_s:.2f} s, "
        f"the pilot is told {summary.latency_s:.2f} s later"
    )
