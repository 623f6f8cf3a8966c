"""`gateway bench supervisor`: from a verdict to bytes on the socket, and what the supervisor itself costs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import click
from rich.console import Console
from rich.table import Table

from hil_tests.bench.figures import console_beside, shared_options, write
from hil_tests.bench.supervisor_latency import Latency, latencies
from hil_tests.bench.tables import timing_table
from hil_tests.bench.timed_detector import CHANGE_S
from hil_tests.bench.timing import Timing
from hil_tests.bench.works import time_work
from hil_tests.processes import processes, results

CHANGES = 100
NOTE = (
    "the gateway judges in batches of a tenth of a second, which is in what is counted from the sample's time; from "
    "the verdict on it is the rest of the batch and the finding on disk; the bare loop has nothing else to do"
)


@dataclass(frozen=True, slots=True)
class Figures:
    """All that was measured."""

    latency: list[Latency]
    cost: Timing


def measure(changes: int, console: Console) -> Figures:
    """Measures, and prints the tables."""
    with processes(1) as pool:  # alone, and one after the other
        [latency] = results([pool.submit(latencies, changes)], "latency")
        [cost] = results([pool.submit(time_work, "supervision")], "timing")
    console.print(latency_table(latency), f"[dim]{NOTE}[/dim]")
    console.print(timing_table([cost]))
    return Figures(latency, cost)


@click.command(short_help="From a verdict to bytes on the socket.")
@click.option(
    "--changes", type=click.IntRange(min=1), default=CHANGES, show_default=True,
    help=f"Verdicts that change and are told, one each {CHANGE_S} s.",
)  # fmt: skip
@shared_options
def supervisor(*, changes: int, jobs: int, json_file: str | None) -> None:
    """Measure how long a verdict takes until the pilot's text is sent, beside a loop that only encodes and sends.

    Always in one process.
    """
    write({"supervisor": measure(changes, console_beside(json_file))}, json_file)


def latency_table(measured: Sequence[Latency]) -> Table:
    """One line for each way."""
    table = Table(title="From a verdict to its STATUSTEXT on a UDP socket, in milliseconds")
    table.add_column("way")
    for heading in ("texts", "median", "99 %", "longest"):
        table.add_column(heading, justify="right")
    for one in measured:
        figures = (f"{value:.2f}" for value in (one.median_ms, one.p99_ms, one.max_ms))
        table.add_row(one.what, str(one.texts), *figures)
    return table
