"""A report in the making: it looks on while a dive is replayed, and is written at the end."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from gateway.config import Config
from gateway.findings import Finding
from gateway.plotting.figure import Figure
from gateway.plotting.picture import SUFFIXES, save_picture
from gateway.replay.result import ReplayResult
from gateway.report import PAGE, PICTURES
from gateway.report.collecting import Collecting
from gateway.report.figures import figures
from gateway.report.page import write_page


class Report:
    """See the module's text.

    Args:
        config: that the dive is judged by.

    Attributes:
        onlooker: of the replay.
    """

    def __init__(self, config: Config) -> None:
        self.onlooker = Collecting(config)
        self._findings: list[Finding] = []

    def take(self, findings: Iterable[Finding]) -> None:
        """What was found, in order."""
        self._findings += findings

    def write(
        self,
        result: ReplayResult,
        folder: Path,
        again: Sequence[str],
        *,
        pictures: bool = False,
        progress: Callable[[str], None] = lambda _: None,
    ) -> None:
        """Write the page, and where they are wanted the same figures as PNG and SVG.

        Args:
            result: what the replay came to.
            folder: for `PAGE`, and for the folder `PICTURES`; exists.
            again: the command that replays it once more, in words as a shell gets them.
            pictures: whether there are pictures, too.
            progress: hears what is being drawn.

        Raises:
            OSError: something cannot be written.
        """
        progress("the report")
        dive = self.onlooker.dive(result, self._findings, list(result.logs))
        drawn = figures(dive)
        write_page(dive, drawn, again, folder / PAGE)
        if pictures:
            _save(drawn, folder / PICTURES, progress)


def _save(drawn: Sequence[Figure], folder: Path, progress: Callable[[str], None]) -> None:
    folder.mkdir(exist_ok=True)
    for figure in drawn:
        progress(figure.title)
        for suffix in SUFFIXES:
            save_picture(figure, folder / f"{figure.name}{suffix}")
