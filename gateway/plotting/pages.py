"""Pages with figures: one HTML file each, which needs no network and, but for its figures, no script.

The templates beside this module are their common pieces: `figure_style.html`, `figure_script.html`, and the macros of
`figure_places.html`. A page has one element with `data-drawings` around the places of its figures.
"""

from __future__ import annotations

import json
from base64 import b64encode
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from gzip import compress
from pathlib import Path
from typing import TYPE_CHECKING

from gateway.plotting.figure import Figure
from gateway.plotting.palette import night_colours
from gateway.plotting.plotly_drawing import to_plotly

if TYPE_CHECKING:
    from jinja2 import Environment

PIECES = Path(__file__).parent / "templates"
PACKING = 6  # beyond it, a few hundredths less for four times the time


@dataclass(frozen=True, slots=True)
class Place:
    """What a page knows of a figure before it is drawn.

    Attributes:
        number: of its drawing.
        name, title, about, main: of the figure; an empty name is no anchor.
        height_px: that it will have.
    """

    number: int
    name: str
    title: str
    about: str
    main: bool
    height_px: int


@dataclass(frozen=True, slots=True)
class Drawings:
    """Figures as a page has them. `packed`: of all of them, in the order of `places`."""

    places: Sequence[Place]
    packed: str

    @classmethod
    def of(cls, figures: Sequence[Figure]) -> Drawings:
        """Draws them."""
        drawn = [to_plotly(figure) for figure in figures]
        places = [
            Place(number, one.name, one.title, one.about, one.main, drawing["layout"]["height"])
            for number, (one, drawing) in enumerate(zip(figures, drawn, strict=True))
        ]
        return cls(places, packed(json.dumps(drawn, separators=(",", ":"), allow_nan=False)))


def environment(folder: Path) -> Environment:
    """Where templates are found: those of a page's own folder, and the common pieces. What logs say is escaped."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    pages = Environment(loader=FileSystemLoader([folder, PIECES]), autoescape=True, undefined=StrictUndefined)
    pages.globals |= {"plotly": library, "night": night_colours()}
    return pages


def packed(text: str) -> str:
    """The text as the page's script unpacks it: gzip in base64; the same text gives the same letters."""
    return b64encode(compress(text.encode(), PACKING, mtime=0)).decode()


@cache
def library() -> str:
    """What draws in the page: plotly.js, packed."""
    from plotly.offline import get_plotlyjs

    return packed(get_plotlyjs())
