"""The plot of a demonstration's third act: what the DVL is off, how the methods judge it, and where it leads."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, isfinite
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from detectors.verdict import Level
from hil_tests.demo.axes import COLOURS, MEASURED, ONSET, PREDICTED, TOLD, WORDS, draw_strip, mark, styled
from hil_tests.demo.record import SENSORS, JudgedNavigation
from hil_tests.demo.summary import Found
from hil_tests.demo.tracks import Track
from hil_tests.rig.embedded import Moment

FloatArray = NDArray[np.float64]

AXES = (("forward", MEASURED), ("right", PREDICTED), ("down", "#4c9f70"))
METHODS = {
    "ratio": ("likelihood ratio", TOLD),
    "chi_square": ("chi-square", MEASURED),
    "cusum": ("amplified residual", PREDICTED),
    "lstm": ("LSTM", "#6a3d9a"),
}
LEVEL_WORDS = WORDS | {Level.UNKNOWN: "unknown"}
TRUE, WITH, WITHOUT = "0.15", MEASURED, TOLD
SHOWN_MPS = 0.3  # innovations grow without bound once the DVL is isolated: what matters happens before
BEFORE_S = 5.0  # of the drift, from which on the position's error is shown
LOWEST_SHARE, HIGHEST_SHARE = 1e-2, 1e3


@dataclass(frozen=True, slots=True)
class NavigationStory:
    """What the third act's plot tells.

    Attributes:
        moments: the truth.
        history: what the gateway saw and said.
        found: what came of the DVL's drift; None where there was no time for it.
        start_s: what is zero on the time axis.
        lasted_s: how long the demonstration ran.
        isolated: where the gateway took the vehicle to be.
        trusting: where it would have, had it not isolated the DVL.
    """

    moments: Sequence[Moment]
    history: Sequence[JudgedNavigation]
    found: Found | None
    start_s: float
    lasted_s: float
    isolated: Track
    trusting: Track

    @property
    def drift_s(self) -> float:
        """When the drift set in, from the start; infinite: not at all."""
        return self.found.trouble.onset_s - self.start_s if self.found else inf


def draw_navigation(path: Path, story: NavigationStory) -> None:
    """Write the plot as PNG."""
    with styled():
        figure = Figure(figsize=(16.0, 9.5), layout="constrained")
        over_time, over_ground = figure.subfigures(1, 2, squeeze=False, width_ratios=(10, 6))[0]
        strips = [0.5] * len(SENSORS)
        panels = over_time.subplots(3 + len(strips), 1, sharex=True, height_ratios=(4.2, 1.8, 4.2, *strips))
        if story.history:
            _draw_judged(panels, story)
        for axes in panels:
            _mark_events(axes, story)
        _draw_legends(panels[0], panels[2])
        panels[-1].set_xlabel("seconds since the start")
        panels[-1].set_xlim(0.0, story.lasted_s)
        track, error = over_ground.subplots(2, 1, height_ratios=(7, 3))
        _draw_tracks(track, story)
        _draw_errors(error, story)
        figure.suptitle(_title(story), fontsize=14, fontweight="bold")
        figure.savefig(path, dpi=110)


def _draw_legends(innovation: Axes, statistics: Axes) -> None:
    """Events are named in the first only."""
    if innovation.get_legend_handles_labels()[0]:
        innovation.legend(loc="upper left", ncols=6, framealpha=0.9, fontsize=9)
    labels = {label for label, _ in METHODS.values()}
    curves = [line for line in statistics.get_lines() if line.get_label() in labels]
    if curves:
        statistics.legend(handles=curves, loc="upper left", ncols=4, framealpha=0.9, fontsize=9)


def _draw_judged(panels: Sequence[Axes], story: NavigationStory) -> None:
    verdicts = [one.verdict for one in story.history]
    time_s = np.array([one.sample.time_s - story.start_s for one in story.history])
    _draw_innovations(panels[0], panels[1], time_s, np.array([verdict.innovation for verdict in verdicts]))
    _draw_statistics(panels[2], time_s, story.history)
    for axes, (subject, sensor) in zip(panels[3:], SENSORS.items(), strict=True):
        levels = [verdict.of(sensor).level for verdict in verdicts]
        draw_strip(axes, time_s, levels, COLOURS, LEVEL_WORDS, subject)


def _draw_innovations(velocity: Axes, depth: Axes, time_s: FloatArray, innovation: FloatArray) -> None:
    for axis, (name, colour) in enumerate(AXES):
        velocity.plot(time_s, innovation[:, axis], color=colour, lw=1.2, label=name)
    velocity.set_ylabel("DVL innovation, m/s")
    velocity.set_ylim(-SHOWN_MPS, 1.6 * SHOWN_MPS)
    depth.plot(time_s, innovation[:, 3], color=MEASURED, lw=1.2)
    depth.set_ylabel("depth\ninnovation, m")
    reach_m = max(0.05, 1.2 * float(np.nanmax(np.abs(innovation[:, 3]), initial=0.0)))
    depth.set_ylim(-reach_m, reach_m)


def _draw_statistics(axes: Axes, time_s: FloatArray, history: Sequence[JudgedNavigation]) -> None:
    for name, (label, colour) in METHODS.items():
        shares = np.array([one.verdict.statistics.get(name, np.nan) for one in history])
        if np.isfinite(shares).any():
            shown = np.clip(shares, LOWEST_SHARE, HIGHEST_SHARE)
            axes.plot(time_s, shown, color=colour, lw=1.4, label=label)
    axes.axhline(1.0, color="0.15", lw=1.6, ls=":")
    axes.text(0.5, 1.1, "threshold", fontsize=9, va="bottom")
    axes.set_yscale("log")
    axes.set_ylim(LOWEST_SHARE, HIGHEST_SHARE)
    axes.set_ylabel("statistics / threshold")


def _draw_tracks(axes: Axes, story: NavigationStory) -> None:
    if story.moments:
        east_m = [moment.motion.east_m for moment in story.moments]
        axes.plot(east_m, [moment.motion.north_m for moment in story.moments], color=TRUE, lw=1.4, label="true")
    for track, colour, label in _tracks(story):
        axes.plot(track.east_m, track.north_m, color=colour, lw=1.8, label=label)
    for since_s, colour, label in _events(story):
        if story.moments and since_s <= story.lasted_s:
            place = min(story.moments, key=lambda moment: abs(moment.time_s - story.start_s - since_s)).motion
            axes.plot(place.east_m, place.north_m, "o", color=colour, ms=9, label=label, zorder=4)
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.1)
    axes.set_xlabel("east, m")
    axes.set_ylabel("north, m")
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="best", framealpha=0.9, fontsize=9)


def _draw_errors(axes: Axes, story: NavigationStory) -> None:
    for track, colour, label in _tracks(story):
        axes.plot(track.time_s - story.start_s, track.errors_m(story.moments), color=colour, lw=1.8, label=label)
    _mark_events(axes, story)
    begin_s = story.drift_s - BEFORE_S
    drifts = 0.0 < begin_s < story.lasted_s
    axes.set_xlim(begin_s if drifts else 0.0, story.lasted_s)
    axes.set_ylim(bottom=0.0)
    axes.set_ylabel("position error\nsince the drift, m" if drifts else "position error, m")
    axes.set_xlabel("seconds since the start")


def _tracks(story: NavigationStory) -> list[tuple[Track, str, str]]:
    if story.drift_s > story.lasted_s:
        tracks = [(story.isolated, WITH, "estimated")]
    else:
        tracks = [(story.trusting, WITHOUT, "without isolation"), (story.isolated, WITH, "with isolation")]
    return [one for one in tracks if len(one[0].time_s)]


def _mark_events(axes: Axes, story: NavigationStory) -> None:
    for since_s, colour, label in _events(story):
        mark(axes, since_s, story.lasted_s, colour, "-" if colour == TOLD else "--", label)


def _events(story: NavigationStory) -> list[tuple[float, str, str]]:
    """Seconds since the start, colour and words of what happened."""
    if story.found is None:
        return []
    events = [
        (story.drift_s, ONSET, "drift sets in"),
        (story.found.text_s - story.start_s, TOLD, "pilot told (STATUSTEXT)"),
    ]
    return [event for event in events if isfinite(event[0])]


def _title(story: NavigationStory) -> str:
    if story.found is None or story.drift_s > story.lasted_s:
        return "Navigation: no sensor lies yet"
    if not isfinite(story.found.text_s):
        return f"Navigation: the DVL drifts from {story.drift_s:.1f} s on, the pilot was not told"
    later_s = story.found.latency_s
    return f"Navigation: the DVL drifts from {story.drift_s:.1f} s on, the pilot is told {later_s:.1f} s later"
