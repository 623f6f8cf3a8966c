"""The command `gateway bench`: ours against the peers, side by side, in one run."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click
from click.core import ParameterSource
from rich.console import Console

from hil_tests.bench import bridge, commissioning, live, navigation, recording, replay, speed, supervisor, thruster
from hil_tests.bench.figures import console_beside, shared_options, write
from hil_tests.bench.navigation_measure import Options as NavigationOptions
from hil_tests.bench.works import time_works, timing

# Each part with its default options, in the order in which they are run.
PARTS: dict[str, Callable[[int, Console], Any]] = {
    "thruster": lambda jobs, console: thruster.measure(thruster.Options(), jobs, console),
    "speed": lambda jobs, console: speed.measure(speed.Options(), jobs, console),
    "navigation": lambda jobs, console: navigation.measure(NavigationOptions(), jobs, console),
    "commissioning": lambda jobs, console: commissioning.measure(commissioning.Options(), jobs, console),
    "supervisor": lambda _, console: supervisor.measure(supervisor.CHANGES, console),
    "live": lambda _, console: live.measure(live.FEW_SECONDS, console),
    "bridge": lambda _, console: bridge.measure(bridge.FEW_SECONDS, console),
    "recording": lambda _, console: recording.measure(recording.FEW_SECONDS, console),
    "replay": lambda jobs, console: replay.measure(replay.FEW_MINUTES, jobs, console),
    "timing": lambda _, console: time_works(console),
}


@click.group(invoke_without_command=True, short_help="Compare ours with peers and papers.")
@shared_options
@click.pass_context
def bench(context: click.Context, *, jobs: int, json_file: str | None) -> None:
    """Compare our detectors with their peers and with their papers' figures, and our code's time with that of others.

    Without a part: all of them, with few runs each. The thruster detector's peers, river and PyOD, come with: pip
    install 'thruster-gateway[bench]'
    """
    if context.invoked_subcommand is None:
        console = console_beside(json_file)
        write({name: measure(jobs, console) for name, measure in PARTS.items()}, json_file)
    elif any(context.get_parameter_source(name) is ParameterSource.COMMANDLINE for name in ("jobs", "json_file")):
        raise click.UsageError(
            f"--jobs and --json belong behind the part: gateway bench {context.invoked_subcommand} ..."
        )


for part in (
    thruster.thruster,
    speed.speed,
    navigation.navigation,
    commissioning.commissioning,
    supervisor.supervisor,
    live.live,
    bridge.bridge,
    recording.recording,
    replay.replay,
    timing,
):
    bench.add_command(part)
