"""The `gateway` command. Whatever goes wrong is said in one line with the way out; a traceback is a bug."""

from __future__ import annotations

import asyncio
import gc
import logging
from importlib.metadata import EntryPoint, entry_points, version
from pathlib import Path

import click

from drivers.readings import OperatorAct
from gateway.commands.commission import commission
from gateway.commands.export import export
from gateway.commands.options import config_argument
from gateway.commands.replay import replay
from gateway.commands.watch import watch
from gateway.config import Config, load
from gateway.control.protocol import ACTS, STATUS, Request
from gateway.control.subject_words import subjects_named, wanted, watched_subjects
from gateway.logs import start_logging
from gateway.operator import MUTE_MAX_S
from gateway.problems import ConfigError
from gateway.training.command import train

DISTRIBUTION = "thruster-gateway"
PLUGINS = "gateway.commands"


class PluginGroup(click.Group):
    """Commands of this module, and those that installed packages add under the entry points `gateway.commands`."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Names of all commands."""
        return sorted({*super().list_commands(ctx), *(point.name for point in entry_points(group=PLUGINS))})

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """The command of that name; one that cannot be loaded says why when it is called."""
        own = super().get_command(ctx, cmd_name)
        if own is not None:
            return own
        point = next(iter(entry_points(group=PLUGINS, name=cmd_name)), None)
        return None if point is None else load_plugin(point)


def load_plugin(point: EntryPoint) -> click.Command:
    """The command of an entry point, or one in its place that fails with the reason."""
    try:
        command = point.load()
    except Exception as error:  # a plugin may fail in any way while it is imported
        return _broken(point, f"{type(error).__name__}: {error}")
    if not isinstance(command, click.Command):
        return _broken(point, f"it is a {type(command).__name__}: want a click command")
    return command


def _broken(point: EntryPoint, reason: str) -> click.Command:
    def fail() -> None:
        package = point.dist.name if point.dist is not None else point.value
        raise click.ClickException(f"{point.name} cannot be loaded from {point.value}: {reason}; reinstall {package}")

    return click.Command(
        point.name,
        callback=lambda **_: fail(),
        help=f"(cannot be loaded: {reason})",
        add_help_option=False,
        context_settings={"ignore_unknown_options": True},
        params=[click.Argument(["rest"], nargs=-1)],
    )


@click.group(cls=PluginGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(version(DISTRIBUTION), prog_name="gateway")
def main() -> None:
    """Tells pilot and autopilot that a thruster is entangled, the vehicle too slow, or a navigation sensor wrong.

    CAN and MAVLink in, STATUSTEXT and failsafe out.
    """


main.add_command(train)
main.add_command(commission)
main.add_command(export)
main.add_command(replay)
main.add_command(watch)


def loaded(path: Path) -> Config:
    """The configuration of a command.

    Raises:
        click.ClickException: with all its problems.
    """
    try:
        return load(path)
    except ConfigError as error:
        raise click.ClickException(str(error)) from error


@main.command(short_help="Watch the vehicle of CONFIG.")
@config_argument
@click.option("-v", "--verbose", is_flag=True, help="Log every detail.")
def run(config: Path, verbose: bool) -> None:
    """Watch the vehicle of CONFIG until SIGINT or SIGTERM.

    It stops within two seconds, whatever hangs. SIGUSR1 is the operator's word that all is well as it is: what is
    learnt now is the new reference.
    """
    start_logging(verbose)
    try:
        asyncio.run(_run(loaded(config)))
    except ConfigError as error:  # what only shows when it starts: the signing key
        raise click.ClickException(str(error)) from error
    except OSError as error:
        raise click.ClickException(f"{error}; look at [files] in {config}") from error
    finally:
        gc.freeze()  # at its exit, Python would go through all that was imported once more: half a second


async def _run(config: Config) -> None:
    from gateway.process_signals import heard_signals
    from gateway.run import run as run_gateway
    from gateway.systemd import Service

    stop, accept = asyncio.Event(), asyncio.Event()
    soon = asyncio.get_running_loop().call_soon_threadsafe
    with heard_signals(lambda: soon(stop.set), lambda: soon(accept.set)):
        await run_gateway(config, stop=stop, accept=accept, service=Service())


@main.command(short_help="Speak with the gateway that runs with CONFIG.")
@config_argument
@click.argument("what", type=click.Choice([STATUS, *sorted(ACTS)]))
@click.argument("subject", nargs=-1)
@click.option("--minutes", type=click.FloatRange(0, MUTE_MAX_S / 60.0, min_open=True), help="How long to mute.")
def tell(config: Path, what: str, subject: tuple[str, ...], minutes: float | None) -> None:
    """Speak with the gateway that runs with CONFIG on this machine.

    \b
    status        levels of all subjects, and the newest texts
    acknowledge   SUBJECT was seen: it is not said again, and nothing is asked of the autopilot because of it
    accept        SUBJECT is well as it is: what is learnt now is its new reference
    mute          no texts of SUBJECT for ten minutes, or for --minutes; of all: what nags now

    SUBJECT is one of those that are watched, such as T3, speed, dvl, depth sensor, or all; or several of them.

    Exit code 0: done; 1: not.
    """
    from gateway.control.tell import NoAnswerError, ask, lines

    settings = loaded(config)
    try:
        answer = ask(settings.files.control, _request(settings, what, subject, minutes))
    except (NoAnswerError, ValueError) as error:
        raise click.ClickException(str(error)) from error
    for line in lines(answer):
        click.echo(line, err=not answer.ok)
    if not answer.ok:
        raise click.exceptions.Exit(1)


def _request(settings: Config, what: str, subject: tuple[str, ...], minutes: float | None) -> Request:
    """What is to be asked.

    Raises:
        ValueError: what does not go together, or a subject that is not watched.
    """
    watched = watched_subjects(settings)
    if minutes is not None and ACTS.get(what) is not OperatorAct.MUTE:
        raise ValueError(f"--minutes goes with mute, not with {what}")
    if what in ACTS and not subject:
        raise ValueError(f"{what} what? Want {wanted(watched)}")
    return Request(what, tuple(subjects_named(subject, watched)), 60.0 * (minutes or 0.0))


@main.command(short_help="Say what is wrong with CONFIG and this machine.")
@config_argument
def check(config: Path) -> None:
    """Say what is wrong with CONFIG and with the machine it is to run on, and how to mend it.

    Exit code 0: all is well; 1: something is not.
    """
    settings = loaded(config)
    click.echo(f"ok       {config}: {settings.watched()} over {', '.join(settings.links())}")
    if not _all_ok(settings):
        raise click.exceptions.Exit(1)


def _all_ok(settings: Config) -> bool:
    from gateway.checking.machine import checks

    logging.disable(logging.CRITICAL)  # what libraries log while they fail is in the results
    try:
        results = []
        for result in checks(settings):
            click.echo(result.line())
            results.append(result.ok)
        return all(results)
    finally:
        logging.disable(logging.NOTSET)
