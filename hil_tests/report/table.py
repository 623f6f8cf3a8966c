"""What a run came to, for a terminal: a line while it runs, a table at its end."""

from __future__ import annotations

from collections.abc import Sequence

from rich.table import Table
from rich.text import Text

from gateway.plotting.clock import lasting
from hil_tests.report.account import name_of
from hil_tests.report.check import Check
from hil_tests.report.expectations import checks, found_after_s
from hil_tests.report.outcome import Outcome

GOOD, BAD = "green", "bold red"


def line_of(outcome: Outcome) -> Text:
    """One line of a play: whether it passed, what was missed first, how fast it was."""
    missed = _missed(outcome)
    line = _result(not missed)
    line.append(f"  {name_of(outcome)}", style="bold" if missed else "")
    found_s = found_after_s(outcome)
    if found_s is not None:
        line.append(f", found after {lasting(found_s)}")
    if missed:
        more = f", and {len(missed) - 1} more" if len(missed) > 1 else ""
        line.append(f": {missed[0].expected}: {missed[0].seen}{more}")
    line.append(f"  ({lasting(outcome.end_s - outcome.start_s)} in {lasting(outcome.wall_s)})", style="dim")
    return line


def table_of(outcomes: Sequence[Outcome]) -> Table:
    """All plays, those that failed last, where one looks first; how many passed stands below them."""
    passed = sum(not _missed(outcome) for outcome in outcomes)
    table = Table(
        caption=Text(summary(passed, len(outcomes)), style=GOOD if passed == len(outcomes) else BAD),
        caption_justify="left",
    )
    table.add_column("result", no_wrap=True)
    table.add_column("scenario", overflow="fold")
    table.add_column("found after", justify="right", no_wrap=True)
    table.add_column("missed", overflow="fold")
    for outcome in sorted(outcomes, key=lambda one: bool(_missed(one))):
        missed, found_s = _missed(outcome), found_after_s(outcome)
        table.add_row(
            _result(not missed),
            Text(name_of(outcome)),
            "" if found_s is None else lasting(found_s),
            Text("\n".join(f"{one.expected}: {one.seen}" for one in missed)),
        )
    return table


def summary(passed: int, played: int) -> str:
    """In one line: "31 of 32 scenarios passed"."""
    return f"{passed} of {played} {'scenario' if played == 1 else 'scenarios'} passed"


def _missed(outcome: Outcome) -> list[Check]:
    return [one for one in checks(outcome) if not one.passed]


def _result(passed: bool) -> Text:
    return Text("passed", style=GOOD) if passed else Text("FAILED", style=BAD)
