"""A plot as a value: what is drawn, and nothing of how. `to_plotly` and `save_picture` draw it.

x is the time since the beginning of the dive in seconds where `Figure.over_time`, else any quantity. NaN: a gap.
Colours are names of `Colour`, so that a page may have them darker at night than a picture on paper.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]
# labels that are written beside points
WRITTEN_MAX, LETTERS_MAX = 12, 10


class Colour(StrEnum):
    """What a colour stands for, everywhere in the product."""

    MEASURED = "measured"
    PREDICTED = "predicted"
    COMMAND = "command"
    RESIDUAL = "residual"
    THRESHOLD = "threshold"
    OTHER = "other"
    FAINT = "faint"
    UNKNOWN = "unknown"
    NORMAL = "normal"
    SUSPECT = "suspect"
    FAULT = "fault"


class Dash(StrEnum):
    """Of a line."""

    SOLID = "solid"
    DASHED = "dashed"
    DOTTED = "dotted"


@dataclass(frozen=True, slots=True)
class Line:
    """(N,) x and y, joined; `step`: y holds until the next x."""

    name: str
    x: FloatArray
    y: FloatArray
    colour: Colour
    dash: Dash = Dash.SOLID
    width: float = 1.6
    step: bool = False


@dataclass(frozen=True, slots=True)
class Band:
    """(N,) x, low and high: what lies between is filled."""

    name: str
    x: FloatArray
    low: FloatArray
    high: FloatArray
    colour: Colour


@dataclass(frozen=True, slots=True)
class Points:
    """(N,) x and y; `error`: (N,) standard deviations. `labels`: of each, or none; shown where it is pointed at, and
    written beside it where they are few and short."""

    name: str
    x: FloatArray
    y: FloatArray
    colour: Colour
    labels: tuple[str, ...] = ()
    error: FloatArray | None = None

    @property
    def written(self) -> bool:
        """Whether there is room for the labels."""
        return 0 < len(self.labels) <= WRITTEN_MAX and max(map(len, self.labels)) <= LETTERS_MAX


@dataclass(frozen=True, slots=True)
class Arrows:
    """(N,) from x, y by dx, dy, in the units of the axes; `labels`: of each, or none."""

    name: str
    x: FloatArray
    y: FloatArray
    dx: FloatArray
    dy: FloatArray
    colour: Colour
    labels: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Span:
    """A stretch of x behind everything, such as the time of a fault."""

    name: str
    from_x: float
    to_x: float
    colour: Colour


@dataclass(frozen=True, slots=True)
class Level:
    """A line across at y, such as a threshold."""

    name: str
    y: float
    colour: Colour = Colour.THRESHOLD


@dataclass(frozen=True, slots=True)
class Bar:
    """A piece of a row of a time line. `row`: index into the panel's `rows`, from the top. `label`: written on it,
    where it is long enough. `text`: shown where it is pointed at; none: the label."""

    row: int
    from_x: float
    to_x: float
    colour: Colour
    label: str
    text: str = ""


Mark: TypeAlias = Line | Band | Points | Arrows | Span | Level | Bar


@dataclass(frozen=True, slots=True)
class Panel:
    """One pair of axes.

    Attributes:
        y_title: quantity and unit.
        marks: in the order in which they are drawn.
        share: how high it is, relative to the others.
        y_range: of the axis; None: all that is drawn.
        equal: both axes have the same scale, as on a map.
        rows: names of the rows of `Bar`s; empty: y is a number.
    """

    y_title: str
    marks: tuple[Mark, ...]
    share: float = 1.0
    y_range: tuple[float, float] | None = None
    equal: bool = False
    rows: tuple[str, ...] = ()

    def explains(self, name: str) -> bool:
        """Whether the title tells what a mark of that name is, so that a legend need not."""
        return not name or self.y_title.startswith(name)


@dataclass(frozen=True, slots=True)
class Figure:
    """Panels one below the other with one x axis.

    Attributes:
        name: of a file: letters, digits and dashes.
        title: what it shows.
        panels: from the top.
        about: a sentence for who reads it for the first time.
        over_time: x is seconds since the beginning of the dive.
        x_title: quantity and unit, where x is not the time.
        x_range: of the axis, where it is the time; None: all that is drawn.
        main: it is drawn without being asked for.
    """

    name: str
    title: str
    panels: tuple[Panel, ...]
    about: str = ""
    over_time: bool = True
    x_title: str = ""
    x_range: tuple[float, float] | None = None
    main: bool = True
