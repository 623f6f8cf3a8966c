"""Figures of a thruster: over the dive, and its speed over the command."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from detectors.verdict import Level as VerdictLevel
from gateway.plotting.figure import Band, Colour, Dash, Figure, FloatArray, Line, Mark, Panel, Points
from gateway.report.dive import Curve, Dive, ThrusterCourse
from gateway.report.drawable import even, largest, panels, score_panel, trouble_spans, where
from gateway.report.episodes import Episode, episodes, troubles

SCATTER_MAX = 1500
# the difference is shown up to so many of the usual thresholds, or as far as it goes
THRESHOLDS_SHOWN = 6.0
MARGIN = 0.08  # of what is shown of the speed
SURE = 2.0  # standard deviations: 95 %


def thruster_figures(dive: Dive) -> Iterator[Figure]:
    """Two of each thruster that was judged; the main ones are of those that something was found of."""
    for course in dive.thrusters:
        if not len(course.time_s):
            continue
        found = troubles(dive, *_subjects(dive, course.number))
        yield _over_time(course, found)
        curves = _over_command(course, main=bool(found))
        if curves.panels:
            yield curves


def _subjects(dive: Dive, number: int) -> list[str]:
    """Itself, and its signals."""
    own = f"thruster {number}"
    return [subject for subject in episodes(dive) if subject == own or subject.startswith(f"{own} ")]


def _named(course: ThrusterCourse) -> str:
    known = course.name and course.name != f"thruster {course.number}"
    return f"Thruster {course.number}" + (f" ({course.name})" if known else "")


def _over_time(course: ThrusterCourse, found: tuple[Episode, ...]) -> Figure:
    spans = tuple(trouble_spans(found))
    return Figure(
        f"thruster-{course.number}",
        _named(course),
        panels(
            _speeds(course, spans),
            _difference(course, spans),
            score_panel([Line("score", course.time_s, course.score, Colour.RESIDUAL)], *spans),
            Panel("command, %", (*spans, _command(course)), share=0.8),
        ),
        "The thruster should turn as predicted, within the band; where there is none, too little is known yet. What "
        "it is off by is the difference; how much that says is the score: a FAULT from 1 on.",
        main=bool(found),
    )


def _speeds(course: ThrusterCourse, spans: tuple[Mark, ...]) -> Panel:
    known = np.concatenate(([0.0], course.speed_rpm, course.predicted_rpm))
    known = known[np.isfinite(known)]
    low_rpm, high_rpm = float(known.min()), float(known.max())
    threshold_rpm = _sure(course.threshold_rpm, high_rpm - low_rpm)
    margin_rpm = MARGIN * (high_rpm - low_rpm) or 1.0
    predicted = course.predicted_rpm
    marks = (
        *spans,
        Band("normal", course.time_s, predicted - threshold_rpm, predicted + threshold_rpm, Colour.PREDICTED),
        Line("predicted", course.time_s, predicted, Colour.PREDICTED, width=3.0),
        Line("measured", course.time_s, course.speed_rpm, Colour.MEASURED),
    )
    return Panel("speed, rpm", marks, share=1.8, y_range=(low_rpm - margin_rpm, high_rpm + margin_rpm))


def _difference(course: ThrusterCourse, spans: tuple[Mark, ...]) -> Panel:
    reach_rpm, usual_rpm = largest(course.residual_rpm), _median(course.threshold_rpm)
    shown_rpm = min(max(1.1 * reach_rpm, 1.3 * usual_rpm), THRESHOLDS_SHOWN * usual_rpm) or 1.0
    threshold_rpm, refits = _sure(course.threshold_rpm, shown_rpm), course.refit_s
    marks = (
        *spans,
        Line("difference", course.time_s, course.residual_rpm, Colour.RESIDUAL),
        Line("threshold", course.time_s, threshold_rpm, Colour.THRESHOLD, Dash.DASHED, 1.3),
        Line("threshold", course.time_s, -threshold_rpm, Colour.THRESHOLD, Dash.DASHED, 1.3),
        Points("learnt anew", refits, np.full(len(refits), -0.93 * shown_rpm), Colour.OTHER),
    )
    cut = ", cut" if reach_rpm > shown_rpm else ""
    return Panel(f"difference, rpm{cut}", marks, y_range=(-shown_rpm, shown_rpm))


def _sure(threshold_rpm: FloatArray, shown_rpm: float) -> FloatArray:
    """Outside of what was learnt the threshold is wider than anything: there it says nothing, and is not drawn."""
    return where(threshold_rpm < shown_rpm, threshold_rpm)


def _median(value: FloatArray) -> float:
    known = value[np.isfinite(value)]
    return float(np.median(known)) if len(known) else 0.0


def _command(course: ThrusterCourse) -> Line:
    return Line("command", course.time_s, 100.0 * course.command, Colour.COMMAND, step=True)


def _over_command(course: ThrusterCourse, *, main: bool) -> Figure:
    return Figure(
        f"thruster-{course.number}-curve",
        f"{_named(course)}: speed over command",
        panels(Panel("speed, rpm", (*_samples(course), *_curves(course)), share=2.4)),
        "What was learnt at the end of the dive, beside what the thruster is held against. Points off the curve are "
        "on the way from one command to the next, or faults.",
        over_time=False,
        x_title="command, %",
        main=main,
    )


def _samples(course: ThrusterCourse) -> Iterator[Mark]:
    bad = course.level == VerdictLevel.FAULT
    for name, chosen, colour in (("measured", ~bad, Colour.FAINT), ("at a FAULT", bad, Colour.FAULT)):
        indices = np.flatnonzero(chosen & np.isfinite(course.command) & np.isfinite(course.speed_rpm))
        if len(indices):
            kept = indices[even(len(indices), SCATTER_MAX)]
            yield Points(name, 100.0 * course.command[kept], course.speed_rpm[kept], colour)


def _curves(course: ThrusterCourse) -> Iterator[Mark]:
    if course.commissioned is not None:
        yield _line("commissioned", course.commissioned, Colour.PREDICTED, Dash.DASHED)
    if course.curve is not None:
        learnt = course.curve
        error = SURE * where(np.isfinite(learnt.error_rpm), learnt.error_rpm)
        yield Band(
            "learnt, 95 % sure",
            100.0 * learnt.command,
            learnt.speed_rpm - error,
            learnt.speed_rpm + error,
            Colour.MEASURED,
        )
        yield _line("learnt", learnt, Colour.MEASURED, Dash.SOLID)


def _line(name: str, curve: Curve, colour: Colour, dash: Dash) -> Line:
    return Line(name, 100.0 * curve.command, curve.speed_rpm, colour, dash, 2.2)
