"""The plot of a demonstration's second act: speed and flow, true and learnt, over time and along the track."""

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
from hil_tests.demo.axes import COLOURS, EVENT, MEASURED, ONSET, PREDICTED, TOLD, WORDS, draw_strip, mark, styled
from hil_tests.demo.record import JudgedSpeed
from hil_tests.demo.summary import Found
from hil_tests.rig.embedded import Moment
from hil_tests.rig.vehicle import Motion

FLAG_COLOURS = {0: COLOURS[Level.NORMAL], 1: COLOURS[Level.FAULT], 2: COLOURS[Level.UNKNOWN]}
FLAG_WORDS = {0: "0: none", 1: "1: anomaly", 2: "2: not trusted"}
LEVEL_WORDS = WORDS | {Level.UNKNOWN: "unknown"}  # from the first turn on it is more than learning
TRUE = "0.15"
ARROW_EVERY_S = 4.0
# An arrow of 1 m/s is this share of the track's width long.
ARROW_SHARE = 0.25
# So unsure a learnt flow is not drawn as an arrow: its direction says nothing.
UNSURE_MPS = 0.3


@dataclass(frozen=True, slots=True)
class SpeedStory:
    """What the second act's plot tells.

    Attributes:
        moments: the truth.
        history: what the gateway saw and said.
        found: what came of the net on the hull; None where there was no time for it.
        start_s: what is zero on the time axis.
        lasted_s: how long the demonstration ran.
        current_s: when the current set in, from the start; infinite: not at all.
        freed_s: when the net was cut off.
    """

    moments: Sequence[Moment]
    history: Sequence[JudgedSpeed]
    found: Found | None
    start_s: float
    lasted_s: float
    current_s: float = inf
    freed_s: float = inf


def draw_speed(path: Path, story: SpeedStory) -> None:
    """Write the plot as PNG."""
    with styled():
        figure = Figure(figsize=(16.0, 8.5), layout="constrained")
        over_time, over_ground = figure.subfigures(1, 2, squeeze=False, width_ratios=(10, 6))[0]
        panels = over_time.subplots(4, 1, sharex=True, height_ratios=(5, 3.4, 0.6, 0.6))
        if story.moments:
            _draw_truth(panels[0], panels[1], story)
            _draw_track(over_ground.subplots(), story)
        if story.history:
            _draw_learnt(panels, story)
        for axes in panels:
            _mark_events(axes, story)
        _draw_legends(*panels[:2])
        panels[-1].set_xlabel("seconds since the start")
        panels[-1].set_xlim(0.0, story.lasted_s)
        figure.suptitle(_title(story), fontsize=14, fontweight="bold")
        figure.savefig(path, dpi=110)


def _draw_legends(speed: Axes, flow: Axes) -> None:
    if speed.get_legend_handles_labels()[0]:
        speed.legend(loc="upper left", ncols=7, framealpha=0.9, fontsize=9)
    handles, labels = flow.get_legend_handles_labels()
    curves = [(handle, label) for handle, label in zip(handles, labels, strict=True) if "," in label]  # no events
    if curves:
        flow.legend(*zip(*curves, strict=True), loc="upper left", ncols=4, framealpha=0.9, fontsize=9)


def _draw_truth(speed: Axes, flow: Axes, story: SpeedStory) -> None:
    time_s = np.array([moment.time_s - story.start_s for moment in story.moments])
    forward_mps = np.array([moment.motion.forward_mps for moment in story.moments])
    water_mps = np.array([moment.motion.water_mps for moment in story.moments])
    speed.plot(time_s, forward_mps, color=TRUE, lw=1.2, label="true")
    speed.set_ylim(0.0, 1.35 * max(float(forward_mps.max()), 0.1))
    speed.set_ylabel("speed through water, m/s")
    for axis, (name, colour) in enumerate((("north", PREDICTED), ("east", MEASURED))):
        flow.plot(time_s, water_mps[:, axis], color=colour, lw=1.2, ls="--", label=f"true, {name}")
    flow.set_ylabel("flow, m/s")
    reach_mps = max(float(np.abs(water_mps).max()), 0.2)
    flow.set_ylim(-1.3 * reach_mps, 2.0 * reach_mps)


def _draw_learnt(panels: Sequence[Axes], story: SpeedStory) -> None:
    speed, flow, flags, levels = panels
    verdicts = [one.verdict for one in story.history]
    time_s = np.array([one.sample.time_s - story.start_s for one in story.history])
    low, high, learnt, error = (
        np.array([getattr(verdict, name) for verdict in verdicts])
        for name in ("speed_min_mps", "speed_max_mps", "speed_mps", "speed_error_mps")
    )
    speed.fill_between(time_s, low, high, color=ONSET, alpha=0.2, lw=0, label="normal")
    known = np.where(np.isfinite(error) | np.isnan(error), learnt, np.nan)
    shown_error = np.where(np.isfinite(error), error, 0.0)
    speed.fill_between(time_s, known - shown_error, known + shown_error, color=MEASURED, alpha=0.25, lw=0)
    speed.plot(time_s, known, color=MEASURED, lw=1.6, label="learnt")
    flow_mps = np.array([verdict.flow_mps[:2] for verdict in verdicts])
    for axis, (name, colour) in enumerate((("north", PREDICTED), ("east", MEASURED))):
        flow.plot(time_s, flow_mps[:, axis], color=colour, lw=1.6, label=f"learnt, {name}")
    draw_strip(flags, time_s, [verdict.flag for verdict in verdicts], FLAG_COLOURS, FLAG_WORDS, "flag")
    draw_strip(levels, time_s, [verdict.level for verdict in verdicts], COLOURS, LEVEL_WORDS, "level")


