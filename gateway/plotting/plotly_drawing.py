"""A figure as plotly.js takes it: plain values for JSON. Colours of text and grid, and margins, are left to the page.

Colours are those of the day; `gateway.plotting.palette.night_colours` tells what they are on a dark ground.
"""

from __future__ import annotations

from collections.abc import Iterable

from gateway.plotting.figure import Figure, Panel
from gateway.plotting.plotly_axes import Json, abscissa, axes, frame, y_name
from gateway.plotting.plotly_marks import Place, shapes, traces

# More than twice what a phone has across, and no fewer than one sees on a desk. Where something is looked for, one
# zooms in.
POINTS_MAX, MAIN_POINTS_MAX = 1000, 4000


def to_plotly(figure: Figure, begin_s: float | None = None) -> Json:
    """`data` and `layout`, reduced to what can be seen, with all peaks; `layout["height"]` is in pixels.

    Args:
        figure: what is drawn.
        begin_s: beginning of the dive in unix seconds: times are times of day then, in UTC; None: they are minutes
            and seconds since that beginning.
    """
    x, points_max = abscissa(figure, begin_s), MAIN_POINTS_MAX if figure.main else POINTS_MAX
    data: list[Json] = []
    behind: list[Json] = []
    seen: set[str] = set()
    for index, panel in enumerate(figure.panels):
        place = Place(y_name(index), x, figure.over_time, points_max)
        drawn, below = traces(panel.marks, place), shapes(panel.marks, place)
        _name([*drawn, *below], panel, seen)
        data += drawn
        behind += below
    layout = axes(figure, x) | frame(figure) | {"shapes": behind, "barmode": "overlay", "hoversubplots": "axis"}
    layout["uniformtext"] = {"minsize": 9, "mode": "hide"}
    layout["hovermode"] = "x unified" if _compared(figure) else "closest"
    return {"data": data, "layout": layout}


def _compared(figure: Figure) -> bool:
    """Whether one wants to know what all lines are at the same x."""
    return not any(panel.equal or panel.rows for panel in figure.panels)


def _name(drawn: Iterable[Json], panel: Panel, seen: set[str]) -> None:
    """In the legend, what has the same name stands once, and goes and comes together."""
    for one in drawn:
        name = one.get("name", "")
        one["showlegend"] = not panel.explains(name) and name not in seen
        if one["showlegend"] or name in seen:
            one["legendgroup"] = name
            seen.add(name)
