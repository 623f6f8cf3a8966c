"""Marks as plotly.js takes them: traces with data, and shapes behind and before them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from itertools import chain
from typing import assert_never

import numpy as np
from numpy.typing import NDArray

from gateway.plotting.figure import Arrows, Band, Bar, Dash, FloatArray, Level, Line, Mark, Points, Span
from gateway.plotting.palette import BAND_OPACITY, DAY, SPAN_OPACITY, filled, ink
from gateway.plotting.plotly_axes import Abscissa, Json, rounded
from gateway.plotting.reduction import alone, band_samples, drawn_line, known_in, pieces

BAR_HEIGHT = 0.72  # of a row
MANY = 50  # points, that are drawn smaller
DASHES = {Dash.SOLID: "solid", Dash.DASHED: "dash", Dash.DOTTED: "dot"}


@dataclass(frozen=True, slots=True)
class Place:
    """Where marks are drawn.

    Attributes:
        y_axis: in plotly's words.
        x: how x is written.
        over_time: x is the time.
        points_max: of a line, about.
    """

    y_axis: str
    x: Abscissa
    over_time: bool
    points_max: int


def traces(marks: Sequence[Mark], place: Place) -> list[Json]:
    """Those with data, in their order; all bars of a panel are one."""
    bars = [mark for mark in marks if isinstance(mark, Bar)]
    drawn = [_trace(mark, place) for mark in marks if not isinstance(mark, Bar | Span | Level)]
    return ([_bars(bars, place)] if bars else []) + drawn


def shapes(marks: Sequence[Mark], place: Place) -> list[Json]:
    """Those without data."""
    spans = [_span(mark, place) for mark in marks if isinstance(mark, Span)]
    return spans + [_level(mark, place) for mark in marks if isinstance(mark, Level)]


def _trace(mark: Line | Band | Points | Arrows, place: Place) -> Json:
    match mark:
        case Line():
            drawn = _line(mark, place)
        case Band():
            drawn = _band(mark, place)
        case Points():
            drawn = _points(mark, place)
        case Arrows():
            drawn = _arrows(mark, place)
        case _:
            assert_never(mark)
    return {"type": "scatter", "name": escape(mark.name), "yaxis": place.y_axis} | drawn


def _line(line: Line, place: Place) -> Json:
    x, y = drawn_line(line, place.points_max, over_time=place.over_time)
    colour = DAY[line.colour]
    look: Json = {"color": colour, "width": line.width, "dash": DASHES[line.dash]}
    return {
        "mode": "lines",
        "x": place.x(x),
        "y": rounded(y),
        "line": look | ({"shape": "hv"} if line.step else {}),
    } | _lonely(y, colour)


def _lonely(value: FloatArray, colour: str) -> Json:
    """A sample between gaps is drawn as a point."""
    lonely = alone(value)
    if not lonely.any():
        return {}
    return {
        "mode": "lines+markers",
        "marker": {"color": colour, "size": np.where(lonely, 4, 0).tolist(), "line": {"width": 0}},
    }


def _band(band: Band, place: Place) -> Json:
    """Each piece without a gap is a surface: there along the upper edge, and back along the lower."""
    kept = band_samples(band, place.points_max)
    x, low, high = band.x[kept], band.low[kept], band.high[kept]
    found = pieces(x, low, high)
    across: list[list[object]] = [place.x(np.concatenate((x[one], x[one][::-1]))) for one in found]
    upward = [rounded(np.concatenate((high[one], low[one][::-1]))) for one in found]
    return {
        "mode": "lines",
        "x": _parted(across),
        "y": _parted(upward),
        "fill": "toself",
        "fillcolor": filled(DAY[band.colour], BAND_OPACITY),
        "line": {"width": 0},
        "hoverinfo": "skip",
    }


def _parted(parts: Sequence[Sequence[object]]) -> list[object]:
    """One after the other, with a gap between."""
    return list(chain.from_iterable((*part, None) for part in parts))[:-1]


def _points(points: Points, place: Place) -> Json:
    known = np.isfinite(points.x)
    drawn: Json = {
        "mode": "markers",
        "x": place.x(points.x[known]),
        "y": rounded(points.y[known]),
        "marker": {"color": DAY[points.colour], "size": 4 if len(points.x) > MANY else 8},
    }
    if points.labels:
        drawn |= {"text": _worded(points.labels, known), "hoverinfo": "text"}
    if points.written:
        drawn |= {"mode": "markers+text", "textposition": "top center", "textfont": {"size": 10}}
    if points.error is not None:
        drawn["error_y"] = {"type": "data", "array": rounded(points.error[known]), "thickness": 1, "width": 2}
    return drawn


def _arrows(arrows: Arrows, place: Place) -> Json:
    """Each from its tail, without a mark, to its head, which points away from the tail; then a gap."""
    known = known_in(arrows.x, arrows.y, arrows.dx, arrows.dy)
    across = np.column_stack((arrows.x, arrows.x + arrows.dx))[known]
    upward = np.column_stack((arrows.y, arrows.y + arrows.dy))[known]
    drawn: Json = {
        "mode": "lines+markers",
        "x": _parted([place.x(one) for one in across]),
        "y": _parted([rounded(one) for one in upward]),
        "line": {"color": DAY[arrows.colour], "width": 1.5},
        "marker": {
            "color": DAY[arrows.colour],
            "symbol": "arrow",
            "angleref": "previous",
            "size": [0, 10, 0] * len(across),
            "opacity": 1.0,
            "line": {"width": 0},
        },
        "hoverinfo": "name",
    }
    if arrows.labels:
        drawn |= {"text": _parted([[one, one] for one in _worded(arrows.labels, known)]), "hoverinfo": "text"}
    return drawn


def _worded(labels: Sequence[str], known: NDArray[np.bool_]) -> list[str]:
    return [escape(label) for label, shown in zip(labels, known.tolist(), strict=True) if shown]


def _bars(bars: Sequence[Bar], place: Place) -> Json:
    begins, ends = (np.array(edge) for edge in zip(*((bar.from_x, bar.to_x) for bar in bars), strict=True))
    base, until = place.x(begins), place.x(ends)
    colours = [DAY[bar.colour] for bar in bars]
    words = [escape(bar.label) for bar in bars]
    return {
        "type": "bar",
        "orientation": "h",
        "yaxis": place.y_axis,
        "base": base,
        "x": [to - begin for begin, to in zip(base, until, strict=True)],
        "y": [bar.row for bar in bars],
        "width": BAR_HEIGHT,
        "marker": {"color": colours, "line": {"width": 0}},
        "text": words,
        "textposition": "inside",
        "insidetextanchor": "middle",
        "textangle": 0,
        "insidetextfont": {"color": [ink(colour) for colour in colours]},
        "hovertext": [escape(bar.text) or word for bar, word in zip(bars, words, strict=True)],
        "hoverinfo": "text",
        "showlegend": False,
    }


def _span(span: Span, place: Place) -> Json:
    x0, x1 = place.x(np.array([span.from_x, span.to_x]))
    return {
        "type": "rect",
        "name": escape(span.name),
        "x0": x0,
        "x1": x1,
        "yref": f"{place.y_axis} domain",
        "y0": 0,
        "y1": 1,
        "layer": "below",
        "fillcolor": filled(DAY[span.colour], SPAN_OPACITY),
        "line": {"width": 0},
    }


def _level(level: Level, place: Place) -> Json:
    colour = DAY[level.colour]
    return {
        "type": "line",
        "xref": "paper",
        "x0": 0,
        "x1": 1,
        "yref": place.y_axis,
        "y0": level.y,
        "y1": level.y,
        "line": {"color": colour, "width": 1.4, "dash": "dash"},
        "label": {"text": escape(level.name), "textposition": "end", "font": {"color": colour, "size": 11}},
    }