def _draw_track(axes: Axes, story: SpeedStory) -> None:
    north_m = np.array([moment.motion.north_m for moment in story.moments])
    east_m = np.array([moment.motion.east_m for moment in story.moments])
    axes.plot(east_m, north_m, color="0.55", lw=1.4, label="track")
    width_m = max(float(np.ptp(north_m)), float(np.ptp(east_m)), 1.0)
    _draw_arrows(axes, _true_arrows(story), 1.0 / (ARROW_SHARE * width_m), "0.7", 0.012, "flow, true")
    _draw_arrows(axes, _learnt_arrows(story), 1.0 / (ARROW_SHARE * width_m), MEASURED, 0.004, "flow, learnt")
    _mark_places(axes, story)
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.2)  # room for the arrows
    axes.set_xlabel("east, m")
    axes.set_ylabel("north, m")
    axes.legend(loc="upper left", framealpha=0.9, fontsize=9)


def _draw_arrows(
    axes: Axes, arrows: NDArray[np.float64], scale: float, colour: str, width: float, label: str
) -> None:
    """(N, 4) arrows: east, north, and the flow's east and north velocity; `scale` is m/s for a metre of the map."""
    if arrows.size:
        axes.quiver(
            *arrows.T, angles="xy", scale_units="xy", scale=scale, color=colour, width=width, label=label, zorder=3
        )


def _true_arrows(story: SpeedStory) -> NDArray[np.float64]:
    motions = [story.moments[index].motion for index in _spread([moment.time_s for moment in story.moments])]
    return np.array([(one.east_m, one.north_m, one.water_mps[1], one.water_mps[0]) for one in motions])


def _learnt_arrows(story: SpeedStory) -> NDArray[np.float64]:
    """At the true places: the gateway counts its positions from an origin of its own."""
    spread = _spread([one.sample.time_s for one in story.history])
    verdicts = [one.verdict for one in (story.history[index] for index in spread)]
    known = [one for one in verdicts if not one.speed_error_mps > UNSURE_MPS and all(map(isfinite, one.flow_mps))]
    places = [_motion_at(story, one.time_s) for one in known]
    return np.array(
        [
            (place.east_m, place.north_m, one.flow_mps[1], one.flow_mps[0])
            for place, one in zip(places, known, strict=True)
        ]
    )


def _motion_at(story: SpeedStory, time_s: float) -> Motion:
    return min(story.moments, key=lambda moment: abs(moment.time_s - time_s)).motion


def _spread(times_s: Sequence[float]) -> list[int]:
    """Indices of the first of every so many seconds."""
    bins = np.floor(np.asarray(times_s) / ARROW_EVERY_S)
    return [int(index) for index in np.unique(bins, return_index=True)[1]]


def _mark_places(axes: Axes, story: SpeedStory) -> None:
    for since_s, colour, label in _events(story):
        if since_s <= story.lasted_s:
            place = _motion_at(story, story.start_s + since_s)
            axes.plot(place.east_m, place.north_m, "o", color=colour, ms=9, label=label, zorder=4)


def _mark_events(axes: Axes, story: SpeedStory) -> None:
    for since_s, colour, label in _events(story):
        mark(axes, since_s, story.lasted_s, colour, "-" if colour == TOLD else "--", label)


def _events(story: SpeedStory) -> list[tuple[float, str, str]]:
    """Seconds since the start, colour and words of what happened."""
    events = [(story.current_s, EVENT, "current sets in")]
    if story.found is not None:
        events.append((story.found.trouble.onset_s - story.start_s, ONSET, "net catches"))
        events.append((story.found.text_s - story.start_s, TOLD, "pilot told (STATUSTEXT)"))
        events.append((story.freed_s, EVENT, "cut free"))
    return [event for event in events if isfinite(event[0])]


def _title(story: SpeedStory) -> str:
    if story.found is None or not isfinite(story.found.trouble.shown_s):
        return "Speed: nothing caught on the hull yet"
    shown_s = story.found.trouble.shown_s - story.start_s
    if not isfinite(story.found.text_s):
        return f"Speed: a net slows the vehicle from {shown_s:.1f} s on, the pilot was not told"
    later_s = story.found.latency_s
    return f"Speed: a net slows the vehicle from {shown_s:.1f} s on, the pilot is told {later_s:.1f} s later"
