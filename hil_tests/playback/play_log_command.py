"""`gateway hil play-log`: recorded dives played again onto a bus and a link, with faults laid over them."""

from __future__ import annotations

import asyncio
import signal
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from rich.console import Console
from rich.progress import Progress as Bar
from rich.progress import SpinnerColumn, TextColumn

from gateway.commands.options import config_argument, offset_option

if TYPE_CHECKING:
    from gateway.config import Config
    from hil_tests.playback.log_session import LogSession, Progress
    from hil_tests.scenario.document import Scenario

PLAYED, UNPLAYED = 0, 2
MAX = "max"


def _speed(_ctx: click.Context, _parameter: click.Parameter, text: str) -> float:
    """Infinity for `max`."""
    try:
        speed = inf if text == MAX else float(text)
    except ValueError:
        speed = 0.0
    if not speed > 0.0:
        raise click.BadParameter(f"{text!r}: want how many times as fast as it was, 10, say, or {MAX}")
    return speed


@click.command("play-log", short_help="Play recorded dives onto a bus and a link, with faults laid over them.")
@config_argument
@click.argument("log", nargs=-1)
@click.option(
    "--can",
    "channels",
    multiple=True,
    metavar="[BUS=]CHANNEL",
    help="SocketCAN interface for a bus of CONFIG, by its name; left out: for its first one.",
)
@click.option("--mavlink", "endpoint", metavar="ENDPOINT", help="For the autopilot's link: udpout:127.0.0.1:14550.")
@click.option(
    "--fault",
    "faults",
    multiple=True,
    metavar="TEXT",
    help='As in a scenario, in one line: "thruster 3 rpm scale factor=0.9 at_s=20". May be given several times.',
)
@click.option(
    "--scenario",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Take the faults of this scenario; where no LOG is named, its recording as well.",
)
@click.option(
    "--loop", "again", is_flag=True, help="Begin anew at the end, without a jump in time, until interrupted."
)
@click.option("--from", "from_s", type=float, default=0.0, metavar="SECONDS", help="Since the beginning of the dive.")
@click.option("--to", "to_s", type=float, default=inf, metavar="SECONDS", help="Since the beginning of the dive.")
@click.option(
    "--speed",
    metavar="X|max",
    default="1",
    callback=_speed,
    help="So many times as fast as it was; max: as fast as it goes.",
)
@click.option("--step", is_flag=True, help="One instant for each key that is pressed, or line of input; q ends.")
@offset_option
@click.option("--seed", type=click.IntRange(min=0), default=0, help="Of all chance in the faults.")
@click.option(
    "--transmit", metavar="WHAT", help="What may be put onto a bus that is not virtual: 7E0,node:20-27; all."
)
@click.option("--no-autopilot", is_flag=True, help="Nobody else is the autopilot on a bus that is not virtual.")
def play_log(config: Path, log: tuple[str, ...], **options: Any) -> None:
    """Play recorded dives again, onto a bus and a link, as if the vehicle were there: with faults laid over them.

    LOG is any that `gateway replay CONFIG` reads; what an autopilot's own log (.BIN, .ulg) has is told in the
    messages in which it would have told it. Faults are those of the wires: of what is told, of buses and of the link.

    A bus that is not virtual (vcan) gets nothing without --transmit.

    Exit code 0: played; 2: could not be.
    """
    from drivers.can.port import CanPortError
    from gateway.problems import ConfigError
    from hil_tests.bridge.permission import RefusedError

    console = Console()
    try:
        session = _session(config, _Options(log=log, **options))
        lines = asyncio.run(_played(session, console))
    except (ConfigError, CanPortError, RefusedError, OSError, ValueError) as error:
        click.echo(f"Error: {_words(error)}", err=True)
        raise click.exceptions.Exit(UNPLAYED) from error
    for line in lines:
        console.print(line, highlight=False, markup=False, soft_wrap=True)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Options:
    """The command line."""

    log: tuple[str, ...]
    channels: tuple[str, ...] = ()
    endpoint: str | None = None
    faults: tuple[str, ...] = ()
    scenario: Path | None = None
    again: bool = False
    from_s: float = 0.0
    to_s: float = inf
    speed: float = 1.0
    step: bool = False
    offsets: tuple[str, ...] = field(default=())
    seed: int = 0
    transmit: str | None = None
    no_autopilot: bool = False


