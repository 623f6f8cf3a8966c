"""Figures of the navigation watch: what its sensors are off by, how that is judged, and where it leads."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from detectors.verdict import Level as VerdictLevel
from gateway.plotting.clock import clock
from gateway.plotting.figure import Bar, Colour, Figure, FloatArray, Level, Line, Mark, Panel
from gateway.report.dive import Dive, NavigationCourse
from gateway.report.drawable import LEVEL_COLOURS, SCORE_SHOWN_MAX, largest, panels, trouble_spans
from gateway.report.episodes import Episode, troubles
from gateway.report.track import stretch, way

WHOLE = "navigation"  # subject of what could be one sensor or another
AXES = (("forward", Colour.MEASURED), ("right", Colour.PREDICTED), ("down", Colour.OTHER))
METHODS = (Colour.RESIDUAL, Colour.MEASURED, Colour.PREDICTED, Colour.OTHER, Colour.COMMAND)


def navigation_figures(dive: Dive) -> Iterator[Figure]:
    """None where navigation was not watched, or no sensor was heard."""
    course = dive.navigation
    if course is None or not len(course.time_s):
        return
    found = troubles(dive, WHOLE, *course.levels)
    yield _over_time(course, found)
    track = _track(course, main=bool(found) or dive.speed is None)
    if track.panels:
        yield track


def _over_time(course: NavigationCourse, found: tuple[Episode, ...]) -> Figure:
    spans = tuple(trouble_spans(found))
    used = ~_isolated(course)
    return Figure(
        "navigation",
        "Navigation sensors",
        panels(
            _sensors(course),
            _off("DVL off by, m/s", course.time_s, course.innovation[:, :3], used, spans),
            _off("depth off by, m", course.time_s, course.innovation[:, 3:], used, spans),
            _statistics(course, spans),
            Panel("position error, m", (*spans, _error(course)), share=0.8),
        ),
        "What the sensors measure less what the others make expect. A sensor that was found wrong is not used: from "
        "then on it is compared, and no more believed.",
        main=bool(found),
    )


def _sensors(course: NavigationCourse) -> Panel:
    """How each was, and whether it was used."""
    bars = [
        bar
        for row, (sensor, level) in enumerate(course.levels.items())
        for bar in _levels(row, course.time_s, level, course.isolated.get(sensor))
    ]
    return Panel("", tuple(bars), rows=tuple(course.levels))


def _levels(
    row: int, time_s: FloatArray, level: NDArray[np.int64], isolated: NDArray[np.bool_] | None
) -> Iterator[Bar]:
    out = np.zeros(len(level), dtype=bool) if isolated is None else isolated
    changes = np.flatnonzero((np.diff(level) != 0) | (np.diff(out) != 0)) + 1
    edges = [0, *changes.tolist(), len(level)]
    for begin, end in pairwise(edges):
        one, until_s = VerdictLevel(int(level[begin])), float(time_s[min(end, len(level) - 1)])
        words = one.name + (", not used" if out[begin] else "")
        from_s = float(time_s[begin])
        yield Bar(row, from_s, until_s, LEVEL_COLOURS[one], words, f"{clock(from_s)} to {clock(until_s)}: {words}")


def _off(
    title: str, time_s: FloatArray, innovation: FloatArray, used: NDArray[np.bool_], spans: tuple[Mark, ...]
) -> Panel:
    """Innovations (N, K). Of a sensor that is not used they grow without bound: what matters happens before."""
    reach = largest(innovation)
    shown = min(1.3 * (largest(innovation[used]) or reach), 1.1 * reach) or 1.0
    lines = [
        Line(name if innovation.shape[1] > 1 else "depth", time_s, innovation[:, axis], colour)
        for axis, (name, colour) in enumerate(AXES[: innovation.shape[1]])
    ]
    cut = ", cut" if reach > shown else ""
    return Panel(f"{title}{cut}", (*spans, *lines), y_range=(-shown, shown))


def _statistics(course: NavigationCourse, spans: tuple[Mark, ...]) -> Panel:
    lines = [
        Line(method.replace("_", " "), course.time_s, value, colour)
        for (method, value), colour in zip(course.statistics.items(), METHODS, strict=False)
    ]
    highest = max((largest(line.y) for line in lines), default=0.0)
    cut = f", cut at {SCORE_SHOWN_MAX:g}" if highest > SCORE_SHOWN_MAX else ""
    y_range = (0.0, min(max(1.35, 1.1 * highest), SCORE_SHOWN_MAX))
    return Panel(f"statistic{cut}", (*spans, *lines, Level("threshold", 1.0)), y_range=y_range)


def _error(course: NavigationCourse) -> Line:
    return Line("position error", course.time_s, course.position_error_m, Colour.MEASURED)


def _isolated(course: NavigationCourse) -> NDArray[np.bool_]:
    """(N,) some sensor is not used."""
    out: NDArray[np.bool_] = np.zeros(len(course.time_s), dtype=bool)
    for one in course.isolated.values():
        out = out | one
    return out


def _track(course: NavigationCourse, *, main: bool) -> Figure:
    marks = [*way("track", course.time_s, course.north_m, course.east_m)]
    for sensor, out in course.isolated.items():
        colour = Colour.FAULT if sensor == "dvl" else Colour.SUSPECT
        marks += stretch(f"without {sensor}", out, course.north_m, course.east_m, colour)
    return Figure(
        "navigation-track",
        "Track by the navigation watch",
        panels(Panel("north, m", tuple(marks), equal=True)),
        "North is up, from where the dive began; where a sensor was not used, by those that were left.",
        over_time=False,
        x_title="east, m",
        main=main,
    )
