"""Axes of a figure as plotly.js takes them: panels one below the other over one x axis."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
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
GAP = 0.035  # between panels, as a share of the height
HEAD_PX, PANEL_PX, ROW_PX, MAP_PX = 70, 120, 26, 360


@dataclass(frozen=True, slots=True)
class TimeAxis:
    """Times since the beginning of the dive as an axis of dates has them: readable at any zoom.

    Attributes:
        origin_ms: of that beginning.
    """

    origin_ms: int = ORIGIN_MS

    def __call__(self, since_s: FloatArray) -> list[int]:
        """(N,) in milliseconds; all must be finite."""
        after_ms = np.rint(1000.0 * np.asarray(since_s, dtype=float)).astype(np.int64)
        return list((self.origin_ms + after_ms).tolist())


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
    across = _time_axis(figure, x) if figure.over_time else {"title": {"text": figure.x_title}}
    found: Json = {"xaxis": across | {"anchor": f"y{last}" if last > 1 else "y"}}
    for index, (panel, domain) in enumerate(zip(figure.panels, _domains(figure), strict=True)):
        found[f"yaxis{index + 1}" if index else "yaxis"] = _upward(panel) | {"domain": domain}
    return found


def height_px(figure: Figure) -> int:
    """Of a figure on a page."""
    return round(HEAD_PX + sum(_panel_px(panel) for panel in figure.panels))


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
    axis: Json = {"title": {"text": panel.y_title}}
    if panel.rows:
        count = len(panel.rows)
        return axis | {
            "tickvals": list(range(count)),
            "ticktext": list(panel.rows),
            "range": [count - 0.5, -0.5],
            "fixedrange": True,
            "zeroline": False,
        }
    if panel.y_range is not None:
        axis["range"] = list(panel.y_range)
    return axis | ({"scaleanchor": "x"} if panel.equal else {})


def _domains(figure: Figure) -> Iterator[list[float]]:
    """From the top."""
    heights = np.array([_panel_px(panel) for panel in figure.panels])
    edges = 1.0 - np.concatenate(([0.0], np.cumsum(heights / heights.sum())))
    for index in range(len(heights)):
        upper = edges[index] - (GAP if index else 0.0)
        yield [round(max(float(edges[index + 1]), 0.0), 4), round(float(upper), 4)]


def _panel_px(panel: Panel) -> float:
    if panel.rows:
        return ROW_PX * len(panel.rows)
    return (MAP_PX if panel.equal else PANEL_PX) * panel.share
