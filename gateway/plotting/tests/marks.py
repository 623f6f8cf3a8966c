"""Figures with every mark, to be drawn in tests."""

from __future__ import annotations

import numpy as np

from gateway.plotting.figure import (
    Arrows,
    Band,
    Bar,
    Colour,
    Dash,
    Figure,
    FloatArray,
    Level,
    Line,
    Panel,
    Points,
    Span,
)

EMPTY = np.empty(0)


def line(time_s: FloatArray, value: FloatArray, **look: object) -> Line:
    """A line over time."""
    return Line("measured", time_s, value, Colour.MEASURED, **look)  # type: ignore[arg-type]


def over_time(time_s: FloatArray, value: FloatArray) -> Figure:
    """Every mark."""
    some = np.array([1.0, 5.0, 9.0])
    return Figure(
        "every-mark",
        "Every mark",
        (
            Panel(
                "speed, rpm",
                (
                    Span("weeds & co", 2.0, 4.0, Colour.FAULT),
                    Band("normal", time_s, value - 1.0, value + 1.0, Colour.PREDICTED),
                    line(time_s, value),
                    Line("command", time_s, np.round(value), Colour.COMMAND, Dash.DASHED, step=True),
                    Level("threshold", 2.5),
                ),
                share=2.0,
            ),
            Panel(
                "score",
                (
                    Points("refits", some, some, Colour.OTHER, ("a", "<b>", "c"), np.array([0.1, np.nan, 0.3])),
                    Arrows("flow", some, some, np.ones(3), -np.ones(3), Colour.RESIDUAL, ("1", "2", "3")),
                ),
                y_range=(0.0, 10.0),
            ),
            Panel(
                "",
                (Bar(0, 0.0, 4.0, Colour.NORMAL, "NORMAL"), Bar(1, 4.0, 4.01, Colour.FAULT, "FAULT", "T3 blocked")),
                rows=("dvl", "thruster 3"),
            ),
        ),
        about="All of it.",
    )


def from_above(north_m: FloatArray, east_m: FloatArray) -> Figure:
    """A track."""
    return Figure(
        "track",
        "Track",
        (Panel("north, m", (Line("track", east_m, north_m, Colour.MEASURED),), equal=True),),
        over_time=False,
        x_title="east, m",
    )


def sine(length_s: float = 10.0, count: int = 200) -> tuple[FloatArray, FloatArray]:
    """(N,) times and values."""
    time_s = np.linspace(0.0, length_s, count)
    return time_s, np.sin(time_s)
