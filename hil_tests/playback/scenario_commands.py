"""`gateway hil new`, `check`, `list`, `schema`: scenario files, before they are played."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import click
from rich.console import Console
from rich.table import Table

from gateway.problems import ConfigError
from hil_tests.playback.fitting import check_recording, gateway_config, load_fitting
from hil_tests.playback.listing import failure_table, profile_table, scenario_table
from hil_tests.profiles import load_profile, profile_names
from hil_tests.profiles.loading import FOLDER
from hil_tests.scenario.document import Scenario
from hil_tests.scenario.loading import SUFFIXES
from hil_tests.scenario.schema import schema_text
from hil_tests.scenario.shelf import scenario_files
from hil_tests.scenario.template import new_scenario

WRONG = 2
PLAIN_WIDTH = 200  # of a table that goes into a file or a pipe


class WrongError(click.ClickException):
    """Something is wrong with what the user has written."""

    exit_code = WRONG


@click.command(short_help="Write a scenario to begin with.")
@click.argument("file", type=click.Path(path_type=Path, dir_okay=False))
@click.option(
    "--vehicle", default="bluerov2_heavy", show_default=True, help="Name of a profile, or path of your own."
)
@click.option(
    "--fault",
    "faults",
    multiple=True,
    metavar="TEXT",
    help='Such as "thruster 3 entangled", or "thruster 3 rpm scale factor=0.9 at_s=20"; more than once: several.',
)
def new(file: Path, vehicle: str, faults: tuple[str, ...]) -> None:
    """Write a commented scenario that can be played as it is. A file that is there is never overwritten.

    Exit code 0: written; 2: not.
    """
    path = file if file.suffix in SUFFIXES else file.with_name(f"{file.name}.yaml")
    try:
        text = new_scenario(vehicle, faults)
        with path.open("x", encoding="utf-8") as out:
            out.write(text)
        check_one(path)
    except FileExistsError as error:
        raise WrongError(f"{path} is there already: give another name") from error
    except ConfigError as error:
        path.unlink()
        raise WrongError(str(error)) from error
    except ValueError as error:
        raise WrongError(str(error)) from error
    except OSError as error:
        raise WrongError(f"{path} cannot be written: {error.strerror}; want a folder that is there") from error
    click.echo(f"{path} is written. Play it:  gateway hil play {path}")


@click.command(short_help="Say what is wrong with scenario files.")
@click.argument("path", nargs=-1)
def check(path: tuple[str, ...]) -> None:
    """Say what is wrong with scenario files, their vehicles, and the gateway's configuration for them.

    PATH is a file, a folder, or the name of a scenario that ships; left out: all that ship.

    Exit code 0: all is well; 2: something is not.
    """
    files = _files(path)
    problems = list(problems_in(files))
    for problem in problems:
        click.echo(problem, err=True)
    count = f"{len(files)} scenario{'s' if len(files) != 1 else ''}"
    if problems:
        raise WrongError(f"{count}, not all of them well" if len(files) > 1 else f"{files[0]} is not well")
    click.echo(f"{count}, all well" if len(files) > 1 else f"{files[0]}: all well")


@click.command("list", short_help="Show scenarios, failures or vehicles.")
@click.argument("path", nargs=-1)
@click.option("--failures", is_flag=True, help="What can go wrong, by subject, with quantities and units.")
@click.option("--profiles", is_flag=True, help="The vehicles that ship.")
def list_command(path: tuple[str, ...], failures: bool, profiles: bool) -> None:
    """Show scenarios: those of PATH, files or folders; left out: those that ship."""
    if failures:
        _show(failure_table())
    elif profiles:
        _show(profile_table([(name, load_profile(name)) for name in profile_names()]))
        click.echo(f"For your own, copy one of {FOLDER}/*.yaml, and name its path behind vehicle: in the scenario")
    else:
        _show(scenario_table(_each(_files(path))))


@click.command(short_help="Print the JSON Schema of scenario files, for editors.")
def schema() -> None:
    """Print the JSON Schema of scenario files, for editors.

    `gateway hil new` writes where it is into the first line of a file, in the way that editors with the YAML language
    server understand.
    """
    click.echo(schema_text(), nl=False)


def check_one(path: Path) -> Scenario:
    """A scenario with all that belongs to it: its vehicle, its gateway's configuration, the logs of its recording.

    Raises:
        ConfigError: one of them has problems.
    """
    scenario, profile = load_fitting(path)
    check_recording(scenario, path, gateway_config(scenario, path, profile))
    return scenario


def problems_in(files: Sequence[Path]) -> Iterator[str]:
    """What is wrong with each file, and with several of one name in one folder."""
    names: dict[tuple[Path, str], Path] = {}
    for path in files:
        try:
            name = check_one(path).name
        except ConfigError as error:
            yield str(error)
            continue
        first = names.setdefault((path.parent, name), path)
        if first is not path:
            yield f"{path}: name = {name}: also that of {first}, want another"


def _files(named: Sequence[str]) -> list[Path]:
    try:
        return scenario_files(named)
    except ValueError as error:
        raise WrongError(str(error)) from error


def _each(files: Iterable[Path]) -> Iterator[Scenario]:
    for path in files:
        try:
            yield load_fitting(path)[0]
        except ConfigError as error:
            raise WrongError(str(error)) from error


def _show(table: Table) -> None:
    console = Console()
    if not console.is_terminal:
        console = Console(width=PLAIN_WIDTH)
    console.print(table)
