"""The command `gateway train`."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from datetime import UTC, datetime
from inspect import cleandoc
from pathlib import Path
from typing import Any

import click

from detectors.navigation.lstm import read_model
from gateway import navigation_data
from gateway.navigation_data import read_navigation_data
from gateway.training.settings import Hyperparameters, Search, TrainingSettings

SEARCHED = "--hidden, --learning-rate, --epochs"
EXTRA = 'training needs PyTorch: pip install ".[train]"'


@click.group(short_help="Train what is learnt beforehand.")
def train() -> None:
    """Train what a detector learns from recordings before it goes to sea."""


def _verbatim(docstring: str | None) -> str:
    """A docstring but for its first line, for click's help: that rewraps all but what it is told not to."""
    paragraphs = cleandoc(docstring or "").split("\n\n")[1:]
    return "\n\n".join(f"\b\n{one}" if one.startswith(" ") else one for one in paragraphs)


HELP = f"""Train the navigation watch's predictor of innovations on recordings of healthy dives.

Each DATA is one dive. The more dives, and the more like those to come, the better: what was never seen is not
foretold. Learning rate, hidden units and epochs are searched for by a particle swarm: training on four fifths of the
recordings, for the least error on the others. The model is then trained on all. With {SEARCHED}, all three, there is
no search.

Stopped by Ctrl-C, the same command goes on where it was.

{_verbatim(navigation_data.__doc__)}
"""


@train.command(help=HELP, short_help="Train the navigation watch's predictor.")
@click.argument("data", nargs=-1, required=True, type=click.Path(path_type=Path, exists=True, dir_okay=False))
@click.option("--out", type=click.Path(path_type=Path, dir_okay=False), required=True, help="Where the model goes.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of all that is drawn.")
@click.option("--particles", type=click.IntRange(min=2), default=Search().particles, show_default=True)
@click.option("--iterations", type=click.IntRange(min=1), default=Search().iterations, show_default=True)
@click.option(
    "--splits", type=click.IntRange(1, 5), default=5, show_default=True, help="To validate; the paper's: 1."
)
@click.option("--hidden", type=click.IntRange(min=1), help="Hidden units; the paper's: 128.")
@click.option("--learning-rate", type=click.FloatRange(min=0.0, min_open=True), help="The paper's: 0.01.")
@click.option("--epochs", type=click.IntRange(min=1), help="How often the data are gone through.")
@click.option("--resume/--anew", default=True, show_default=True, help="Go on where the same command was stopped.")
def navigation(
    data: tuple[Path, ...],
    out: Path,
    seed: int,
    particles: int,
    iterations: int,
    splits: int,
    hidden: int | None,
    learning_rate: float | None,
    epochs: int | None,
    resume: bool,
) -> None:
    """See `HELP`."""
    settings = TrainingSettings(
        hyperparameters=_hyperparameters(hidden, learning_rate, epochs),
        search=Search(particles=particles, iterations=iterations),
        seed=seed,
        splits=splits,
    )
    with _said():
        _train(data, out, settings, resume)


@train.command(short_help="Train models that each have not seen one dive.")
@click.argument("model", type=click.Path(path_type=Path, exists=True, dir_okay=False))
@click.argument("data", nargs=-1, required=True, type=click.Path(path_type=Path, exists=True, dir_okay=False))
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), required=True, help="Folder for the models.")
def leave_one_out(model: Path, data: tuple[Path, ...], out: Path) -> None:
    """Train models as MODEL was, each on all dives but one, and measure them on that one.

    That is what can be expected of MODEL in dives to come. The models go to the folder under the names of the dives
    that they have not seen; gateway bench navigation takes them from there.
    """
    with _said():
        _leave_one_out(model, data, out)


def _hyperparameters(hidden: int | None, learning_rate: float | None, epochs: int | None) -> Hyperparameters | None:
    if hidden is not None and learning_rate is not None and epochs is not None:
        return Hyperparameters(learning_rate=learning_rate, hidden=hidden, epochs=epochs)
    if hidden is None and learning_rate is None and epochs is None:
        return None
    raise click.UsageError(f"{SEARCHED}: want all three, or none to search for them")


@contextmanager
def _said() -> Iterator[None]:
    """What went wrong, in one line."""
    try:
        yield
    except ModuleNotFoundError as error:
        raise click.ClickException(EXTRA if error.name == "torch" else str(error)) from error
    except (OSError, ValueError) as error:
        raise click.ClickException(str(error)) from error


def _train(paths: Sequence[Path], out: Path, settings: TrainingSettings, resume: bool) -> None:
    from gateway.training.checkpoint import Checkpoint, CheckpointError, fingerprint
    from gateway.training.display import Display, print_summary
    from gateway.training.fit import Fitting
    from gateway.training.innovations import innovations

    dives = [read_navigation_data(path) for path in paths]
    if not out.parent.is_dir():
        raise click.ClickException(f"--out {out}: there is no folder {out.parent}")
    part = out.with_name(out.name + ".part")
    with Display() as display:
        records = [innovations(dive) for dive in display.track(dives, len(dives), "filter")]
        try:
            checkpoint = Checkpoint(part, fingerprint(records, settings), resume=resume)
            model = Fitting(records, settings, checkpoint, display.stage).run()
        except KeyboardInterrupt:
            raise click.ClickException(f"stopped; the same command goes on from {part}") from None
        except CheckpointError as error:
            raise click.ClickException(f"{error}; with --anew it is not looked at") from error
    replace(model, provenance={**_about(paths), **model.provenance}).save(out)
    checkpoint.remove()
    print_summary(model, out)


def _leave_one_out(path: Path, paths: Sequence[Path], out: Path) -> None:
    from gateway.training.display import Display, print_folds
    from gateway.training.innovations import innovations
    from gateway.training.leave_one_out import folds, settings_of

    settings = settings_of(read_model(path))
    dives = [read_navigation_data(one) for one in paths]
    out.mkdir(parents=True, exist_ok=True)
    made = []
    with Display() as display:
        records = [innovations(dive) for dive in display.track(dives, len(dives), "filter")]
        for fold in display.track(folds(records, settings), len(records), "models"):
            fold.model.save(out / f"{fold.left_out}.npz")
            made.append(fold)
    print_folds(made)


def _about(paths: Sequence[Path]) -> dict[str, Any]:
    return {
        "made": datetime.now(UTC).isoformat("T", "seconds"),
        "sha256": {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in paths},
    }
