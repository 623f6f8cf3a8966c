"""`gateway watch`: how a running gateway is, or a recorded dive was, on a terminal."""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

import click
from rich.console import Console

from gateway.commands.options import config_argument, offset_option
from gateway.config import Config, load
from gateway.problems import ConfigError
from gateway.replay.log_input import log_input
from gateway.replay.offsets import offsets_s
from gateway.watch.pace import FASTEST, SLOWEST, Pace

if TYPE_CHECKING:
    from gateway.watch.recorded_source import RecordedSource
    from gateway.watch.source import Source

EVERY_S = 0.5
# of a dive that is played as text: what changes is told to about a second of the dive
PLAIN_STEP_S = 1.0


@click.command(short_help="Show how a running gateway is, or a recorded dive.")
@config_argument
@click.argument("log", nargs=-1)
@click.option(
    "--speed",
    type=click.FloatRange(SLOWEST, FASTEST),
    default=1.0,
    show_default=True,
    help="Of LOG, times real time.",
)
@click.option(
    "--every",
    "every_s",
    type=click.FloatRange(0.1, 60.0),
    default=EVERY_S,
    show_default=True,
    metavar="SECONDS",
    help="From one look to the next: more for a slow link.",
)
@offset_option
@click.option("--plain", is_flag=True, help="A line of text for each change, as where there is no terminal.")
def watch(
    config: Path, log: tuple[str, ...], speed: float, every_s: float, offsets: tuple[str, ...], plain: bool
) -> None:
    """Show how the gateway is that runs with CONFIG on this machine: subjects worst first with their residuals and
    thresholds, links, and what the pilot was told. It is waited for where it does not run.

    With LOG..., a recorded dive: whatever `gateway replay` reads, judged again and played at --speed.

    Bars reach from the threshold to the left (-1) to that to the right (+1) and beyond.
    """
    try:
        settings = load(config)
        screen = not plain and _is_screen()
        if log and not screen:
            every_s = min(every_s, PLAIN_STEP_S / speed)
        with Console(stderr=True).status("reading"):  # of long logs: how far their clocks are apart is found first
            source = _played(settings, log, offsets, Pace(speed), every_s) if log else _live(settings)
    except (ConfigError, ValueError, OSError) as error:
        raise click.ClickException(_words(error)) from error
    try:
        _show(source, every_s) if screen else _print(source, every_s)
    except KeyboardInterrupt:  # the usual end of what goes on for ever
        return
    finally:
        source.close()


def _live(settings: Config) -> Source:
    from gateway.control.watching import Watching
    from gateway.watch.live_source import LiveSource

    return LiveSource(Watching(settings.files.control), time.time)


def _played(
    settings: Config, logs: tuple[str, ...], offsets: tuple[str, ...], pace: Pace, every_s: float
) -> RecordedSource:
    # with all detectors and log readers: no other command should wait for them
    from gateway.replay.reels import reels
    from gateway.watch.recorded_dive import RecordedDive
    from gateway.watch.recorded_source import RecordedSource

    inputs = [log_input(one, settings.links()) for one in logs]
    given_s = offsets_s(offsets, inputs)

    def dive() -> RecordedDive:
        return RecordedDive(settings, reels(inputs, settings, given_s))

    more = f" and {len(inputs) - 1} more" if len(inputs) > 1 else ""
    name = f"{inputs[0].path.name}{more}"
    return RecordedSource(name, dive, pace, every_s, time.monotonic)


def _is_screen() -> bool:
    """Keys come from the standard input, and the screen is drawn on standard error."""
    streams = (sys.stdin, sys.stdout, sys.stderr)
    return all(stream.isatty() for stream in streams) and os.environ.get("TERM", "dumb") not in ("", "dumb")


def _print(source: Source, every_s: float) -> None:
    from gateway.watch.plain import changes
    from gateway.watch.source import Rhythm

    rhythm = Rhythm(every_s, time.monotonic)
    for line in changes(source, lambda: time.sleep(rhythm.rest_s())):
        click.echo(line)


def _show(source: Source, every_s: float) -> None:
    from gateway.watch.app import PlayerApp, WatchApp
    from gateway.watch.recorded_source import RecordedSource

    app = PlayerApp(source, every_s) if isinstance(source, RecordedSource) else WatchApp(source, every_s)
    app.run()


def _words(error: Exception) -> str:
    if isinstance(error, OSError) and error.filename is not None:
        return f"{error.filename}: {error.strerror}"
    return str(error)
