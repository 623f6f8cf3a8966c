"""What commissioning came to, in tables for people."""

from __future__ import annotations

from operator import attrgetter

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from gateway.commissioning.part import told_once
from gateway.commissioning.session import Commissioning


def print_tables(console: Console, found: Commissioning) -> None:
    """What was measured, what is missing for more, and what else is to be said."""
    console.print(_table(found))
    for line in told_once(found.parts, attrgetter("missing")):
        console.print(f"missing: {line}", style="yellow", highlight=False, markup=False, soft_wrap=True)
    for line in told_once(found.parts, attrgetter("remarks")):
        console.print(line, highlight=False, markup=False, soft_wrap=True)


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
