"""The pieces that the plots of a report are made of, as plotly.js takes them: plain values for JSON.

Times are milliseconds since the start on an axis of dates, so that they read as minutes and seconds at any zoom.
Colours are readable on a light and a dark ground; those of text and grid are left to the page.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import floor, log10
from typing import Any

import numpy as np

from detectors.verdict import Level
from gateway.plotting.decimation import decimated
from hil_tests.report.outcome import FloatArray, Outcome
from hil_tests.scenario.fault import Fault

POINTS_MAX = 500  # twice what a phone has across, and no fewer than one sees on a desk
DIGITS = 4
HOUR_S = 3600.0
# The start of a play on the axis: small numbers would be taken for years. Its time of day is 0:00.
ORIGIN_MS = 86_400_000
SCORE_SHOWN_MAX = 10.0

LEVELS = {Level.UNKNOWN: "#8d99a6", Level.NORMAL: "#2f9e5b", Level.SUSPECT: "#e09f00", Level.FAULT: "#d62839"}
MEASURED, HEALTHY, COMMAND, SCORE, OTHER = "#2a84e0", "#e88a12", "#8a66e0", "#d0428e", "#1a9aa0"
FAULT_FILL, FAULT_LINE = "rgba(214,40,57,0.10)", "rgba(214,40,57,0.75)"

Json = dict[str, Any]


@dataclass(frozen=True, slots=True)
class Figure:
    """A plot.

    Attributes:
        title: what it shows.
        data, layout: as plotly.js takes them.
        height_px: of it.
        main: whether it is drawn without being asked for.
    """

    title: str
    data: Sequence[Json]
    layout: Json
    height_px: int = 260
    main: bool = True

    @property
    def json(self) -> Json:
        """For the page."""
        return {"data": list(self.data), "layout": self.layout | {"height": self.height_px}}


def instant(since_s: float) -> int:
    """A time on the axis, in milliseconds."""
    return ORIGIN_MS + round(1000.0 * since_s)


def line(
    name: str, since_s: FloatArray, value: FloatArray, colour: str, *, axis: int = 1, **style: str | float
) -> Json:
    """A line over time.

    Args:
        name: in the legend.
        since_s, value: (N,) seconds since the start, and what is drawn; infinity and NaN are gaps.
        colour: of it.
        axis: number of its y axis.
        style: of the line, e.g. `dash="dot"`.
    """
    drawn = np.where(np.isfinite(value), value, np.nan)
    kept = decimated(drawn, POINTS_MAX)
    return {
        "type": "scatter",
        "mode": "lines",
        "name": name,
        "x": (ORIGIN_MS + np.rint(1000.0 * since_s[kept]).astype(int)).tolist(),
        "y": rounded(drawn[kept]),
        "yaxis": f"y{axis}" if axis > 1 else "y",
        "line": {"color": colour, "width": 1.6} | style,
    }


def rounded(value: FloatArray) -> list[float | None]:
    """To as many digits as one can see beside the largest; None, which is a gap, for what is no number."""
    finite = np.isfinite(value)
    largest = float(np.abs(value[finite]).max(initial=0.0))
    decimals = DIGITS - 1 - floor(log10(largest)) if largest else 0
    found = np.round(value, decimals).astype(object)
    found[~finite] = None
    return list(found.tolist())


def time_axis(outcome: Outcome, **settings: object) -> Json:
    """From the start to the end of the play."""
    length_s = outcome.end_s - outcome.start_s
    clock = "%-H:%M:%S" if length_s >= HOUR_S else "%-M:%S"
    return {
        "type": "date",
        "range": [ORIGIN_MS, instant(length_s)],
        "tickformat": clock,
        "hoverformat": f"{clock}.%2f",
        "nticks": 8,
    } | settings


def rows(*titles: str, shares: Sequence[float] = ()) -> Json:
    """Y axes one below the other over one time axis.

    Args:
        titles: of the axes, from the top.
        shares: how high they are, relative to each other; empty: all the same.
    """
    heights = np.array(shares or [1.0] * len(titles))
    edges = 1.0 - np.concatenate(([0.0], np.cumsum(heights / heights.sum())))
    axes = {}
    for index, title in enumerate(titles):
        gap = 0.03 if index else 0.0
        domain = [round(max(edges[index + 1], 0.0), 4), round(edges[index] - gap, 4)]
        axes[f"yaxis{index + 1}" if index else "yaxis"] = {"title": {"text": title}, "domain": domain}
    return axes


def happened(faults: Sequence[Fault], length_s: float) -> list[Json]:
    """Shapes behind a plot: when there were faults, and their onsets."""
    shapes: list[Json] = []
    for fault in faults:
        from_ms, to_ms = instant(fault.at_s), instant(min(fault.until_s, length_s))
        place = {"xref": "x", "yref": "paper", "y0": 0, "y1": 1, "layer": "below"}
        band = {"type": "rect", "x0": from_ms, "x1": to_ms, "fillcolor": FAULT_FILL, "line": {"width": 0}}
        onset = {
            "type": "line",
            "x0": from_ms,
            "x1": from_ms,
            "line": {"color": FAULT_LINE, "width": 1, "dash": "dot"},
        }
        shapes += [place | band, place | onset]
    return shapes


def threshold(row: int) -> Json:
    """A line across a row of scores where FAULT begins."""
    axis = f"y{row}" if row > 1 else "y"
    dashed = {"color": LEVELS[Level.FAULT], "width": 1.2, "dash": "dash"}
    return {"type": "line", "xref": "paper", "x0": 0, "x1": 1, "yref": axis, "y0": 1, "y1": 1, "line": dashed}


def score_axis(layout: Json, row: int, values: Iterable[Sequence[float | None]]) -> None:
    """Cut the axis of a row of scores where the threshold would no longer be seen, and say so."""
    highest = max((value for one in values for value in one if value is not None), default=0.0)
    axis = layout[f"yaxis{row}" if row > 1 else "yaxis"]
    axis["range"] = [0.0, min(max(1.25, 1.1 * highest), SCORE_SHOWN_MAX)]
    if highest > SCORE_SHOWN_MAX:
        axis["title"] = {"text": f"score, cut at {SCORE_SHOWN_MAX:g}"}
