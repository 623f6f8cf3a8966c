"""The figures as tables for a terminal."""

from __future__ import annotations

from collections.abc import Sequence

from rich.table import Table

from hil_tests.bench.thruster_detection import Score
from hil_tests.bench.timing import Timing
from hil_tests.random_runs import Style

HEADINGS = (
    "healthy,\nalarm",
    "7 %, too\nearly",
    "7 % in\n20",
    "median\nsamples",
    "3 % in\n100",
    "seconds\na run",
)


def detection_table(scores: Sequence[Score], style: Style) -> Table:
    """One line for each contender."""
    runs = scores[0].runs
    table = Table(
        title=f"Thruster detection, in numbers of {style} random runs: {runs} healthy, {runs} with each loss"
    )
    table.add_column("detector", no_wrap=True)
    for heading in HEADINGS:
        table.add_column(heading, justify="right")
    for score in scores:
        table.add_row(*_cells(score))
    return table


def _cells(score: Score) -> list[str]:
    counts = (score.healthy_alarms, score.early_7, score.found_7)
    median = "-" if score.median_delay_7 is None else f"{score.median_delay_7:.0f}"
    seconds = f"{score.seconds_per_run:.2f}"
    return [score.contender, *map(str, counts), median, str(score.found_3), seconds]


def timing_table(timings: Sequence[Timing]) -> Table:
    """One line for each comparison; a ratio above 1 means that ours takes less time."""
    table = Table(title="Times beside the peers, in turns in this run")
    table.add_column("work")
    table.add_column("peer")
    for heading in ("ours, us", "peer, us", "peer\n/ ours"):
        table.add_column(heading, justify="right")
    for timing in timings:
        figures = (f"{timing.ours_us:.1f}", f"{timing.peer_us:.1f}", f"{timing.ratio:.2f}")
        table.add_row(f"{timing.work}, a {timing.unit}", timing.peer, *figures)
    return table
