"""Figures as files: all of them drawn, the same bytes for the same figure."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas
from PIL import Image

from gateway.plotting.figure import Colour, Figure, Level, Line, Panel, Points
from gateway.plotting.picture import canvas_of, save_picture
from gateway.plotting.picture_marks import POINTS_MAX, draw
from gateway.plotting.tests.marks import EMPTY, from_above, line, over_time, sine


@pytest.fixture(name="axes")
def _axes() -> Axes:
    return Canvas().subplots()


def test_a_name_in_letters_that_no_font_has_is_no_matter(tmp_path: Path) -> None:
    """Nothing is warned of, which tests take for an error."""
    save_picture(replace(over_time(*sine()), title="Thruster 1 (\u63a8\u9032\u5668)"), tmp_path / "x.png")
    assert (tmp_path / "x.png").stat().st_size > 0


def test_every_mark_is_there(axes: Axes) -> None:
    speeds, scores, rows = over_time(*sine()).panels
    draw(axes, speeds.marks, (0.0, 10.0), over_time=True)
    assert [one.get_label() for one in axes.lines[:2]] == ["measured", "command"]
    assert [one.get_label() for one in axes.collections] == ["normal"]
    assert [one.get_label() for one in axes.patches] == ["weeds & co"]
    assert [one.get_text() for one in axes.texts] == ["threshold"]
    other = Canvas().subplots()
    draw(other, scores.marks, (0.0, 10.0), over_time=True)
    assert {"refits", "flow"} <= set(other.get_legend_handles_labels()[1])
    lanes = Canvas().subplots()
    draw(lanes, rows.marks, (0.0, 10.0), over_time=True)
    assert len(lanes.collections) == 2
    assert [one.get_text() for one in lanes.texts] == ["NORMAL"]  # on the other there is no room


def test_a_gap_stays_one_and_a_peak_too(axes: Axes) -> None:
    value = np.zeros(100_000)
    value[40_000:40_100], value[77_777], value[50] = np.nan, 9.0, np.inf
    draw(axes, (line(np.arange(100_000.0), value),), (0.0, 1e5), over_time=True)
    drawn = np.asarray(axes.lines[0].get_ydata(), dtype=float)
    assert len(drawn) <= POINTS_MAX
    assert np.nanmax(drawn) == 9.0
    assert (np.diff(np.isnan(drawn).astype(int)) == 1).sum() == 2


def test_a_sample_between_gaps_is_a_point(axes: Axes) -> None:
    draw(axes, (line(np.arange(3.0), np.array([np.nan, 2.0, np.nan])),), (0.0, 2.0), over_time=True)
    assert axes.lines[1].get_xydata().tolist() == [[1.0, 2.0]]


def test_ranges_rows_and_equal_axes() -> None:
    speeds, scores, rows = canvas_of(over_time(*sine(7200.0))).axes
    assert scores.get_ylim() == (0.0, 10.0)
    assert rows.get_ylim() == (1.5, -0.5)
    assert [one.get_text() for one in rows.get_yticklabels()] == ["dvl", "thruster 3"]
    assert {"0:00", "1:00:00"} <= {one.get_text() for one in rows.get_xticklabels()}
    assert speeds.get_xlim() == (0.0, 7200.0)
    (track,) = canvas_of(from_above(*sine())).axes
    assert track.get_aspect() == 1.0
    assert track.get_xlabel() == "east, m"


def test_a_name_stands_in_one_legend() -> None:
    panel = Panel("speed, rpm", (line(*sine()), Level("FAULT", 1.0)))
    canvas = canvas_of(Figure("one", "One", (panel, panel, Panel("measured", panel.marks))))
    legends = [axes.get_legend() for axes in canvas.axes]
    assert [one is not None for one in legends] == [True, False, False]


def test_names_are_no_mathematics(tmp_path: Path) -> None:
    name = "$100 < $200 & <b>"
    figure = Figure("one", name, (Panel("y", (Line(name, *sine(), Colour.OTHER),)),))
    save_picture(figure, tmp_path / "one.svg")
    words = [one.text for one in ElementTree.parse(tmp_path / "one.svg").iter() if one.text]  # noqa: S314
    assert words.count(name) == 2


def test_an_svg_has_its_words_and_is_the_same_each_time(tmp_path: Path) -> None:
    for name in ("one.svg", "other.svg"):
        save_picture(over_time(*sine()), tmp_path / name)
    text = (tmp_path / "one.svg").read_text()
    for word in ("Every mark", "speed, rpm", "measured", "threshold", "thruster 3", "All of it.", "weeds &amp; co"):
        assert word in text
    assert text == (tmp_path / "other.svg").read_text()


def test_a_png_is_as_wide_as_said_and_the_same_each_time(tmp_path: Path) -> None:
    for name in ("one.png", "other.PNG"):
        save_picture(over_time(*sine()), tmp_path / name)
    with Image.open(tmp_path / "one.png") as picture:
        assert picture.size[0] == 1300
    assert (tmp_path / "one.png").read_bytes() == (tmp_path / "other.PNG").read_bytes()


@pytest.mark.parametrize("count", [0, 1])
def test_nothing_and_one_sample_are_drawn(count: int, tmp_path: Path) -> None:
    save_picture(over_time(np.full(count, 3.0), np.ones(count)), tmp_path / "few.svg")
    empty = Figure("none", "None", (Panel("y", (Points("none", EMPTY, EMPTY, Colour.OTHER),)),))
    save_picture(empty, tmp_path / "none.svg")
    assert "None" in (tmp_path / "none.svg").read_text()


def test_other_kinds_of_files_are_a_mistake(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"plot\.gif: want a name that ends in \.png or \.svg"):
        save_picture(over_time(*sine()), tmp_path / "plot.gif")
