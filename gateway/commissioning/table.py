"""What commissioning came to, in tables for people."""

from __future__ import annotations

from collections.abc import Iterator

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from gateway.commissioning.part import Part
from gateway.commissioning.session import Commissioning


def print_tables(console: Console, found: Commissioning) -> None:
    """What was measured, and after it what is missing and what else is to be said, subject by subject."""
    console.print(_table(found), soft_wrap=False)
    for part in found.parts:
        for line in lines(part):
            style = "yellow" if part.missing else None
            console.print(line, style=style, highlight=False, markup=False, soft_wrap=True)


def lines(part: Part) -> Iterator[str]:
    """What is missing of a subject, and what else is to be said."""
    yield from (f"{part.subject}: missing: {one}" for one in part.missing)
    yield from (f"{part.subject}: {one}" for one in part.remarks)


def _table(found: Commissioning) -> Table:
    table = Table(title=_title(found))
    for heading in ("subject", "what", "value", "how sure"):
        table.add_column(heading, overflow="fold")
    for part in found.parts:
        for place, quantity in enumerate(part.quantities):
            subject = part.subject if place == 0 else ""
            cells = (subject, quantity.name, quantity.value, quantity.sureness)
            table.add_row(*map(escape, cells), end_section=place == len(part.quantities) - 1)
    return table


def _title(found: Commissioning) -> str:
    minutes = sum(dive.duration_s for dive in found.dives) / 60.0
    count = len(found.dives)
    return f"{minutes:.1f} minutes of {count} dive{'' if count == 1 else 's'}"
