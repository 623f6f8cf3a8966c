"""What `gateway hil list` shows: scenarios, failures, vehicles."""

from __future__ import annotations

from collections.abc import Iterable

from rich.table import Table
from rich.text import Text

from hil_tests.profiles import Profile
from hil_tests.scenario.document import Scenario
from hil_tests.scenario.failures import TABLE, FailureKind, Quantity, Target
from hil_tests.scenario.fault import SINGLE

ABOUT_LENGTH = 120

_NUMBERED = {
    Target.THRUSTER: "thruster N",
    Target.RPM: "thruster N rpm",
    Target.COMMAND: "thruster N command",
    Target.BUS: "can0",
}


def scenario_table(scenarios: Iterable[Scenario]) -> Table:
    """One row each."""
    table = _table("scenario", "vehicle", "s", "faults", "tags", "about", right={"s"})
    for one in scenarios:
        faults = "\n".join(f"{fault.words} at {fault.at_s:g}" for fault in one.faults)
        _row(table, one.name, one.vehicle, f"{one.duration_s:g}", faults, " ".join(one.tags), _first(one.about))
    return table


def failure_table() -> Table:
    """All rows of the table of failures, by subject."""
    table = _table("subject", "failure", "what happens", "quantities")
    for target in Target:
        rows = [row for row in TABLE if row.target is target]
        for place, row in enumerate(rows):
            _row(table, subject_words(target) if place == 0 else "", row.failure, row.text, _quantities(row))
        table.add_section()
    return table


def profile_table(profiles: Iterable[tuple[str, Profile]]) -> Table:
    """One row each."""
    table = _table("vehicle", "name", "thrusters", "autopilot", "bus", "about", right={"thrusters"})
    for key, one in profiles:
        _row(table, key, one.name, str(len(one.thrusters)), one.autopilot, one.bus.protocol, _first(one.about))
    return table


def subject_words(target: Target) -> str:
    """How scenario files name a target."""
    return _NUMBERED.get(target) or next(name for name, known in SINGLE.items() if known is target)


def _quantities(row: FailureKind) -> str:
    lines = [_quantity(quantity) for quantity in row.quantities]
    return "\n".join(lines + ([f"axis: {', '.join(row.axes)}; left out: all"] if row.axes else []))


def _quantity(quantity: Quantity) -> str:
    bounds = f"; {quantity.wanted}" if quantity.wanted else ""
    default = "" if quantity.default is None else f"; {quantity.default:.10g} if left out"
    return f"{quantity.name}: {quantity.text}{bounds}{default}"


def _first(about: str) -> str:
    """The first sentence."""
    sentence = " ".join(about.split()).partition(". ")[0].rstrip(".")
    return sentence if len(sentence) <= ABOUT_LENGTH else f"{sentence[: ABOUT_LENGTH - 3]}..."


def _table(*columns: str, right: Iterable[str] = ()) -> Table:
    table = Table(box=None, pad_edge=False, header_style="bold")
    for column in columns:
        table.add_column(column, justify="right" if column in right else "left", overflow="fold")
    return table


def _row(table: Table, *cells: str) -> None:
    table.add_row(*map(Text, cells))
