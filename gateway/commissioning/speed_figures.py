"""What the speed watch's commissioning saw, drawn."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from detectors.speed import SpeedCurve
from gateway.commissioning.speed_learning import Learnt
from gateway.commissioning.speed_tolerance import Watched
from gateway.plotting.figure import Band, Colour, Figure, Level, Line, Mark, Panel, Points

FloatArray: TypeAlias = NDArray[np.float64]

THRUST = "thrust, share of the most"
POINTS_S = 5  # one point for so many seconds
SECTORS = 36
STEADY = 0.05  # the thrust has changed by less meanwhile
SERIES = (Colour.MEASURED, Colour.PREDICTED, Colour.RESIDUAL, Colour.COMMAND, Colour.OTHER)


def speed_figures(learnt: Learnt, courses: Sequence[Watched], tolerance: float) -> tuple[Figure, ...]:
    """Speed over thrust, the headings that it was driven at, and how far the speed was off."""
    return tuple(_figures(learnt, courses, tolerance))


def _figures(learnt: Learnt, courses: Sequence[Watched], tolerance: float) -> Iterator[Figure]:
    if isinstance(learnt.normal.speed, SpeedCurve):
        yield _over_thrust(learnt, learnt.normal.speed, courses, tolerance)
    yield _headings(learnt)
    yield _needed(courses, tolerance)


def _over_thrust(learnt: Learnt, curve: SpeedCurve, courses: Sequence[Watched], tolerance: float) -> Figure:
    levels = learnt.fit.levels.commands
    x = np.linspace(min(0.0, *levels), max(0.0, *levels), 101)
    y = np.array([curve.speed_mps(one) if one else 0.0 for one in x.tolist()])
    seen = [course for course in courses if len(course.time_s)]
    commands, speeds = np.concatenate([*map(_points, seen), np.empty((0, 2))]).T
    marks: tuple[Mark, ...] = (
        Band(
            f"normal: {100.0 * tolerance:.0f} % up and down",
            x,
            y * (1 - tolerance),
            y * (1 + tolerance),
            Colour.NORMAL,
        ),
        Points("as the watch saw it", commands, speeds, Colour.FAINT),
        Line("learnt", x, y, Colour.PREDICTED, width=2.2),
        Points("at each level", levels, learnt.fit.speed_mps, Colour.MEASURED, error=learnt.fit.error_mps),
    )
    return Figure(
        "speed-over-thrust",
        "Speed through the water over thrust",
        (Panel("speed, m/s", marks, share=1.8),),
        about="What the vehicle makes of its thrust, with the current taken out. Bars: one standard deviation.",
        over_time=False,
        x_title=THRUST,
    )


def _points(course: Watched) -> FloatArray:
    """(N, 2) thrust and speed, where the thrust was steady."""
    both = np.column_stack((course.command, course.speed_mps))
    return np.asarray(both[POINTS_S:][np.abs(course.command[POINTS_S:] - course.command[:-POINTS_S]) < STEADY])


def _headings(learnt: Learnt) -> Figure:
    """Seconds in each direction, one line for each level."""
    edges = np.linspace(0.0, 360.0, SECTORS + 1)
    levels = learnt.fit.levels.commands
    marks = []
    for index, level in enumerate(levels):
        seconds = np.zeros(SECTORS)
        for track in learnt.tracks:
            nearest = np.argmin(np.abs(np.nan_to_num(track.command)[:, None] - levels), axis=1)
            at = (nearest == index) & (np.abs(track.command) >= abs(level) / 2.0)
            heading_deg = np.degrees(track.heading_rad[at]) % 360.0
            seconds += np.histogram(heading_deg, edges, weights=track.interval_s[at])[0]
        colour = SERIES[index % len(SERIES)] if learnt.known[index] else Colour.FAULT
        name = f"{100.0 * level:.0f} % thrust" + ("" if learnt.known[index] else ": too few headings")
        marks.append(Line(name, edges[:-1], seconds, colour, step=True))
    return Figure(
        "speed-headings",
        "Headings that were driven",
        (Panel("time, s", tuple(marks)),),
        about="Only on several headings can speed be told from the current: opposite ones are best.",
        over_time=False,
        x_title="heading, degrees",
        main=False,
    )


def _needed(courses: Sequence[Watched], tolerance: float) -> Figure:
    """One dive after the other."""
    hours, marks = 0.0, []
    for number, course in enumerate(courses, start=1):
        if len(course.time_s):
            x = hours + (course.time_s - course.time_s[0]) / 3600.0
            marks.append(
                Line(f"dive {number}", x, 100.0 * np.maximum(course.needed, 0.0), SERIES[(number - 1) % len(SERIES)])
            )
            hours = float(x[-1])
    return Figure(
        "speed-off",
        "How far the speed was off, beyond all doubt",
        (Panel("off, % of the normal speed", (*marks, Level("tolerance", 100.0 * tolerance))),),
        about="In healthy dives: what stays below the tolerance is no false alarm.",
        over_time=False,
        x_title="hours, one dive after the other",
        main=False,
    )
