"""`gateway bench live`: what the running gateway costs, what it loses, and how soon a fault on the bus is told."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import click
from rich.console import Console
from rich.table import Table

from hil_tests.bench.figures import console_beside, shared_options, write
from hil_tests.live.buses import buses
from hil_tests.live.latency import Latency, latency, told
from hil_tests.live.measure import Run, live_run
from hil_tests.live.traffic import FAULT_EVERY_S, FULL_BUS_HZ, LEARN_S, Load, Plan

SECONDS, FEW_SECONDS = 60.0, 20.0
NOTE = (
    "eight thrusters, four on each of two buses, speed and navigation watched, MAVLink at 100 messages/s; full: "
    f"{FULL_BUS_HZ:.0f} frames/s on each; wanted: frames that pass the kernel's filters; processor: share of one, "
    "while faults came and went; told: faults (a third of the speed is gone) that the autopilot got as STATUSTEXT; "
    "shown: from the first frame that shows the fault; decided: from the sample that the detector decided on"
)


@dataclass(frozen=True, slots=True)
class Figures:
    """Of one live run; `lost` counts frames that were wanted and not received."""

    load: str
    medium: str
    sent_hz: float
    wanted: int
    lost: int
    cpu_share: float
    memory_mib: float
    behind_s: float
    late_s: float
    faults: int
    told: int
    from_shown: Latency
    from_decided: Latency


def measure(seconds: float, console: Console) -> list[Figures]:
    """Measures, and prints the table."""
    where = buses()
    figures = [_figures(plan, live_run(plan, where), where.medium) for plan in (Plan(load, seconds) for load in Load)]
    console.print(live_table(figures), f"[dim]over {where.medium}; {NOTE}[/dim]")
    return figures


@click.command(short_help="The running gateway: its cost, its losses, its latency.")
@click.option(
    "--seconds", type=click.FloatRange(min=FAULT_EVERY_S), default=SECONDS, show_default=True,
    help=f"Of each of three runs, after {LEARN_S:g} s in which it learns; a fault each {FAULT_EVERY_S:g} s.",
)  # fmt: skip
@shared_options
def live(*, seconds: float, jobs: int, json_file: str | None) -> None:
    """Measure a gateway that runs as its own process, while others play the frames of two buses at their own pace.

    On vcan0 and vcan1 where they are, else over UDP sockets in their place. Always one run after the other.
    """
    write({"live": measure(seconds, console_beside(json_file))}, json_file)


def _figures(plan: Plan, run: Run, medium: str) -> Figures:
    reached = told(run)
    return Figures(
        load=plan.load.value,
        medium=medium,
        sent_hz=run.sent / plan.end_s,
        wanted=run.wanted,
        lost=run.wanted - run.received,
        cpu_share=run.cpu_share,
        memory_mib=run.memory_mib,
        behind_s=run.behind_s,
        late_s=run.late_s,
        faults=len(run.onsets),
        told=len(reached),
        from_shown=latency([one.told_s - one.shown_s for one in reached]),
        from_decided=latency([one.told_s - one.decided_s for one in reached]),
    )


def live_table(figures: Sequence[Figures]) -> Table:
    """One column for each load."""
    table = Table(title="The running gateway")
    table.add_column("")
    for one in figures:
        table.add_column(one.load, justify="right")
    rows = {
        "frames/s on both buses": [f"{one.sent_hz:.0f}" for one in figures],
        "frames wanted": [str(one.wanted) for one in figures],
        "of these lost": [str(one.lost) for one in figures],
        "processor": [f"{one.cpu_share:.1%}" for one in figures],
        "memory, most, MiB": [f"{one.memory_mib:.0f}" for one in figures],
        "faults told": [f"{one.told} of {one.faults}" for one in figures],
        "shown to told, ms: median / 99 % / longest": [_row(one.from_shown) for one in figures],
        "decided to told, ms: median / 99 % / longest": [_row(one.from_decided) for one in figures],
        "frames played late by, most, ms": [f"{1000.0 * one.late_s:.0f}" for one in figures],
    }
    for what, cells in rows.items():
        table.add_row(what, *cells)
    return table


def _row(one: Latency) -> str:
    return f"{one.median_ms:.0f} / {one.p99_ms:.0f} / {one.max_ms:.0f}"
