"""Figures of the speed watch: speed and flow over the dive, and the track."""

from __future__ import annotations

from collections.abc import Iterator

from detectors.verdict import Level as VerdictLevel
from gateway.plotting.figure import Band, Colour, Figure, Line, Mark, Panel
from gateway.report.dive import Dive, SpeedCourse
from gateway.report.drawable import LEVEL_COLOURS, panels, score_panel, trouble_spans, where
from gateway.report.episodes import Episode, troubles
from gateway.report.track import flow_arrows, stretch, way

SUBJECT = "vehicle"
SURE = 2.0  # standard deviations: 95 %
# a range of speeds wider than this was not known yet
UNSURE_MPS = 1.0


def speed_figures(dive: Dive) -> Iterator[Figure]:
    """None where the speed was not watched, or there was never a position."""
    course = dive.speed
    if course is None or not len(course.time_s):
        return
    found = troubles(dive, SUBJECT)
    yield _over_time(course, found)
    track = _track(course)
    if track.panels:
        yield track


def _over_time(course: SpeedCourse, found: tuple[Episode, ...]) -> Figure:
    spans = tuple(trouble_spans(found))
    north_mps, east_mps = course.flow_mps[:, 0], course.flow_mps[:, 1]
    return Figure(
        "speed",
        "Speed through the water",
        panels(
            Panel("speed, m/s", (*spans, *_speeds(course)), share=1.8),
            score_panel([Line("score", course.time_s, course.score, Colour.RESIDUAL)], *spans),
            Panel(
                "flow, m/s",
                (
                    *spans,
                    Line("flow north", course.time_s, north_mps, Colour.OTHER),
                    Line("flow east", course.time_s, east_mps, Colour.COMMAND),
                ),
            ),
        ),
        "Speed and flow are learnt from positions and headings. Less speed than normal at the same thrust: something "
        "holds the vehicle, or drives it less.",
        main=bool(found),
    )


def _speeds(course: SpeedCourse) -> Iterator[Mark]:
    error_mps = SURE * course.speed_error_mps
    sure = ~(error_mps > UNSURE_MPS)  # where the estimator tells none, it is drawn
    low, high = course.speed_mps - error_mps, course.speed_mps + error_mps
    yield Band("normal", course.time_s, course.speed_min_mps, course.speed_max_mps, Colour.NORMAL)
    yield Band("learnt, 95 % sure", course.time_s, where(sure, low), where(sure, high), Colour.MEASURED)
    yield Line("learnt", course.time_s, where(sure, course.speed_mps), Colour.MEASURED)


def _track(course: SpeedCourse) -> Figure:
    north_m, east_m = course.north_m, course.east_m
    marks = [*way("track", course.time_s, north_m, east_m)]
    for level in (VerdictLevel.SUSPECT, VerdictLevel.FAULT):
        marks += stretch(level.name, course.level == level, north_m, east_m, LEVEL_COLOURS[level])
    marks += flow_arrows(course.flow_mps, course.level != VerdictLevel.UNKNOWN, north_m, east_m)
    return Figure(
        "track",
        "Track, from above",
        panels(Panel("north, m", tuple(marks), equal=True)),
        "North is up. The arrows are the flow of the water along the way.",
        over_time=False,
        x_title="east, m",
    )