def _session(file: Path, options: _Options) -> LogSession:
    """What the command line asks for.

    Raises:
        ConfigError: a file has problems.
        ValueError: options that make no sense.
    """
    from gateway.config import load
    from hil_tests.bridge.permission import Granted
    from hil_tests.bridge.transmission import parse_transmission
    from hil_tests.playback.fault_words import parse_fault
    from hil_tests.playback.log_player import Pace
    from hil_tests.playback.log_session import LogSession
    from hil_tests.scenario.loading import load_scenario

    config = load(file)
    scenario = None if options.scenario is None else load_scenario(options.scenario)
    channels = _channels(options.channels, config)
    if not channels and options.endpoint is None:
        raise ValueError("say where it is to be played: --can vcan0, --mavlink udpout:127.0.0.1:14550, or both")
    faults = [fault for text in options.faults for fault in parse_fault(text)]
    transmit = None if options.transmit is None else parse_transmission(options.transmit)
    return LogSession(
        dive=_dive(options, config, scenario),
        config=config,
        faults=[*(scenario.faults if scenario is not None else ()), *faults],
        channels=channels,
        endpoint=options.endpoint,
        granted=Granted(transmit, no_autopilot=options.no_autopilot),
        pace=None if options.step else Pace(options.speed),
        seed=options.seed,
    )


def _dive(options: _Options, config: Config, scenario: Scenario | None) -> Any:
    from gateway.replay.log_input import log_input
    from gateway.replay.offsets import offsets_s
    from hil_tests.dive_logs.laps import Part
    from hil_tests.playback.recorded import DiveLogs

    recording = None if scenario is None or options.log else scenario.recording
    if recording is not None and options.scenario is not None:
        part = Part(recording.from_s, recording.to_s)
        return DiveLogs(recording.logs, options.scenario.parent, part, options.again)
    if not options.log:
        raise ValueError("name a LOG, or a --scenario that has a recording")
    inputs = [log_input(one, config.links()) for one in options.log]
    part = Part(options.from_s, options.to_s)
    return DiveLogs(options.log, Path(), part, options.again, offsets_s(options.offsets, inputs))


def _channels(texts: Sequence[str], config: Config) -> Mapping[str, str]:
    """Interfaces by the names of the buses."""
    buses = [bus.name for bus in config.can if not bus.forwarded]
    channels: dict[str, str] = {}
    for text in texts:
        name, equals, channel = text.rpartition("=")
        if not equals and buses:
            name = buses[0]
        if name not in buses:
            raise ValueError(
                f"--can {text}: want [BUS=]CHANNEL, of the buses of CONFIG: {', '.join(buses) or 'none'}"
            )
        channels[name] = channel
    return channels


async def _played(session: LogSession, console: Console) -> list[str]:
    from hil_tests.playback.log_session import play_logs
    from hil_tests.playback.step_keys import StepKeys, single_keys

    stopped = asyncio.Event()
    loop = asyncio.get_running_loop()
    loop.add_signal_handler(signal.SIGINT, stopped.set)
    loop.add_signal_handler(signal.SIGTERM, stopped.set)
    if session.pace is None:
        with single_keys(sys.stdin) as source:
            keys = StepKeys(source)
            loop.add_signal_handler(signal.SIGINT, keys.end)
            return await play_logs(session, lambda progress: _show_step(progress, console), stopped, keys)
    with Bar(SpinnerColumn(), TextColumn("{task.description}"), console=console, transient=True) as bar:
        task = bar.add_task("listening whether an autopilot is there")
        return await play_logs(session, lambda one: bar.update(task, description=_place(one)), stopped)


def _place(progress: Progress) -> str:
    minutes, seconds = divmod(int(progress.dive_s), 60)
    lap = f", lap {progress.laps}" if progress.laps > 1 else ""
    faults = "".join(f"; {count} {cause}" for cause, count in progress.faults.items())
    return f"{minutes}:{seconds:02} of the dive{lap}{faults}"


def _show_step(progress: Progress, console: Console) -> None:
    from drivers.mavlink.formats import name_of
    from drivers.mavlink.frames import frame_at

    frames = [f"{bus} {one.identifier:08X}#{one.data.hex().upper()}" for bus, one in progress.sent.frames]
    headers = [frame_at(packet, 0) for packet in progress.sent.packets]
    names = [name_of(header.message_id) for header in headers if header is not None]
    line = f"{progress.dive_s:10.3f}  {'  '.join([*frames, *names])}"
    console.print(line, highlight=False, markup=False, soft_wrap=True)


def _words(error: Exception) -> str:
    if isinstance(error, OSError) and error.filename is not None:
        return f"{error.filename}: {error.strerror}"
    return str(error)
