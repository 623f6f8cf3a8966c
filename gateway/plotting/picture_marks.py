"""Marks as matplotlib draws them."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby
from typing import TYPE_CHECKING, assert_never

import numpy as np

from gateway.plotting.figure import Arrows, Band, Bar, Dash, Level, Line, Mark, Points, Span
from gateway.plotting.palette import BAND_OPACITY, DAY, SPAN_OPACITY, ink
from gateway.plotting.reduction import alone, band_samples, drawn_line, known_in

if TYPE_CHECKING:
    from matplotlib.axes import Axes

POINTS_MAX = 2000  # twice what a picture has across
BAR_HEIGHT = 0.72  # of a row
LETTER_SHARE = 0.008  # of the width of the axes, for a letter of a bar's label
DASHES = {Dash.SOLID: "-", Dash.DASHED: "--", Dash.DOTTED: ":"}


def draw(axes: Axes, marks: Sequence[Mark], x_range: tuple[float, float], *, over_time: bool) -> None:
    """Draws them in their order, what has no data behind.

    Args:
        axes: to draw on.
        marks: of one panel.
        x_range: lowest and highest x of the figure.
        over_time: x is the time.
    """
    _bars(axes, [mark for mark in marks if isinstance(mark, Bar)], x_range)
    for mark in marks:
        if not isinstance(mark, Bar):
            _draw(axes, mark, mark.name or "_", over_time)


def _draw(axes: Axes, mark: Line | Band | Points | Arrows | Span | Level, label: str, over_time: bool) -> None:
    match mark:
        case Line():
            _line(axes, mark, label, over_time)
        case Band():
            _band(axes, mark, label)
        case Points():
            _points(axes, mark, label)
        case Arrows():
            _arrows(axes, mark, label)
        case Span():
            axes.axvspan(
                mark.from_x, mark.to_x, color=DAY[mark.colour], alpha=SPAN_OPACITY, lw=0, zorder=0, label=label
            )
        case Level():
            _level(axes, mark)
        case _:
            assert_never(mark)


def _line(axes: Axes, line: Line, label: str, over_time: bool) -> None:
    x, y = drawn_line(line, POINTS_MAX, over_time=over_time)
    style = "steps-post" if line.step else "default"
    axes.plot(x, y, color=DAY[line.colour], lw=line.width, ls=DASHES[line.dash], drawstyle=style, label=label)
    lonely = alone(y)
    if lonely.any():
        axes.plot(x[lonely], y[lonely], ".", color=DAY[line.colour], ms=4)


def _band(axes: Axes, band: Band, label: str) -> None:
    kept = band_samples(band, POINTS_MAX)
    x, low, high = band.x[kept], band.low[kept], band.high[kept]
    known = known_in(x, low, high)
    axes.fill_between(
        x, low, high, where=known.tolist(), color=DAY[band.colour], alpha=BAND_OPACITY, lw=0, label=label
    )


def _points(axes: Axes, points: Points, label: str) -> None:
    colour, size = DAY[points.colour], 3.0 if len(points.x) > 50 else 5.0
    if points.error is None:
        axes.plot(points.x, points.y, "o", color=colour, ms=size, mew=0, label=label)
    else:
        axes.errorbar(
            points.x, points.y, points.error, fmt="o", color=colour, ms=size, mew=0, elinewidth=1, label=label
        )
    if points.written:
        for x, y, words in zip(points.x, points.y, points.labels, strict=True):
            axes.annotate(words, (x, y), (0.0, 4.0), textcoords="offset points", fontsize=8, ha="center")


def _arrows(axes: Axes, arrows: Arrows, label: str) -> None:
    known = known_in(arrows.x, arrows.y, arrows.dx, arrows.dy)
    x, y, dx, dy = (column[known] for column in (arrows.x, arrows.y, arrows.dx, arrows.dy))
    axes.quiver(
        x, y, dx, dy, color=DAY[arrows.colour], angles="xy", scale_units="xy", scale=1.0, width=0.0026, label=label
    )
    # arrows alone do not widen the axes
    axes.update_datalim(np.column_stack((np.concatenate((x, x + dx)), np.concatenate((y, y + dy)))))
    axes.autoscale_view()


def _level(axes: Axes, level: Level) -> None:
    colour = DAY[level.colour]
    axes.axhline(level.y, color=colour, lw=1.3, ls="--")
    axes.text(
        1.0,
        level.y,
        level.name,
        color=colour,
        fontsize=8,
        ha="right",
        va="bottom",
        transform=axes.get_yaxis_transform(),
    )


def _bars(axes: Axes, bars: Sequence[Bar], x_range: tuple[float, float]) -> None:
    for row, several in groupby(sorted(bars, key=lambda bar: bar.row), key=lambda bar: bar.row):
        of_row = list(several)
        lengths = [(bar.from_x, bar.to_x - bar.from_x) for bar in of_row]
        colours = [DAY[bar.colour] for bar in of_row]
        axes.broken_barh(lengths, (row - BAR_HEIGHT / 2.0, BAR_HEIGHT), facecolors=colours, lw=0)
    for bar in bars:
        if bar.to_x - bar.from_x > LETTER_SHARE * len(bar.label) * (x_range[1] - x_range[0]):
            _write(axes, bar)


def _write(axes: Axes, bar: Bar) -> None:
    colour = ink(DAY[bar.colour])
    axes.text((bar.from_x + bar.to_x) / 2.0, bar.row, bar.label, color=colour, fontsize=8, ha="center", va="center")
