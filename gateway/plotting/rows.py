"""Rows of a time line as marks: bars for what lasted, points for moments."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import cycle

import numpy as np

from gateway.plotting.clock import clock
from gateway.plotting.figure import Bar, Colour, Mark, Panel, Points

NEUTRAL = (Colour.OTHER, Colour.COMMAND, Colour.MEASURED, Colour.FAINT)


@dataclass(frozen=True, slots=True)
class Piece:
    """Something that lasted, in seconds since the beginning. `label`, `text`: as of a `Bar`, but the text begins with
    the times."""

    from_s: float
    to_s: float
    colour: Colour
    label: str
    text: str = ""


@dataclass(frozen=True, slots=True)
class Moment:
    """Something at an instant. `name`: in the legend. `text`: shown with the time, where it is pointed at."""

    since_s: float
    name: str
    colour: Colour
    text: str


@dataclass(frozen=True, slots=True)
class Row:
    """A row of a time line."""

    name: str
    pieces: Sequence[Piece] = ()
    moments: Sequence[Moment] = ()


def told_apart(names: Iterable[str]) -> Mapping[str, Colour]:
    """A colour for each name, of those that say neither good nor bad; neighbours in order have different ones."""
    return dict(zip(dict.fromkeys(names), cycle(NEUTRAL), strict=False))


def rows_panel(rows: Sequence[Row]) -> Panel:
    """All of them, one below the other, moments before pieces."""
    return Panel("", (*_bars(rows), *_points(rows)), rows=tuple(row.name for row in rows))


def _bars(rows: Sequence[Row]) -> Iterator[Mark]:
    for index, row in enumerate(rows):
        for one in row.pieces:
            told = f"{clock(one.from_s)} to {clock(one.to_s)}: {one.label}"
            text = f"{told}, {one.text}" if one.text else told
            yield Bar(index, one.from_s, one.to_s, one.colour, one.label, text)


def _points(rows: Sequence[Row]) -> Iterator[Mark]:
    """Those of the same name are one mark."""
    placed = [(index, one) for index, row in enumerate(rows) for one in row.moments]
    for name, colour in dict.fromkeys((one.name, one.colour) for _, one in placed):
        alike = [(index, one) for index, one in placed if (one.name, one.colour) == (name, colour)]
        x, y = np.array([one.since_s for _, one in alike]), np.array([float(index) for index, _ in alike])
        yield Points(name, x, y, colour, tuple(f"{clock(one.since_s)} {one.text}" for _, one in alike))
