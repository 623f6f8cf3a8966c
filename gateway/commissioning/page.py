"""The page of a commissioning: what was learnt, how sure that is, what is missing, and what it was learnt from."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from operator import attrgetter
from pathlib import Path

from gateway.commissioning.part import Part, told_once
from gateway.commissioning.session import Commissioning
from gateway.plotting.clock import clock
from gateway.plotting.pages import Drawings, Place, environment

TEMPLATES = Path(__file__).parent / "templates"


@dataclass(frozen=True, slots=True)
class Section:
    """A part with the places of its figures."""

    part: Part
    name: str
    places: Sequence[Place]


def page(found: Commissioning, vehicle: str, source: Path) -> str:
    """One HTML file that needs nothing else.

    Args:
        found: what came of it.
        vehicle: its name.
        source: the configuration that it began with.
    """
    drawings = Drawings.of([figure for part in found.parts for figure in part.figures])
    return (
        environment(TEMPLATES)
        .get_template("commissioning.html")
        .render(
            vehicle=vehicle,
            source=source.name,
            written=found.text is not None,
            complete=found.complete,
            dives=[(dive.name, clock(round(dive.duration_s)), len(dive.findings)) for dive in found.dives],
            missing=list(told_once(found.parts, attrgetter("missing"))),
            settings=found.settings,
            sections=list(_sections(found.parts, drawings.places)),
            drawings=drawings.packed,
            text=found.text,
        )
    )


def _sections(parts: Sequence[Part], places: Sequence[Place]) -> Iterator[Section]:
    """Places come in the order of the figures."""
    first = 0
    for part in parts:
        last = first + len(part.figures)
        yield Section(part, part.subject[:1].upper() + part.subject[1:], places[first:last])
        first = last
