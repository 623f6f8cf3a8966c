"""How far a figure reaches, and where its time axis is marked."""

from __future__ import annotations

import numpy as np
import pytest

from gateway.plotting.extent import reach, time_ticks
from gateway.plotting.figure import Arrows, Bar, Colour, Figure, Level, Mark, Panel, Span
from gateway.plotting.tests.marks import line


def across(*marks: Mark) -> tuple[float, float]:
    return reach(Figure("one", "One", (Panel("y", marks[:1]), Panel("y", marks[1:]))))


def test_all_marks_count() -> None:
    some = np.array([3.0, np.nan, 4.0])
    assert across(line(some, some), Level("threshold", 99.0)) == (3.0, 4.0)
    assert across(line(some, some), Span("fault", -1.0, 2.0, Colour.FAULT)) == (-1.0, 4.0)
    assert across(line(some, some), Bar(0, 5.0, 9.0, Colour.FAULT, "FAULT")) == (3.0, 9.0)
    assert across(Arrows("flow", some, some, -some, some, Colour.OTHER)) == (0.0, 4.0)


def test_or_what_is_asked_for() -> None:
    some = np.array([3.0, 4.0])
    assert reach(Figure("one", "One", (Panel("y", (line(some, some),)),), x_range=(0.0, 60.0))) == (0.0, 60.0)


def test_a_moment_can_be_seen() -> None:
    assert across(line(np.array([5.0]), np.array([1.0]))) == (4.5, 5.5)
    assert across() == (0.0, 1.0)


@pytest.mark.parametrize("length_s", [0.3, 1.0, 7.0, 59.0, 61.0, 600.0, 5000.0, 36_000.0, 900_000.0])
def test_ticks_are_few_and_round(length_s: float) -> None:
    ticks_s = time_ticks(3.0, 3.0 + length_s)
    assert 2 <= len(ticks_s) <= 9
    assert ticks_s[0] >= 3.0 - 1e-6
    assert ticks_s[-1] <= 3.0 + length_s + 1e-6
    step_s = ticks_s[1] - ticks_s[0]
    assert np.allclose(np.diff(ticks_s), step_s)
    assert step_s < 1.0 or step_s % 60.0 == 0.0 or 60.0 % step_s == 0.0


def test_one_tick_is_none() -> None:
    with pytest.raises(ValueError, match="count_max = 1: want 2 or more"):
        time_ticks(0.0, 1.0, 1)
