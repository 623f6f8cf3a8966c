"""Figures for a page: valid for plotly, with their gaps and peaks."""

from __future__ import annotations

import json
from datetime import UTC, datetime
from itertools import pairwise
from typing import Any

import numpy as np
import plotly.graph_objects as go
import pytest

from gateway.plotting.figure import Arrows, Band, Bar, Colour, Figure, Line, Mark, Panel, Points, Span
from gateway.plotting.palette import DAY, night_colours
from gateway.plotting.plotly_axes import ORIGIN_MS
from gateway.plotting.plotly_drawing import MAIN_POINTS_MAX, POINTS_MAX, to_plotly
from gateway.plotting.tests.marks import EMPTY, from_above, line, over_time, sine


def alone(mark: Mark, **settings: Any) -> dict[str, Any]:
    """What is drawn of a figure with one mark."""
    return to_plotly(Figure("one", "One", (Panel("y", (mark,)),), **settings))


def trace(mark: Mark, **settings: Any) -> dict[str, Any]:
    """Its only trace."""
    (found,) = alone(mark, **settings)["data"]
    return dict(found)


def gaps(value: list[float | None]) -> int:
    """How often a line breaks off."""
    return sum(one is None and before is not None for before, one in pairwise(value))


def texts(value: object) -> set[str]:
    """All strings in it."""
    if isinstance(value, str):
        return {value}
    inner = value.values() if isinstance(value, dict) else value if isinstance(value, list | tuple) else ()
    return set().union(*map(texts, inner))


def test_every_mark_is_as_plotly_has_it() -> None:
    drawn = to_plotly(over_time(*sine()))
    figure = go.Figure(drawn)  # refuses what it does not know
    assert [one.type for one in figure.data] == ["scatter"] * 5 + ["bar"]
    assert [one.name for one in figure.data[:5]] == ["normal", "measured", "command", "refits", "flow"]
    assert [one.type for one in figure.layout.shapes] == ["rect", "line"]
    assert [one.text for one in figure.layout.annotations] == ["speed, rpm", "score"]
    json.dumps(drawn, allow_nan=False)


def test_panels_are_apart_and_fill_the_figure() -> None:
    layout = to_plotly(over_time(*sine()))["layout"]
    domains = [layout[name]["domain"] for name in ("yaxis", "yaxis2", "yaxis3")]
    assert domains[0][1] == 1.0
    assert domains[-1][0] == 0.0
    assert all(upper[0] > lower[1] for upper, lower in pairwise(domains))
    heights = [high - low for low, high in domains]
    assert heights[0] == pytest.approx(2.0 * heights[1], rel=1e-3)
    assert layout["xaxis"]["anchor"] == "y3"
    margin = layout["margin"]
    assert layout["height"] * heights[0] > 110 + margin["b"]


def test_the_time_is_minutes_and_seconds_since_the_beginning() -> None:
    drawn = alone(line(np.array([0.0, 61.5]), np.array([1.0, 2.0])))
    assert drawn["data"][0]["x"] == [ORIGIN_MS, ORIGIN_MS + 61_500]
    assert datetime.fromtimestamp(ORIGIN_MS / 1000, UTC).strftime("%H:%M:%S") == "00:00:00"
    axis = drawn["layout"]["xaxis"]
    assert (axis["type"], axis["tickformat"]) == ("date", "%-M:%S")
    assert axis["range"] == [ORIGIN_MS, ORIGIN_MS + 61_500]


def test_or_the_time_of_day() -> None:
    figure = Figure("one", "One", (Panel("y", (line(np.array([0.0, 10.0]), np.ones(2)),)),))
    drawn = to_plotly(figure, begin_s=1_700_000_000.0)
    assert drawn["data"][0]["x"][0] == 1_700_000_000_000
    assert drawn["layout"]["xaxis"]["tickformat"] == "%H:%M:%S"


def test_a_gap_stays_one() -> None:
    value = np.ones(20_000)
    value[10_000:10_050] = np.nan
    value[15_000] = np.inf
    time_s = np.arange(20_000) / 50.0
    assert gaps(trace(line(time_s, value))["y"]) == 2
    band = trace(Band("normal", time_s, value - 1.0, value + 1.0, Colour.NORMAL))
    assert gaps(band["y"]) == 2  # three surfaces
    assert None not in (band["y"][0], band["y"][-1])


def test_a_time_that_is_no_number_is_a_gap() -> None:
    drawn = trace(line(np.array([0.0, np.nan, 2.0]), np.ones(3)))
    assert drawn["x"] == [ORIGIN_MS, None, ORIGIN_MS + 2000]
    assert drawn["y"] == [1.0, None, 1.0]


def test_a_sample_between_gaps_is_a_point() -> None:
    drawn = trace(line(np.arange(5.0), np.array([1.0, np.nan, 3.0, np.nan, 5.0])))
    assert drawn["mode"] == "lines+markers"
    assert drawn["marker"]["size"] == [4, 0, 4, 0, 4]
    assert trace(line(*sine()))["mode"] == "lines"


