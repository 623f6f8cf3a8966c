"""A figure as plotly.js takes it: plain values for JSON. Colours of text and grid, and margins, are left to the page.

Colours are those of the day; `gateway.plotting.palette.night_colours` tells what they are on a dark ground.
"""

from __future__ import annotations

from collections.abc import Iterable

from gateway.plotting.figure import Figure
from gateway.plotting.plotly_axes import Json, abscissa, axes, height_px
from gateway.plotting.plotly_marks import Place, shapes, traces


def to_plotly(figure: Figure, begin_s: float | None = None) -> Json:
    """`data` and `layout`, reduced to what can be seen, with all peaks; `layout["height"]` is in pixels.

    Args:
        figure: what is drawn.
        begin_s: beginning of the dive in unix seconds: times are times of day then, in UTC; None: they are minutes
            and seconds since that beginning.
    """
    x = abscissa(figure, begin_s)
    data: list[Json] = []
    behind: list[Json] = []
    for index, panel in enumerate(figure.panels):
        place = Place(index + 1, x, figure.over_time)
        data += traces(panel.marks, place)
        behind += shapes(panel.marks, place)
    layout = axes(figure, x) | {"shapes": behind, "height": height_px(figure), "barmode": "overlay"}
    layout |= {"uniformtext": {"minsize": 9, "mode": "hide"}, "hoversubplots": "axis"}
    layout["hovermode"] = "x unified" if _compared(figure) else "closest"
    _name_once([*data, *behind])
    return {"data": data, "layout": layout}


def _compared(figure: Figure) -> bool:
    """Whether one wants to know what all lines are at the same x."""
    return not any(panel.equal or panel.rows for panel in figure.panels)


def _name_once(drawn: Iterable[Json]) -> None:
    """In the legend, what has the same name stands once, and goes and comes together."""
    seen: set[str] = set()
    for one in drawn:
        name = one.get("name", "")
        if name:
            one |= {"legendgroup": name, "showlegend": name not in seen}
            seen.add(name)
        else:
            one["showlegend"] = False
