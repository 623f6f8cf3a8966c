"""Figures like those of paper 003: detection statistics (7 to 10, 13), and tracks with and without isolation (14)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from hil_tests.navigation_trials import Record, Way
from hil_tests.sensor_faults import SensorFault

FloatArray = NDArray[np.float64]

METHODS = {"chi_square": "chi-square", "cusum": "amplified CUSUM", "lstm": "PSO-LSTM", "ratio": "ratio (default)"}
COLOURS = {"chi_square": "tab:orange", "cusum": "tab:green", "lstm": "tab:purple", "ratio": "tab:blue"}
WAYS = {"no faults": ("tab:green", "-"), "not isolated": ("tab:red", "--")}
TRUE, BROKEN, THRESHOLD = "black", "tab:red", "black"
STATISTIC = (1e-2, 1e3)
ERROR_M = (0.1, 2000.0)
COMPONENTS = ("forward", "right", "down")


@dataclass(frozen=True, slots=True, eq=False)
class Watched:
    """A dive with a fault in it, as all methods saw it.

    Attributes:
        title: of its picture. fault: in it. record: without isolation.
    """

    title: str
    fault: SensorFault
    record: Record


def statistics_figure(watched: Sequence[Watched], before_s: float = 60.0, after_s: float = 110.0) -> Figure:
    """Innovations above the statistics of all methods as shares of their thresholds, a column for each fault.

    Args:
        before_s, after_s: what is shown around the onset.
    """
    figure = Figure(figsize=(6.5 * len(watched), 7.5), layout="constrained")
    grid = figure.subplots(2, len(watched), sharex="col", sharey="row", height_ratios=(1, 1.6), squeeze=False)
    for (innovation, statistic), one in zip(grid.T, watched, strict=True):
        since_s = one.record.time_s - one.fault.onset_s
        shown = (since_s >= -before_s) & (since_s <= after_s)
        innovation.set_title(one.title)
        for column, component in enumerate(COMPONENTS):
            innovation.plot(since_s[shown], one.record.innovation[shown, column], lw=1.0, label=component)
        _draw_statistics(
            statistic,
            since_s[shown],
            {name: one.record.statistics[name][shown] for name in METHODS if name in one.record.statistics},
        )
        for axes in (innovation, statistic):
            _shade(axes, [(0.0, one.fault.end_s - one.fault.onset_s)])
            axes.grid(alpha=0.3)
        statistic.set(xlabel="time after the onset, s")
    grid[0, 0].set(ylabel="DVL: innovation, m/s")
    grid[1, 0].set(ylabel="statistic / threshold")
    grid[0, 0].legend(loc="upper left", fontsize="small")
    grid[1, 0].legend(loc="upper left", fontsize="small")
    return figure


def track_figure(ways: Sequence[Way], spans_s: Sequence[tuple[float, float]]) -> Figure:
    """Tracks beside the true one, and errors of position over time.

    Args:
        ways: of one dive, by different variants.
        spans_s: when the DVL was faulty.
    """
    figure = Figure(figsize=(14.0, 6.5), layout="constrained")
    track, error = figure.subplots(1, 2, width_ratios=(1, 1.3))
    north_m, east_m = ways[0].true_m.T
    track.plot(east_m, north_m, color=TRUE, lw=2.5, label="true")
    for way in ways:
        colour, line = WAYS.get(way.variant, (COLOURS.get(way.variant), "-"))
        label = METHODS.get(way.variant, way.variant)
        north_m, east_m = way.believed_m.T
        track.plot(east_m, north_m, color=colour, ls=line, lw=1.0, label=label)
        error.semilogy(way.time_s, np.maximum(way.error_m, ERROR_M[0]), color=colour, ls=line, lw=1.2, label=label)
    _shade(error, spans_s)
    _frame(track, ways[0].true_m)
    track.set(title="track", xlabel="east, m", ylabel="north, m")
    error.set(title="distance from the true position", xlabel="time, s", ylabel="m", ylim=ERROR_M)
    for axes in (track, error):
        axes.grid(alpha=0.3)
    track.legend(loc="best", fontsize="small")
    return figure


def _frame(axes: Axes, true_m: FloatArray) -> None:
    """Room for the true way and as much around it: a way that has run off leaves the picture."""
    middle, half = 0.5 * (true_m.max(axis=0) + true_m.min(axis=0)), max(float(np.ptp(true_m, axis=0).max()), 1.0)
    axes.set(xlim=(middle[1] - half, middle[1] + half), ylim=(middle[0] - half, middle[0] + half), aspect="equal")


def _draw_statistics(axes: Axes, since_s: FloatArray, statistics: Mapping[str, FloatArray]) -> None:
    for name, values in statistics.items():
        known = np.isfinite(values)
        shown = np.clip(values[known], *STATISTIC)
        axes.semilogy(since_s[known], shown, color=COLOURS[name], lw=1.2, label=METHODS[name])
    axes.axhline(1.0, color=THRESHOLD, lw=0.8, ls="--")
    axes.set_ylim(*STATISTIC)


def _shade(axes: Axes, spans_s: Sequence[tuple[float, float]]) -> None:
    for begin_s, end_s in spans_s:
        axes.axvspan(begin_s, end_s, color=BROKEN, alpha=0.1, lw=0)