def test_ten_hours_keep_their_peaks() -> None:
    time_s = np.arange(0.0, 36_000.0, 0.02)
    value = 0.1 * np.sin(0.01 * time_s)
    value[1_234_567], value[345_678] = 7.5, -7.5
    for main, points_max in ((True, MAIN_POINTS_MAX), (False, POINTS_MAX)):
        drawn = trace(line(time_s, value), main=main)
        assert 0.9 * points_max < len(drawn["x"]) <= points_max
        assert (max(drawn["y"]), min(drawn["y"])) == (7.5, -7.5)
    assert alone(line(time_s, value))["layout"]["xaxis"]["tickformat"] == "%-H:%M:%S"


def test_a_track_keeps_its_corners_in_both_axes() -> None:
    angle = np.linspace(0.0, 40.0, 50_000)
    north_m, east_m = angle * np.cos(angle), angle * np.sin(angle)
    drawn = to_plotly(from_above(north_m, east_m))
    (track,) = drawn["data"]
    assert len(track["x"]) <= MAIN_POINTS_MAX
    for kept, whole in ((track["x"], east_m), (track["y"], north_m)):
        assert (min(kept), max(kept)) == pytest.approx((whole.min(), whole.max()), abs=0.01)
    layout = drawn["layout"]
    assert layout["yaxis"]["scaleanchor"] == "x"
    assert layout["xaxis"]["title"]["text"] == "east, m"
    assert layout["hovermode"] == "closest"


@pytest.mark.parametrize("count", [0, 1])
def test_nothing_and_one_sample_are_drawn(count: int) -> None:
    go.Figure(to_plotly(over_time(np.full(count, 3.0), np.full(count, 1.0))))
    low, high = alone(line(np.full(count, 3.0), np.ones(count)))["layout"]["xaxis"]["range"]
    assert high - low == 1000
    for mark in (
        Points("none", EMPTY, EMPTY, Colour.OTHER),
        Arrows("none", EMPTY, EMPTY, EMPTY, EMPTY, Colour.OTHER),
        Line("none", EMPTY, EMPTY, Colour.OTHER),
    ):
        assert trace(mark)["x"] == []


def test_an_arrow_points_from_its_tail() -> None:
    x, dx = np.array([1.0, np.nan, 5.0]), np.array([2.0, 1.0, -1.0])
    arrows = Arrows("flow", x, np.zeros(3), dx, np.ones(3), Colour.OTHER, ("one", "lost", "<two>"))
    drawn = trace(arrows, over_time=False)
    assert drawn["x"] == [1.0, 3.0, None, 5.0, 4.0]
    assert drawn["y"] == [0.0, 1.0, None, 0.0, 1.0]
    assert drawn["marker"]["size"][:5] == [0, 10, 0, 0, 10]
    assert drawn["text"] == ["one", "one", None, "&lt;two&gt;", "&lt;two&gt;"]
    go.Figure(alone(arrows, over_time=False))


def test_bars_are_where_they_were() -> None:
    (bars,) = [one for one in to_plotly(over_time(*sine()))["data"] if one["type"] == "bar"]
    assert bars["y"] == [0, 1]
    assert bars["base"] == [ORIGIN_MS, ORIGIN_MS + 4000]
    assert bars["x"] == [4000, 10]
    assert bars["hovertext"] == ["NORMAL", "T3 blocked"]


def test_names_are_no_markup_and_stand_in_the_legend_once() -> None:
    bad = "<b>weeds</b>"
    spans = (Span(bad, 1.0, 2.0, Colour.FAULT), Span(bad, 3.0, 4.0, Colour.FAULT))
    panel = Panel("<i>score</i>", (*spans, Line("score", *sine(), Colour.RESIDUAL)))
    rows = Panel("", (Bar(0, 1.0, 2.0, Colour.FAULT, bad, bad),), rows=(bad,))
    drawn = to_plotly(Figure("one", "One", (panel, panel, rows), over_time=False, x_title=bad))
    assert [one["showlegend"] for one in drawn["layout"]["shapes"]] == [True, False, False, False]
    assert {one["name"] for one in drawn["layout"]["shapes"]} == {"&lt;b&gt;weeds&lt;/b&gt;"}
    assert drawn["layout"]["annotations"][0]["text"] == "&lt;i&gt;score&lt;/i&gt;"
    assert not any("<b>" in text or "<i>" in text for text in texts(drawn))


def test_what_the_title_of_a_panel_tells_is_not_in_the_legend() -> None:
    panel = Panel("score, cut at 10", (Line("score", *sine(), Colour.RESIDUAL), line(*sine())))
    drawn = to_plotly(Figure("one", "One", (panel,)))["data"]
    assert [one["showlegend"] for one in drawn] == [False, True]


def test_few_short_labels_are_written() -> None:
    x = np.arange(3.0)
    assert trace(Points("time", x, x, Colour.FAINT, ("0:00", "1:00", "2:00")))["mode"] == "markers+text"
    assert trace(Points("found", x, x, Colour.FAINT, ("T3 entangled? 1180 rpm",) * 3))["mode"] == "markers"


def test_all_colours_have_one_for_the_night() -> None:
    night = night_colours()
    used = {text for text in texts(to_plotly(over_time(*sine()))) if text.startswith(("#", "rgb"))}
    assert used - {"#10181f"} <= night.keys()  # dark ink stays
    assert not set(DAY.values()) & set(night.values())
