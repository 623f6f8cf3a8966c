"""What the navigation watch's commissioning saw, drawn."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from detectors.navigation.error_model import STATES
from detectors.navigation.installation import DVL_DELAY, LEVER_ARM
from gateway.commissioning.inertial_noise import AllanCurve
from gateway.commissioning.navigation_course import NavigationCourse
from gateway.commissioning.navigation_watch import Watched
from gateway.commissioning.sensor_noise import SensorNoise
from gateway.plotting.figure import Band, Colour, Dash, Figure, Level, Line, Mark, Panel

FloatArray: TypeAlias = NDArray[np.float64]

AXES = ("forward", "right", "down")
DASHES = (Dash.SOLID, Dash.DASHED, Dash.DOTTED)
DEVIATIONS = 2.0
DIVES = (Colour.MEASURED, Colour.PREDICTED, Colour.RESIDUAL, Colour.COMMAND, Colour.OTHER)


def navigation_figures(
    courses: Sequence[NavigationCourse], noise: SensorNoise, seen: Sequence[Watched], share: float
) -> tuple[Figure, ...]:
    """Mounting and innovations over the dives, noises, and how far healthy dives reach towards the threshold."""
    return tuple(_figures([one for one in courses if len(one.dvl.time_s)], noise, seen, share))


def _figures(
    courses: Sequence[NavigationCourse], noise: SensorNoise, seen: Sequence[Watched], share: float
) -> Iterator[Figure]:
    if courses:
        yield _mounting(courses)
        yield _innovations(courses)
    if noise.accelerometer is not None and noise.gyroscope is not None:
        yield _allan(noise.accelerometer, noise.gyroscope)
    if any(len(one.time_s) for one in seen):
        yield _reached(seen, share)


def _minutes(time_s: FloatArray) -> FloatArray:
    return np.asarray((time_s - time_s[0]) / 60.0)


def _colour(dive: int) -> Colour:
    return DIVES[(dive - 1) % len(DIVES)]


def _mounting(courses: Sequence[NavigationCourse]) -> Figure:
    """Delay and lever arm as they were learnt, dive by dive."""
    arms = [
        Panel(f"DVL {axis} of the IMU, m", _learnt(courses, LEVER_ARM.start + index - STATES))
        for index, axis in enumerate(AXES)
    ]
    return Figure(
        "navigation-mounting",
        "The DVL's mounting, as it was learnt",
        (Panel("delay, s", _learnt(courses, DVL_DELAY - STATES), share=1.4), *arms),
        about="One line for each dive, from its first turns on: where the dives agree, it is known.",
        over_time=False,
        x_title="minutes since the beginning of the dive",
    )


def _learnt(courses: Sequence[NavigationCourse], index: int) -> tuple[Mark, ...]:
    marks: list[Mark] = []
    for number, course in enumerate(courses, start=1):
        known = course.acquainted
        if not known.any():
            continue
        x = _minutes(course.dvl.time_s)[known]
        value, doubt = course.installed[known, index], DEVIATIONS * course.deviation[known, index]
        if len(courses) == 1:
            marks.append(Band("two standard deviations", x, value - doubt, value + doubt, Colour.FAINT))
        marks.append(Line(f"dive {number}", x, value, _colour(number)))
    return tuple(marks)


def _innovations(courses: Sequence[NavigationCourse]) -> Figure:
    """They fall as the mounting is learnt."""
    panels = []
    for axis, name in enumerate(AXES):
        marks = [
            Line(f"dive {number}", _minutes(one.dvl.time_s), one.dvl.values[:, axis], _colour(number), width=1.0)
            for number, one in enumerate(courses, start=1)
        ]
        panels.append(Panel(f"{name}, m/s", tuple(marks)))
    return Figure(
        "navigation-innovations",
        "What the DVL said beyond what was expected of it",
        tuple(panels),
        about="Large at first, and in turns; small once the mounting is known.",
        over_time=False,
        x_title="minutes since the beginning of the dive",
        main=False,
    )


def _allan(accelerometer: AllanCurve, gyroscope: AllanCurve) -> Figure:
    rows = (("specific force, m/s2 per root Hz", accelerometer), ("angular rate, rad/s per root Hz", gyroscope))
    panels = []
    for title, curve in rows:
        x = np.log10(curve.averaging_s)
        lines = [
            Line(axis, x, np.log10(np.maximum(curve.density[:, k], 1e-12)), Colour.MEASURED, dash=DASHES[k])
            for k, axis in enumerate(AXES)
        ]
        panels.append(Panel(f"log10 of {title}", (*lines, Level("taken", float(np.log10(curve.white.max()))))))
    return Figure(
        "navigation-allan",
        "Noise of the inertial unit",
        tuple(panels),
        about="The least of each line is white noise; to the right of it the vehicle moves.",
        over_time=False,
        x_title="log10 of the averaging time in s",
        main=False,
    )


def _reached(seen: Sequence[Watched], share: float) -> Figure:
    marks: list[Mark] = []
    hours = 0.0
    for number, one in enumerate(seen, start=1):
        if len(one.time_s):
            x = hours + (one.time_s - one.time_s[0]) / 3600.0
            marks.append(Line(f"dive {number}", x, one.share, _colour(number)))
            hours = float(x[-1])
    levels = (Level("configured", 1.0, Colour.FAINT), Level("commissioned", share))
    return Figure(
        "navigation-reached",
        "How far healthy dives reach towards the threshold",
        (Panel("share of the configured threshold", (*marks, *levels)),),
        about="Each dive was judged with what the others had taught."
        if len(seen) > 1
        else "One dive, judged by itself.",
        over_time=False,
        x_title="hours, one dive after the other",
    )
