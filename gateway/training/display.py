"""Progress bars of a training, and its closing table."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, TypeVar

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from detectors.navigation.lstm import Model
from gateway.training.evaluation import Figures, pooled
from gateway.training.fit import Stage
from gateway.training.leave_one_out import Fold

T = TypeVar("T")

ROWS = {"predictor": "predicted", "none (zero)": "zero", "mean in training": "mean"}


class Display:
    """Two bars on standard error: all trainings, and the epochs of the one that runs."""

    def __init__(self) -> None:
        columns = TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn()
        self._progress = Progress(*columns, console=Console(stderr=True), transient=True)
        self._all = self._progress.add_task("trainings", visible=False)
        self._one = self._progress.add_task("", visible=False)

    def __enter__(self) -> Display:
        self._progress.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._progress.stop()

    def track(self, items: Iterable[T], of: int, what: str) -> Iterator[T]:
        """The items, under a bar of their own."""
        return iter(self._progress.track(items, total=of, description=what))

    def stage(self, stage: Stage) -> None:
        """How far the trainings are."""
        best = "" if stage.best is None else f", best error {stage.best:.3f}"
        what, epochs = str(stage.hyperparameters), stage.hyperparameters.epochs
        self._progress.update(
            self._all, completed=stage.training - 1, total=stage.of, description=f"trainings{best}", visible=True
        )
        self._progress.update(self._one, completed=stage.epochs_done, total=epochs, description=what, visible=True)


def print_folds(folds: Sequence[Fold]) -> None:
    """How well each model does on the recording that it has not seen."""
    table = _table("RMS error of innovations, by predictor / by zero", "left out")
    for fold in folds:
        table.add_row(fold.left_out, *_cells(fold.figures))
    table.add_row("all", *_cells(pooled([fold.figures for fold in folds])))
    Console().print(table)


def _cells(figures: Figures) -> list[str]:
    both = zip(figures.predicted, figures.zero, strict=True)
    return [f"{1e3 * ours:.1f} / {1e3 * zero:.1f}" for ours, zero in both]


def print_summary(model: Model, path: Path) -> None:
    """What was made, and how well it does on what was left out."""
    about = model.provenance
    console = Console()
    count = len(about["recordings"])
    console.print(f"{path}: {model.hidden} hidden units, trained on {about['samples']} samples of {count} recordings")
    if about["figures"] is not None:
        console.print(_figures_table(about["figures"], len(about["validated_with"])))


def _figures_table(figures: Mapping[str, Any], count: int) -> Table:
    table = _table(f"RMS error of innovations on what was left out of {count} recordings", "foretold by")
    for title, key in ROWS.items():
        table.add_row(title, *(f"{1e3 * value:.1f}" for value in figures[key]))
    return table


def _table(title: str, first: str) -> Table:
    table = Table(title=title)
    table.add_column(first)
    for heading in ("DVL forward\nmm/s", "right\nmm/s", "down\nmm/s", "depth\nmm"):
        table.add_column(heading, justify="right")
    return table
