"""A figure of the links: what came over them, how full buses were, and what was lost."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import cycle

import numpy as np

from gateway.plotting.figure import Colour, Figure, FloatArray, Line, Mark, Panel, Span
from gateway.report.dive import Dive, LinkCourse
from gateway.report.drawable import largest, panels

COLOURS = (Colour.MEASURED, Colour.PREDICTED, Colour.COMMAND, Colour.OTHER, Colour.RESIDUAL)


def link_figures(dive: Dive) -> Iterator[Figure]:
    """One for all links; none where nothing came."""
    links = [link for link in dive.links if len(link.time_s)]
    down = tuple(_down(links))
    drawn = panels(
        _counted("readings a second", (*down, *_lines(links, lambda link: link.readings_per_s))),
        Panel("bus load, %", (*down, *_lines(links, lambda link: 100.0 * link.load)), y_range=(0.0, 100.0)),
        _counted("lost a second", (*down, *_lines(links, _lost))),
    )
    if drawn:
        about = "What came over each link. Frames that were lost were never judged."
        yield Figure("links", "Links", drawn, about, main=bool(down) or any(link.lost.any() for link in links))


def _counted(title: str, marks: tuple[Mark, ...]) -> Panel:
    """From 0 on."""
    highest = max((largest(mark.y) for mark in marks if isinstance(mark, Line)), default=0.0)
    return Panel(title, marks, y_range=(0.0, 1.1 * highest or 1.0))


def _lines(links: list[LinkCourse], column: Callable[[LinkCourse], FloatArray]) -> Iterator[Mark]:
    for link, colour in zip(links, cycle(COLOURS), strict=False):
        yield Line(link.name, link.time_s, column(link), colour, step=True)


def _lost(link: LinkCourse) -> FloatArray:
    """Of a link that never lost anything there is nothing to see."""
    return link.lost if np.any(link.lost > 0.0) else np.full(len(link.lost), np.nan)


def _down(links: list[LinkCourse]) -> Iterator[Mark]:
    for link in links:
        for from_s, to_s in link.down.tolist():
            yield Span(f"{link.name} down", from_s, to_s, Colour.FAULT)
