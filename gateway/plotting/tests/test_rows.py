"""Rows of a time line."""

from __future__ import annotations

from gateway.plotting.figure import Bar, Colour, Points
from gateway.plotting.rows import Moment, Piece, Row, rows_panel, told_apart


def test_bars_and_points_stand_in_their_rows() -> None:
    weeds = Moment(61.5, "found", Colour.FAULT, "weeds")
    rows = (
        Row("mode", [Piece(0.0, 61.0, Colour.OTHER, "MANUAL")]),
        Row("thruster 1", [Piece(61.0, 90.0, Colour.FAULT, "FAULT", "T1 blocked")], [weeds]),
        Row("dvl", moments=[weeds, Moment(70.0, "suspected", Colour.SUSPECT, "drift")]),
    )
    panel = rows_panel(rows)
    assert panel.rows == ("mode", "thruster 1", "dvl")
    bars = [one for one in panel.marks if isinstance(one, Bar)]
    assert [(one.row, one.from_x, one.to_x, one.label) for one in bars] == [
        (0, 0.0, 61.0, "MANUAL"),
        (1, 61.0, 90.0, "FAULT"),
    ]
    assert [one.text for one in bars] == ["0:00 to 1:01: MANUAL", "1:01 to 1:30: FAULT, T1 blocked"]
    found, suspected = (one for one in panel.marks if isinstance(one, Points))
    assert (found.name, found.x.tolist(), found.y.tolist()) == ("found", [61.5, 61.5], [1.0, 2.0])
    assert suspected.labels == ("1:10 drift",)


def test_rows_without_anything_are_there() -> None:
    assert rows_panel((Row("armed"),)).rows == ("armed",)
    assert rows_panel(()).marks == ()


def test_names_are_told_apart_and_neither_good_nor_bad() -> None:
    colours = told_apart(["MANUAL", "ALT_HOLD", "MANUAL", "POSHOLD"])
    assert list(colours) == ["MANUAL", "ALT_HOLD", "POSHOLD"]
    assert len(set(colours.values())) == 3
    assert not {Colour.NORMAL, Colour.SUSPECT, Colour.FAULT} & set(colours.values())
    assert len(told_apart(map(str, range(9)))) == 9
