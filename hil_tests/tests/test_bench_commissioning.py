"""`gateway bench commissioning`: what is learnt is compared with the truth, and told in tables."""

from dataclasses import replace
from io import StringIO
from math import isnan, nan

import numpy as np
import pytest
from rich.console import Console

from gateway.commissioning.navigation_course import Innovations, NavigationCourse
from hil_tests.bench.commissioning import detection_table, foreseen_table, speed_table
from hil_tests.bench.commissioning_navigation import BEGINNING_S, Foreseen, NavigationFigures, foreseen
from hil_tests.bench.commissioning_speed import LearntSpeed, learnt_speed, of_mission, row_of
from hil_tests.bench.navigation_scores import Alarms, Found
from hil_tests.missions import random_mission


def test_a_mission_teaches_its_speed_within_what_is_claimed():
    one = of_mission(4, "plain")
    assert one.group == "missions, constant current"
    assert abs(one.error) < 2.0 * one.claimed < 0.15


def test_a_way_that_is_too_short_is_refused():
    mission = random_mission(4, 0.0)
    columns = ("time_s", "north_m", "east_m", "down_m", "heading_rad", "pitch_rad")
    few = replace(mission, **{name: getattr(mission, name)[:50] for name in columns})
    assert isnan(learnt_speed("short", few).error)


def test_a_row_sums_up_what_was_not_refused():
    rows = [LearntSpeed("tide", 0.02, 0.04), LearntSpeed("tide", -0.1, 0.04), LearntSpeed("tide", nan, nan)]
    row = row_of("tide", rows)
    assert (row.ways, row.refused, row.within) == (3, 1, 0.5)
    assert (row.median, row.greatest, row.claimed) == pytest.approx((0.06, 0.1, 0.04))


def test_the_beginning_of_a_dive_is_told_apart():
    time_s = np.arange(0.0, 4.0 * BEGINNING_S)
    values = np.where(time_s < BEGINNING_S, 0.1, 0.02)[:, None] * np.ones(3)
    dvl = Innovations(time_s, values, np.full(values.shape, 1e-3))
    none = np.empty((0, 10))
    course = NavigationCourse(none, none, dvl, dvl, none, none, time_s > 0, (1.0, 1.0, 1.0))
    beginning_mps, whole_mps, surprise = foreseen(course)
    assert (beginning_mps, whole_mps) == pytest.approx((0.1, np.sqrt(0.25 * 0.01 + 0.75 * 0.0004)))
    assert surprise == dvl.surprise


def test_tables_have_a_line_for_each():
    rows = [row_of("missions", [LearntSpeed("missions", 0.02, 0.04)]), row_of("none", [])]
    figures = NavigationFigures(
        foreseen=[
            Foreseen("default", "3 dives", 0.06, 0.03, -2.8),
            Foreseen("commissioned", "3 dives", 0.03, 0.02, -3.0),
        ],
        healthy={"default": Alarms("ratio", 1.0, 3, 0, 0, 0.33, 0.0)},
        found={"default": [Found("ratio", "DVL step", "", 3, 0, 2, None, None, 0.5)]},
        shares={"dive 1": 0.8},
    )
    console = Console(width=120, record=True, file=StringIO())
    for table in (speed_table(rows), foreseen_table(figures), detection_table(figures)):
        console.print(table)
    text = console.export_text()
    for words in ("missions", "0.060 m/s", "commissioned", "2 of 3, -", "0 in 0.33 h"):
        assert words in text
