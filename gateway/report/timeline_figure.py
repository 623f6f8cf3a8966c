"""The figure that tells a dive at a glance: mode, armed, links that were down, and how each subject was."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np

from detectors.verdict import Level
from gateway.plotting.figure import Colour, Figure, FloatArray, Line, Panel
from gateway.plotting.rows import Moment, Piece, Row, rows_panel, told_apart
from gateway.report.dive import Dive
from gateway.report.drawable import LEVEL_COLOURS, panels
from gateway.report.episodes import Episode, episodes
from gateway.report.subjects import DETECTORS, calm_subjects

# of the dive: shorter stretches that follow each other are one, as bad as the worst of them
LEAST_SHARE = 1.0 / 1000.0
# what began is marked, too: it may be too short to be seen
ONSETS = {Level.SUSPECT: "suspected", Level.FAULT: "found"}


def timeline_figure(dive: Dive) -> Figure:
    """Subjects from the worst on; links and signals that were well all along have no row."""
    rows = [*_vehicle_rows(dive), *_link_rows(dive), *_subject_rows(dive)]
    drawn = panels(rows_panel(rows), _depth(dive))
    about = "How the vehicle was, as the gateway saw it. Markers: something was suspected or found then."
    return Figure("timeline", "The dive", drawn, about)


def _vehicle_rows(dive: Dive) -> Iterator[Row]:
    length_s = dive.end_s - dive.begin_s
    if dive.modes:
        colours = told_apart(mode for _, mode in dive.modes)
        ends_s = [from_s for from_s, _ in dive.modes] + [length_s]
        stretches = zip(dive.modes, pairwise(ends_s), strict=True)
        yield Row("mode", [Piece(*edges, colours[mode], mode) for (_, mode), edges in stretches])
    if len(dive.armed):
        yield Row(
            "armed", [Piece(begin_s, end_s, Colour.MEASURED, "armed") for begin_s, end_s in dive.armed.tolist()]
        )


def _link_rows(dive: Dive) -> Iterator[Row]:
    for link in dive.links:
        if len(link.down):
            yield Row(
                f"{link.name} down",
                [Piece(begin_s, end_s, Colour.FAULT, "down") for begin_s, end_s in link.down.tolist()],
            )


def _subject_rows(dive: Dive) -> Iterator[Row]:
    calm, least_s = calm_subjects(dive.findings), LEAST_SHARE * (dive.end_s - dive.begin_s)
    for subject, found in episodes(dive).items():
        if subject in calm and found[0].detector not in DETECTORS:
            continue
        pieces = [
            Piece(one.from_s, one.to_s, LEVEL_COLOURS[one.level], one.level.name, one.text)
            for one in visible(found, least_s)
        ]
        onsets = [
            Moment(one.from_s, ONSETS[one.level], LEVEL_COLOURS[one.level], f"{one.level.name}: {one.text}")
            for one in found
            if one.level in ONSETS
        ]
        yield Row(subject, pieces, onsets)


def visible(found: Iterable[Episode], least_s: float) -> list[Episode]:
    """Episodes of a subject; those that are too short to be told apart are one, as bad as the worst of them.

    Args:
        found: in order of time, without a gap.
        least_s: what can be told apart.
    """
    shown: list[Episode] = []
    for one in found:
        if shown and one.to_s - shown[-1].from_s < least_s:
            worst = max(shown[-1], one, key=lambda episode: episode.level)
            shown[-1] = replace(worst, from_s=shown[-1].from_s, to_s=one.to_s)
        else:
            shown.append(one)
    return shown


def _depth(dive: Dive) -> Panel:
    """Deep is down."""
    time_s, depth_m = _depths(dive)
    known = depth_m[np.isfinite(depth_m)]
    deepest = float(known.max(initial=0.0))
    y_range = (1.05 * deepest + 0.5, min(float(known.min(initial=0.0)), 0.0) - 0.2)
    lines = (Line("depth", time_s, depth_m, Colour.MEASURED),) if len(known) and np.ptp(known) > 0.0 else ()
    return Panel("depth, m", lines, share=0.9, y_range=y_range)


def _depths(dive: Dive) -> tuple[FloatArray, FloatArray]:
    if dive.navigation is not None:
        return dive.navigation.time_s, dive.navigation.depth_m
    if dive.speed is not None:
        return dive.speed.time_s, dive.speed.down_m
    return np.empty(0), np.empty(0)
