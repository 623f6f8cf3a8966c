"""`gateway bench bridge`: how long a frame takes from bus to bus, and what is lost, beside python-can's bridge."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import click
import psutil
from rich.console import Console
from rich.table import Table

from hil_tests.bench.figures import console_beside, shared_options, write
from hil_tests.live.bridge_buses import bridged_buses
from hil_tests.live.bridging import Bridge, running
from hil_tests.live.crossing import Way, crossed
from hil_tests.live.latency import Latency
from hil_tests.live.traffic import FULL_BUS_HZ

SECONDS, FEW_SECONDS = 20.0, 5.0
NOTE = (
    f"each way {FULL_BUS_HZ:.0f} frames/s, as many as a bus at 1 Mbit/s carries in all, or what the machine has left "
    "for who plays; no fault is active; time: from before a frame is sent to its arrival at the other bus, as the "
    "kernel stamps it; the bridge is a process of its own; python-can: what its program can_bridge is made of"
)


@dataclass(frozen=True, slots=True)
class Figures:
    """Of one bridge. `rate_hz`: of the frames, each way, as it came about; `cpu_share`: of one processor."""

    bridge: str
    medium: str
    there: Way
    back: Way
    rate_hz: float
    cpu_share: float


def measured(bridge: Bridge, seconds: float, rate_hz: float = FULL_BUS_HZ) -> Figures:
    """Both ways at once, through a bridge in a process of its own."""
    medium, buses = bridged_buses()
    with running(bridge, buses) as pid:
        process = psutil.Process(pid)
        before = process.cpu_times()
        there, back, taken_s = crossed(buses, rate_hz, seconds)
        after = process.cpu_times()
    used_s = after.user + after.system - before.user - before.system
    return Figures(bridge.value, medium, there, back, there.sent / taken_s, used_s / taken_s)


def measure(seconds: float, console: Console) -> list[Figures]:
    """Measures, and prints the table."""
    figures = [measured(bridge, seconds) for bridge in Bridge]
    console.print(bridge_table(figures), f"[dim]over {figures[0].medium}; {NOTE}[/dim]")
    return figures


@click.command(short_help="A bridge between two buses: its delay, its losses.")
@click.option(
    "--seconds", type=click.FloatRange(min=0.1), default=SECONDS, show_default=True, help="Of each of two runs."
)  # fmt: skip
@shared_options
def bridge(*, seconds: float, jobs: int, json_file: str | None) -> None:
    """Measure the bridge between two buses that are full, both ways at once, beside that of python-can.

    On vcan0 and vcan1 where they are, else over UDP sockets in their place. Always one run after the other.
    """
    write({"bridge": measure(seconds, console_beside(json_file))}, json_file)


def bridge_table(figures: Sequence[Figures]) -> Table:
    """One column for each bridge, and how many times as long the others take as the first."""
    table = Table(title="Frames from bus to bus")
    table.add_column("")
    for one in figures:
        table.add_column(one.bridge, justify="right")
    ours = figures[0]
    rows = {
        "frames each way": [str(one.there.sent) for one in figures],
        "in a second": [f"{one.rate_hz:.0f}" for one in figures],
        "of these lost, there / back": [f"{one.there.lost} / {one.back.lost}" for one in figures],
        "overtaken, there / back": [f"{one.there.overtaken} / {one.back.overtaken}" for one in figures],
        "there, ms: median / 99 % / longest": [_row(one.there.took) for one in figures],
        "back, ms: median / 99 % / longest": [_row(one.back.took) for one in figures],
        "median there, times ours": [_ratio(one.there.took, ours.there.took) for one in figures],
        "processor": [f"{one.cpu_share:.0%}" for one in figures],
    }
    for what, cells in rows.items():
        table.add_row(what, *cells)
    return table


def _row(one: Latency) -> str:
    return f"{one.median_ms:.2f} / {one.p99_ms:.2f} / {one.max_ms:.1f}"


def _ratio(one: Latency, ours: Latency) -> str:
    return f"{one.median_ms / ours.median_ms:.1f}"
