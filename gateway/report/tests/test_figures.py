"""Figures of a dive: what was found comes first, all of it is in them, and nothing is drawn of nothing."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
import pytest

from detectors.verdict import Level as VerdictLevel
from gateway.plotting.figure import Arrows, Bar, Colour, Figure, Level, Line, Mark, Panel, Points, Span
from gateway.plotting.picture import canvas_of
from gateway.plotting.plotly_drawing import to_plotly
from gateway.report.dive import Dive
from gateway.report.figures import figures
from gateway.report.tests.made_dive import (
    BEGIN_S,
    CLEAN_S,
    DRIFT_S,
    FREED_S,
    ISOLATED_S,
    LENGTH_S,
    SLOW_S,
    TANGLED_S,
    dive,
    finding,
    findings,
    links,
    navigation,
    speed,
    thruster,
)


@pytest.fixture(name="made", scope="module")
def _made() -> Dive:
    return dive()


def figure(of: Dive, name: str) -> Figure:
    (found,) = [one for one in figures(of) if one.name == name]
    return found


def panel(of: Figure, title: str) -> Panel:
    (found,) = [one for one in of.panels if one.y_title.startswith(title)]
    return found


def mark(of: Panel, name: str) -> Mark:
    return next(one for one in of.marks if not isinstance(one, Bar) and one.name == name)


def spans(of: Panel) -> list[tuple[str, float, float]]:
    return [(one.name, one.from_x, one.to_x) for one in of.marks if isinstance(one, Span)]


def calm() -> Dive:
    """Nothing was found."""
    well = tuple(one for one in findings() if one.level <= VerdictLevel.NORMAL and one.detector != "link")
    return dive(findings=well, links=links()[1:])


def empty() -> Dive:
    return dive(findings=(), thrusters=(), speed=None, navigation=None, links=(), armed=np.empty((0, 2)), modes=())


def test_what_was_found_comes_first(made: Dive) -> None:
    drawn = figures(made)
    main = [one.name for one in drawn if one.main]
    assert [one.name for one in drawn][: len(main)] == main
    assert main[0] == "timeline"
    assert {"thruster-3", "thruster-3-curve", "speed", "track", "navigation", "navigation-track", "links"} < set(main)
    assert [one.name for one in drawn if one.name.startswith("thruster") and one.main] == main[1:3]
    assert len({one.name for one in drawn}) == len(drawn) == 8 + 2 * 7


def test_where_nothing_was_found_there_is_the_time_line_and_the_track() -> None:
    assert [one.name for one in figures(calm()) if one.main] == ["timeline", "track"]


def test_nothing_is_drawn_of_nothing() -> None:
    assert figures(empty()) == []
    without = figures(dive(speed=None, navigation=None, links=()))
    assert {one.name.split("-")[0] for one in without} == {"timeline", "thruster"}
    assert [one.y_title for one in without[0].panels] == [""]


def test_both_back_ends_draw_all_of_it(made: Dive) -> None:
    for one in figures(made):
        drawn = go.Figure(to_plotly(one))
        axes = canvas_of(one).axes
        assert len(axes) == len(one.panels) == sum(name.startswith("yaxis") for name in drawn.layout.to_plotly_json())


def test_arrays_without_a_sample(tmp_path: Path) -> None:
    nothing = dive(
        thrusters=(thruster(1, length_s=0.0),),
        links=tuple(replace(one, time_s=one.time_s[:0], readings_per_s=one.load[:0]) for one in links()),
    )
    assert not any(one.name.startswith(("thruster", "links")) for one in figures(nothing))


def test_the_time_line_has_a_row_of_each_subject_with_how_it_was(made: Dive) -> None:
    (rows, depth) = figure(made, "timeline").panels
    worst = ["thruster 3", "vehicle", "dvl"]
    others = [f"thruster {number}" for number in (1, 2, 4, 5, 6, 7, 8)]
    assert rows.rows == ("mode", "armed", "can0 down", *worst, *others)
    third = rows.rows.index("thruster 3")
    bars = [one for one in rows.marks if isinstance(one, Bar) and one.row == third]
    assert [one.label for one in bars] == ["UNKNOWN", "NORMAL", "SUSPECT", "FAULT", "NORMAL"]
    assert [one.from_x for one in bars[3:]] == pytest.approx([TANGLED_S + 0.9, FREED_S + 2.0], abs=1e-3)
    assert "T3 entangled? 1180 rpm" in bars[3].text
    assert bars[-1].to_x == LENGTH_S
    found, suspected = (mark(rows, name) for name in ("found", "suspected"))
    assert isinstance(found, Points)
    assert isinstance(suspected, Points)
    assert [len(found.x), len(suspected.x)] == [3, 2]  # but begins are marked, however short
    assert depth.y_range is not None
    assert depth.y_range[0] > 6.0 > 0.0 > depth.y_range[1]


def test_a_subject_that_flaps_all_day_is_as_bad_as_it_was() -> None:
    flapping = tuple(
        finding(one, VerdictLevel.FAULT if place % 2 else VerdictLevel.NORMAL, "thruster 1")
        for place, one in enumerate(np.arange(1.0, 599.0, 0.05))
    )
    (rows, _) = figure(dive(findings=flapping, modes=(), armed=np.empty((0, 2)), links=()), "timeline").panels
    bars = [one for one in rows.marks if isinstance(one, Bar)]
    assert len(bars) < 1500
    assert {one.colour for one in bars[:-2]} == {Colour.FAULT}  # at the end is what is longer


def test_a_thruster_has_its_prediction_and_its_threshold(made: Dive) -> None:
    over_time = figure(made, "thruster-3")
    assert over_time.title == "Thruster 3 (front left)"
    assert figure(made, "thruster-4").title == "Thruster 4"
    difference = panel(over_time, "difference")
    course = made.thrusters[2]
    limits = [one for one in difference.marks if isinstance(one, Line) and one.name == "threshold"]
    np.testing.assert_array_equal(limits[0].y, course.threshold_rpm)
    np.testing.assert_array_equal(limits[1].y, -course.threshold_rpm)
    assert difference.y_range is not None
    assert np.nanmax(course.threshold_rpm) < difference.y_range[1] < np.nanmax(np.abs(course.residual_rpm))
    assert difference.y_title == "difference, rpm, cut"
    refits = mark(difference, "learnt anew")
    assert isinstance(refits, Points)
    np.testing.assert_array_equal(refits.x, course.refit_s)
    for one in over_time.panels:
        (_, fault) = spans(one)
        assert fault == ("FAULT", pytest.approx(TANGLED_S + 0.9, abs=1e-3), pytest.approx(FREED_S + 2.0, abs=1e-3))
    assert [one for one in panel(over_time, "score").marks if isinstance(one, Level)] == [Level("FAULT", 1.0)]


def test_a_threshold_wider_than_anything_is_not_drawn() -> None:
    course = thruster(1)
    course.threshold_rpm[3000:3100] = 20_000.0
    speeds, difference = figure(dive(thrusters=(course,)), "thruster-1").panels[:2]
    assert speeds.y_range is not None
    assert speeds.y_range[1] < 5000.0
    limit = mark(difference, "threshold")
    assert isinstance(limit, Line)
    assert np.isnan(limit.y[3000:3100]).all()
    assert np.isfinite(limit.y[3100:]).all()


def test_silence_of_its_esc_is_trouble_of_a_thruster() -> None:
    silent = finding(100.0, VerdictLevel.SUSPECT, "thruster 1 esc", detector="signal")
    drawn = figure(dive(findings=(silent, finding(50.0, VerdictLevel.FAULT, "thruster 12"))), "thruster-1")
    assert drawn.main
    assert spans(drawn.panels[0]) == [("SUSPECT", 100.0, LENGTH_S)]


def test_a_score_beyond_all_measure_leaves_the_threshold_to_be_seen(made: Dive) -> None:
    high = made.thrusters[2].score.copy()
    high[3000] = 1e6
    score = panel(figure(dive(thrusters=(replace(made.thrusters[2], score=high),)), "thruster-3"), "score")
    assert score.y_title == "score, cut at 10"
    assert score.y_range == (0.0, 10.0)


def test_the_learnt_curve_is_beside_the_commissioned(made: Dive) -> None:
    (curve,) = figure(made, "thruster-3-curve").panels
    assert {"measured", "at a FAULT", "commissioned", "learnt, 95 % sure", "learnt"} == {
        one.name for one in curve.marks if not isinstance(one, Bar)
    }
    bad = mark(curve, "at a FAULT")
    assert isinstance(bad, Points)
    assert len(bad.x) == (made.thrusters[2].level == VerdictLevel.FAULT).sum()
    (bare,) = figure(
        dive(thrusters=(replace(thruster(5), curve=None, commissioned=None),)), "thruster-5-curve"
    ).panels
    assert [one.name for one in bare.marks if not isinstance(one, Bar)] == ["measured"]


def test_a_speed_of_which_nothing_is_sure_is_not_drawn(made: Dive) -> None:
    over_time = figure(made, "speed")
    learnt = mark(panel(over_time, "speed"), "learnt")
    assert isinstance(learnt, Line)
    assert np.isnan(learnt.y[learnt.x < 60.0]).all()
    assert np.isfinite(learnt.y[learnt.x >= 60.0]).all()
    assert [one[0] for one in spans(panel(over_time, "flow"))] == ["SUSPECT", "FAULT"]


def test_a_speed_without_an_error_is_drawn() -> None:
    plain = replace(speed(), speed_error_mps=np.full(len(speed().time_s), np.nan))
    learnt = mark(panel(figure(dive(speed=plain), "speed"), "speed"), "learnt")
    assert isinstance(learnt, Line)
    assert np.isfinite(learnt.y).all()


def test_the_track_shows_where_and_which_way_the_water_went(made: Dive) -> None:
    (track,) = figure(made, "track").panels
    assert track.equal
    slow = mark(track, "FAULT")
    assert isinstance(slow, Line)
    assert np.isfinite(slow.x).sum() == 2 * (CLEAN_S - SLOW_S)
    (arrows,) = [one for one in track.marks if isinstance(one, Arrows)]
    assert 10 <= len(arrows.x) <= 24
    assert (arrows.dx < 0.0).all()
    assert (arrows.dy > 0.0).all()
    assert np.allclose(arrows.dx / arrows.dy, -0.2 / 0.15, atol=0.5)
    assert all("towards 30" in one or "towards 29" in one or "towards 31" in one for one in arrows.labels)
    times = mark(track, "time")
    assert isinstance(times, Points)
    assert times.labels == ("0:00", "2:00", "4:00", "6:00", "8:00")


def test_without_a_flow_there_are_no_arrows() -> None:
    still = replace(speed(), flow_mps=np.zeros_like(speed().flow_mps))
    (track,) = figure(dive(speed=still), "track").panels
    assert not [one for one in track.marks if isinstance(one, Arrows)]


def test_navigation_shows_what_happened_before_the_dvl_was_isolated(made: Dive) -> None:
    over_time = figure(made, "navigation")
    sensors, off = over_time.panels[:2]
    assert sensors.rows == ("dvl", "depth sensor")
    assert [(one.row, one.label, one.from_x) for one in sensors.marks if isinstance(one, Bar)] == [
        (0, "NORMAL", 0.0),
        (0, "FAULT, not used", ISOLATED_S),
        (1, "NORMAL", 0.0),
    ]
    assert off.y_title == "DVL off by, m/s, cut"
    assert off.y_range is not None
    assert 0.02 * (ISOLATED_S - DRIFT_S) < off.y_range[1] < 1.0
    assert [one.name for one in panel(over_time, "statistic").marks if isinstance(one, Line)] == [
        "ratio",
        "chi square",
    ]
    (track,) = figure(made, "navigation-track").panels
    without = mark(track, "without dvl")
    assert isinstance(without, Line)
    assert np.isfinite(without.x).sum() == made.navigation.isolated["dvl"].sum()  # type: ignore[union-attr]
    assert not [one for one in track.marks if not isinstance(one, Bar) and one.name == "without depth sensor"]


def test_gaps_in_time_are_gaps() -> None:
    course, known = navigation(), np.isfinite
    course.innovation[100] = course.north_m[100] = course.position_error_m[100] = np.nan
    (track,) = figure(dive(navigation=course), "navigation-track").panels
    way = mark(track, "track")
    assert isinstance(way, Line)
    assert not known(way.y[100])
    assert known(way.y[101])


def test_links_show_what_was_lost_and_when_they_were_down(made: Dive) -> None:
    drawn = figure(made, "links")
    assert [one.y_title for one in drawn.panels] == ["readings a second", "bus load, %", "lost a second"]
    assert [one.name for one in drawn.panels[0].marks if isinstance(one, Line)] == ["can0", "mavlink"]
    for one in drawn.panels[1:]:
        assert [each.name for each in one.marks if isinstance(each, Line)] == ["can0"]
    assert spans(drawn.panels[0]) == [("can0 down", 100.0, 112.0)]
    assert not figure(calm(), "links").main


def test_times_are_since_the_beginning(made: Dive) -> None:
    for one in figures(made):
        if one.over_time:
            low, high = to_plotly(one)["layout"]["xaxis"]["range"]
            assert high - low <= 1000 * LENGTH_S < BEGIN_S
