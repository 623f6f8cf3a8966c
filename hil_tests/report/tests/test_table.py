"""Lines and tables for a terminal."""

from __future__ import annotations

from io import StringIO

from rich.console import Console

from hil_tests.report.outcome import Outcome
from hil_tests.report.table import line_of, table_of
from hil_tests.report.tests.plays import finding, play

WANTED = {"finding": {"subject": "thruster 3", "level": "FAULT"}, "within_s": 2.0}


def found() -> Outcome:
    return play(expect=(WANTED,), findings=[finding(25.31)])


def missed() -> Outcome:
    return play(expect=(WANTED, {"mode": "ALT_HOLD"}))


def shown(outcomes: list[Outcome], width: int = 120) -> str:
    console = Console(file=StringIO(), width=width)
    console.print(table_of(outcomes))
    return console.file.getvalue()  # type: ignore[attr-defined]


def test_a_line_says_what_was_found_when_and_how_fast() -> None:
    assert line_of(found()).plain == "passed  weeds on a horizontal thruster, found after 0.31 s  (60 s in 1.5 s)"


def test_a_line_says_what_was_missed_first() -> None:
    assert line_of(missed()).plain == (
        "FAILED  weeds on a horizontal thruster: FAULT of thruster 3 within 2 s of 0:25: "
        "never: nothing of thruster 3 was found, and 1 more  (60 s in 1.5 s)"
    )


def test_what_failed_is_at_the_end_with_all_that_was_missed() -> None:
    table = shown([missed(), found()])
    assert table.index("passed") < table.index("FAILED") < table.index("1 of 2 scenarios passed")
    assert "0.31 s" in table
    assert "mode ALT_HOLD at the end" in table


def test_words_are_not_taken_for_markup() -> None:
    outcome = play(expect=({"statustext": "[bold]T3"},), path=found().path)
    assert "[bold]T3" in line_of(outcome).plain
    assert "[bold]T3" in shown([outcome])


def test_a_narrow_terminal_loses_nothing() -> None:
    cells = [line.split("│")[4] for line in shown([missed()], width=70).splitlines() if line.count("│") == 5]
    assert "nothing of thruster 3 was found" in " ".join(" ".join(cells).split())
