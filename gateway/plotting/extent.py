"""How far a figure reaches along x, and where the ticks of its time axis stand."""

from __future__ import annotations

from typing import assert_never

import numpy as np

from gateway.plotting.figure import Arrows, Band, Bar, Figure, FloatArray, Level, Line, Mark, Points, Span

# of a moment, so that it can be seen
LEAST_S = 1.0
STEPS_S = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 15.0, 30.0, 60.0, 120.0, 300.0, 600.0, 900.0, 1800.0, 3600.0, 7200.0)
DAY_S = 86_400.0


def reach(figure: Figure) -> tuple[float, float]:
    """Lowest and highest x that are shown, at least a second apart; a second where nothing is drawn."""
    low, high = figure.x_range or _drawn(figure)
    short = max(LEAST_S - (high - low), 0.0)
    return low - short / 2.0, high + short / 2.0


def time_ticks(low_s: float, high_s: float, count_max: int = 9) -> FloatArray:
    """(M,) times at which a time axis is marked: on whole minutes where it is long, at most so many.

    Raises:
        ValueError: fewer than two are wanted.
    """
    if count_max < 2:
        raise ValueError(f"count_max = {count_max}: want 2 or more")
    wanted_s = (high_s - low_s) / (count_max - 1)
    step_s = next((step for step in STEPS_S if step >= wanted_s), DAY_S * np.ceil(wanted_s / DAY_S))
    first = np.ceil(low_s / step_s - 1e-9)
    last = np.floor(high_s / step_s + 1e-9)
    return np.arange(first, last + 1.0) * step_s


def _drawn(figure: Figure) -> tuple[float, float]:
    drawn = np.concatenate([[], *(_across(mark) for panel in figure.panels for mark in panel.marks)])
    drawn = drawn[np.isfinite(drawn)]
    return (float(drawn.min()), float(drawn.max())) if len(drawn) else (0.0, LEAST_S)


def _across(mark: Mark) -> FloatArray:
    match mark:
        case Line() | Band() | Points():
            return mark.x
        case Arrows():
            return np.concatenate((mark.x, mark.x + mark.dx))
        case Span() | Bar():
            return np.array([mark.from_x, mark.to_x])
        case Level():
            return np.empty(0)
        case _:
            assert_never(mark)
