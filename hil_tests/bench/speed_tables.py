"""The speed detector's figures as tables for a terminal."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from math import isfinite

from rich import box
from rich.table import Table

from hil_tests.bench.speed_detection import Score

FOUND = ("healthy\nFAULT", "FAULT\n/ h", "loss:\nearly", "found", "med.\ns", "90 %\ns", "ideal\ns")
ERRORS = ("speed\nm/s", "speed\n%", "flow\nm/s", "flow\n%", "UNKN.\n%", "update\nus")


def found_table(groups: Mapping[str, Sequence[Score]]) -> Table:
    """False alarms, and losses found, of each estimator on each set of ways."""
    return _by_estimator("Speed watch: false alarms, losses found, time to find", FOUND, groups, _found)


def errors_table(groups: Mapping[str, Sequence[Score]]) -> Table:
    """Errors of speed and flow, and the time of an update, of each estimator on each set of ways."""
    return _by_estimator("Speed watch: RMS errors after 120 s, healthy (median of the ways)", ERRORS, groups, _errors)


def missions_table(estimator: str, scores: Sequence[Score]) -> Table:
    """One line for each kind of missions, of one estimator."""
    table = _table(f"Speed watch: missions by kind, {estimator}", ("missions",), FOUND)
    for score in scores:
        table.add_row(score.name, *_found(score))
    return table


def _by_estimator(
    title: str,
    headings: Sequence[str],
    groups: Mapping[str, Sequence[Score]],
    cells: Callable[[Score], list[str]],
) -> Table:
    table = _table(title, ("ways", "estimator"), headings)
    for group, scores in groups.items():
        for number, score in enumerate(scores):
            table.add_row(group if number == 0 else "", score.name, *cells(score), end_section=score is scores[-1])
    return table


def _table(title: str, names: Sequence[str], headings: Sequence[str]) -> Table:
    """Narrow enough for a terminal of 80 columns."""
    table = Table(title=title, box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0), show_edge=False)
    for name in names:
        table.add_column(name, no_wrap=True)
    for heading in headings:
        table.add_column(heading, justify="right", no_wrap=True)
    return table


def _found(score: Score) -> list[str]:
    healthy = f"{score.alarmed}/{score.healthy}" if score.healthy else "-"
    early = f"{score.early}/{score.lost}" if score.lost else "-"
    share = f"{100.0 * score.found / score.lost:.3g} %" if score.lost else "-"
    times = ["-" if value is None else f"{value:.1f}" for value in (score.median_s, score.late_s, score.ideal_s)]
    return [healthy, f"{score.alarms_per_hour:.3g}", early, share, *times]


def _errors(score: Score) -> list[str]:
    pairs = ((score.speed_error_mps, score.speed_error), (score.flow_error_mps, score.flow_error))
    off = [cell for error_mps, share in pairs for cell in (_figure(error_mps), _figure(100.0 * share))]
    return [*off, f"{100.0 * score.unknown:.0f}", f"{score.update_us:.0f}"]


def _figure(value: float) -> str:
    """Two digits; what has run away is not worth its digits."""
    if not isfinite(value):
        return "-"
    return f"{value:.2g}" if value < 99.5 else f"{value:.0f}" if value < 1000.0 else "> 999"
