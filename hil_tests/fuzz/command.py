"""The command that fuzzes: which targets, for how long, and how what was found comes again."""

from __future__ import annotations

import shlex
import traceback
from pathlib import Path

import click

from hil_tests.fuzz.catalogue import TARGETS
from hil_tests.fuzz.session import Session, is_guided, reproduce
from hil_tests.fuzz.target import Target

NO_ATHERIS = (
    "atheris is not installed (it has wheels for Linux on x86-64 and Python 3.11 to 3.13: pip install "
    "'thruster-gateway[fuzz]'): by chance then, without looking at the code that is reached"
)


@click.command(short_help="Give every parser bytes that nobody would send.")
@click.option("--list", "listed", is_flag=True, help="Say what there is.")
@click.option(
    "--target", "names", type=click.Choice(sorted(TARGETS)), multiple=True, help="Only this one; again for more."
)
@click.option("--seconds", type=click.FloatRange(1.0), default=30.0, show_default=True, help="For each.")
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path("out/fuzz"),
    show_default=True,
    help="Folder for inputs that reached something new, and for those that failed.",
)
@click.option(
    "--input", "path", type=click.Path(path_type=Path, dir_okay=False), help="Only this file, to one --target."
)
def fuzz(*, listed: bool, names: tuple[str, ...], seconds: float, out: Path, path: Path | None) -> None:
    """Give every parser of the gateway bytes that nobody would send, one target after the other.

    Exit code 0: all stood them; 1: one did not, and the input that shows it is kept.
    """
    targets = [TARGETS[name] for name in names] or list(TARGETS.values())
    if listed:
        for target in targets:
            click.echo(f"{target.name:20} {target.about}")
        return
    failed = _one_input(targets, path) if path is not None else _all(targets, seconds, out)
    raise click.exceptions.Exit(1 if failed else 0)


def _one_input(targets: list[Target], path: Path) -> bool:
    if len(targets) != 1:
        raise click.UsageError("--input wants the one --target that it is for")
    try:
        error = reproduce(targets[0], path)
    except OSError as unread:
        raise click.ClickException(str(unread)) from unread
    if error is None:
        click.echo(f"{targets[0].name} stands {path}")
        return False
    traceback.print_exception(error)
    return True


def _all(targets: list[Target], seconds: float, out: Path) -> bool:
    if not is_guided():
        click.echo(NO_ATHERIS, err=True)
    failed = False
    for target in targets:
        click.echo(f"{target.name}: {target.about}, {seconds:.0f} s")
        session = Session(target, seconds, out / target.name)
        try:
            found = session.guided() if is_guided() else session.unguided()
        except RuntimeError as error:
            raise click.ClickException(str(error)) from error
        for path in found:
            failed = True
            click.echo(f"{target.name} failed; once more: {_command(target, path)}", err=True)
    return failed


def _command(target: Target, path: Path) -> str:
    return f"python -m hil_tests.fuzz --target {target.name} --input {shlex.quote(str(path))}"
