"""Axes of a figure as plotly.js takes them: panels one below the other over one x axis."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from html import escape
from math import floor, log10
from typing import Any, TypeAlias

import numpy as np

from gateway.plotting.clock import HOUR_S
from gateway.plotting.extent import reach
from gateway.plotting.figure import Figure, FloatArray, Panel
from gateway.plotting.reduction import gapped

Json: TypeAlias = dict[str, Any]

DIGITS = 5
# The beginning of a dive on an axis of dates: small numbers would be taken for years. Its time of day is 0:00.
ORIGIN_MS = 86_400_000
PANEL_PX, ROW_PX, MAP_PX = 110, 27, 360
# above a panel, with its title or without; above and below all of them; a line of the legend
TITLE_PX, GAP_PX, HEAD_PX, FOOT_PX, LEGEND_PX = 24, 10, 6, 38, 22
TITLE_SIZE = 12


@dataclass(frozen=True, slots=True)
class TimeAxis:
    """Times since the beginning of the dive as an axis of dates has them: readable at any zoom.

    Attributes:
        origin_ms: of that beginning.
    """

    origin_ms: int = ORIGIN_MS

    def __call__(self, since_s: FloatArray) -> list[int | None]:
        """(N,) in milliseconds; None for what is no number."""
        known = np.isfinite(since_s)
        found = (self.origin_ms + np.rint(1000.0 * np.where(known, since_s, 0.0)).astype(np.int64)).astype(object)
        found[~known] = None
        return list(found.tolist())


Abscissa: TypeAlias = Callable[[FloatArray], list[Any]]


def abscissa(figure: Figure, begin_s: float | None) -> Abscissa:
    """How x is written. `begin_s`: unix seconds, for the time of day (UTC); None: time since the beginning."""
    if not figure.over_time:
        return rounded
    return TimeAxis() if begin_s is None else TimeAxis(round(1000.0 * begin_s))


def rounded(value: FloatArray) -> list[float | None]:
    """(N,) to as many digits as one can see beside the largest; None, which is a gap, for what is no number."""
    drawn = gapped(value)
    largest = float(np.nanmax(np.abs(drawn), initial=0.0)) if np.isfinite(drawn).any() else 0.0
    decimals = DIGITS - 1 - floor(log10(largest)) if largest else 0
    found = np.round(drawn, decimals).astype(object)
    found[np.isnan(drawn)] = None
    return list(found.tolist())


def axes(figure: Figure, x: Abscissa) -> Json:
    """`xaxis`, `yaxis`, `yaxis2`... of a layout."""
    last = len(figure.panels)
    across = _time_axis(figure, x) if figure.over_time else {"title": {"text": escape(figure.x_title)}}
    found: Json = {"xaxis": across | {"anchor": y_name(last - 1)}}
    for index, (panel, domain) in enumerate(zip(figure.panels, _domains(figure), strict=True)):
        found[y_name(index).replace("y", "yaxis")] = _upward(panel) | {"domain": domain}
    return found


def y_name(index: int) -> str:
    """What plotly calls the y axis of a panel, from 0: y, y2, y3..."""
    return f"y{index + 1}" if index > 0 else "y"


def frame(figure: Figure) -> Json:
    """What of a layout is around the panels: a title above each, a legend above all, and the sizes."""
    above_px, inner_px = _above_px(figure.panels[0]) if figure.panels else 0, _inner_px(figure)
    return {
        "height": round(HEAD_PX + LEGEND_PX + above_px + inner_px + FOOT_PX),
        "margin": {"l": 40, "r": 12, "t": HEAD_PX + above_px, "b": FOOT_PX},
        "legend": {"orientation": "h", "x": 0, "y": round(1.0 + above_px / inner_px, 4), "yanchor": "bottom"},
        "annotations": [_title(panel, index) for index, panel in enumerate(figure.panels) if panel.y_title],
    }


def _time_axis(figure: Figure, x: Abscissa) -> Json:
    low, high = reach(figure)
    wording = "%-H:%M:%S" if high - low >= HOUR_S else "%-M:%S"
    if isinstance(x, TimeAxis) and x.origin_ms != ORIGIN_MS:
        wording = "%H:%M:%S"
    edges = x(np.array([low, high]))
    return {
        "type": "date",
        "range": edges,
        "tickformat": wording,
        "hoverformat": f"{wording}.%2f",
        "nticks": 8,
    }


def _upward(panel: Panel) -> Json:
    if panel.rows:
        count = len(panel.rows)
        return {
            "tickvals": list(range(count)),
            "ticktext": [escape(row) for row in panel.rows],
            "range": [count - 0.5, -0.5],
            "fixedrange": True,
            "zeroline": False,
        }
    axis: Json = {"nticks": 5} if panel.share < 2.0 and not panel.equal else {}
    axis |= {} if panel.y_range is None else {"range": list(panel.y_range)}
    return axis | ({"scaleanchor": "x"} if panel.equal else {})


def _domains(figure: Figure) -> Iterator[list[float]]:
    """From the top."""
    whole_px = _inner_px(figure)
    lower_px = whole_px
    for index, panel in enumerate(figure.panels):
        upper_px = lower_px - (_above_px(panel) if index else 0)
        lower_px = upper_px - _panel_px(panel)
        yield [round(max(lower_px / whole_px, 0.0), 4), round(upper_px / whole_px, 4)]


def _title(panel: Panel, index: int) -> Json:
    return {
        "text": escape(panel.y_title),
        "font": {"size": TITLE_SIZE},
        "xref": "paper",
        "x": 0,
        "xanchor": "left",
        "yref": f"{y_name(index)} domain",
        "y": 1,
        "yanchor": "bottom",
        "showarrow": False,
    }


def _inner_px(figure: Figure) -> float:
    """From the upper edge of the first panel to the lower edge of the last."""
    between_px = sum(_above_px(panel) for panel in figure.panels[1:])
    return between_px + sum(_panel_px(panel) for panel in figure.panels)


def _above_px(panel: Panel) -> int:
    return TITLE_PX if panel.y_title else GAP_PX


def _panel_px(panel: Panel) -> float:
    if panel.rows:
        return ROW_PX * len(panel.rows)
    return (MAP_PX if panel.equal else PANEL_PX) * panel.share
