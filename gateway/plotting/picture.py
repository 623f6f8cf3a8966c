"""A figure as a picture: PNG or SVG, the same bytes for the same figure."""

from __future__ import annotations

from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any
from warnings import catch_warnings, filterwarnings

from gateway.plotting.clock import clock
from gateway.plotting.extent import reach, time_ticks
from gateway.plotting.figure import Figure, Panel
from gateway.plotting.palette import DARK_INK
from gateway.plotting.picture_marks import draw

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Canvas

SUFFIXES = (".png", ".svg")
WIDTH_IN, DOTS_PER_IN = 10.0, 130
HEAD_IN, PANEL_IN, ROW_IN, MAP_IN = 1.0, 1.7, 0.26, 6.0
ABOUT_LETTERS = 130
LOOK: dict[Any, Any] = {
    "text.parse_math": False,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.labelcolor": DARK_INK,
    "grid.color": "#dde4ea",
    "grid.linewidth": 0.7,
    "font.size": 10.0,
    "text.color": DARK_INK,
    "legend.frameon": False,
    "legend.fontsize": 9.0,
    # the same figure is the same file, and its words can be searched
    "svg.hashsalt": "gateway",
    "svg.fonttype": "none",
}


def save_picture(figure: Figure, path: Path) -> None:
    """Write the picture; by its suffix a PNG or an SVG.

    Raises:
        ValueError: another suffix.
        OSError: it cannot be written.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise ValueError(f"path = {path}: want a name that ends in {' or '.join(SUFFIXES)}")
    import matplotlib as mpl

    metadata = {"Date": None} if path.suffix.lower() == ".svg" else {"Software": None}
    with mpl.rc_context(LOOK), catch_warnings():
        filterwarnings(
            "ignore", "Glyph ", UserWarning
        )  # a name in letters that the font lacks: a box stands for each
        canvas_of(figure).savefig(path, dpi=DOTS_PER_IN, facecolor="white", metadata=metadata)


def canvas_of(figure: Figure) -> Canvas:
    """As matplotlib has it."""
    from matplotlib.figure import Figure as Canvas

    heights = [_height_in(panel) for panel in figure.panels]
    canvas = Canvas(figsize=(WIDTH_IN, HEAD_IN + sum(heights)), layout="constrained")
    several = canvas.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights)[:, 0]
    x_range = reach(figure)
    seen: set[str] = set()
    for axes, panel in zip(several, figure.panels, strict=True):
        draw(axes, panel.marks, x_range, over_time=figure.over_time)
        _dress(axes, panel)
        _name(axes, panel, seen)
    _across(several[-1], figure, x_range)
    canvas.suptitle(figure.title, x=0.01, ha="left", fontsize=13, fontweight="bold")
    if figure.about:
        canvas.supxlabel(fill(figure.about, ABOUT_LETTERS), x=0.01, ha="left", fontsize=8.5)
    return canvas


def _dress(axes: Axes, panel: Panel) -> None:
    axes.set_title(panel.y_title, loc="left", fontsize=9.5, pad=4.0)
    if panel.rows:
        axes.set_yticks(range(len(panel.rows)), panel.rows)
        axes.set_ylim(len(panel.rows) - 0.5, -0.5)
        axes.grid(visible=False, axis="y")
    elif panel.y_range is not None:
        axes.set_ylim(panel.y_range)
    if panel.equal:
        axes.set_aspect("equal", adjustable="datalim")


def _name(axes: Axes, panel: Panel, seen: set[str]) -> None:
    """A legend of what was not named yet."""
    named: dict[str, Any] = {}
    for handle, name in zip(*axes.get_legend_handles_labels(), strict=True):
        if name not in seen and not panel.explains(name):
            named.setdefault(name, handle)
    seen.update(named)
    if named:
        axes.legend(
            named.values(), named.keys(), loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=7, borderaxespad=0.2
        )


def _across(axes: Axes, figure: Figure, x_range: tuple[float, float]) -> None:
    if not figure.over_time:
        axes.set_xlabel(figure.x_title)
        return
    ticks_s = time_ticks(*x_range)
    axes.set_xlim(x_range)
    axes.set_xticks(ticks_s, [clock(float(one)) for one in ticks_s])
    axes.set_xlabel("time since the beginning")


def _height_in(panel: Panel) -> float:
    if panel.rows:
        return ROW_IN * len(panel.rows) + 0.1
    return (MAP_IN if panel.equal else PANEL_IN) * panel.share
