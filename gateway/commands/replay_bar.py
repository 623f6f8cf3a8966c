"""How far a replay is, on a terminal: time of the dive, share of the logs, speed, time to go; and what it finds."""

from __future__ import annotations

import time
from collections.abc import Collection
from contextlib import AbstractContextManager
from types import TracebackType
from typing import TYPE_CHECKING, Self

from rich.console import Console
from rich.progress import BarColumn, Progress, SpinnerColumn, TaskProgressColumn, TextColumn, TimeRemainingColumn

from gateway.findings import Finding
from gateway.severity import Severity

if TYPE_CHECKING:
    from gateway.replay.session import Progress as Place

STYLES = {Severity.CRITICAL: "bold red", Severity.ERROR: "red", Severity.WARNING: "yellow"}
COLUMNS = (
    SpinnerColumn(),
    TextColumn("{task.description}"),
    BarColumn(),
    TaskProgressColumn(),
    TextColumn("{task.fields[dive]}"),
    TimeRemainingColumn(),
)


class ReplayBar(AbstractContextManager["ReplayBar"]):
    """A line that moves; on what is no terminal there is none.

    Args:
        console: to print on.
        least: findings of this severity, or a worse one, are printed as they come.
        notes: detectors whose findings say how what was asked went, and not how well the vehicle is.

    Attributes:
        told: all that were printed.
    """

    def __init__(self, console: Console, least: Severity, notes: Collection[str]) -> None:
        self._least, self._notes = least, notes
        self._bar = Progress(*COLUMNS, console=console, transient=True, disable=not console.is_terminal)
        self._task = self._bar.add_task("reading", total=1.0, dive="")
        self._what, self._quiet = "judging", False
        self._begun_s = time.perf_counter()
        self.told: list[str] = []

    def __enter__(self) -> Self:
        self._bar.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._bar.stop()

    def begin(self, what: str, quiet: bool = False) -> None:
        """Another replay of the same dive. `quiet`: its findings are not printed."""
        self._what, self._quiet = what, quiet
        self._begun_s = time.perf_counter()
        self._bar.reset(self._task, description=what, dive="")

    def drawing(self, what: str) -> None:
        """What is drawn now."""
        self._bar.update(self._task, description=f"drawing {what}", dive="")

    def show(self, place: Place) -> None:
        """How far it is now."""
        speed = place.dive_s / max(time.perf_counter() - self._begun_s, 1e-3)
        dive = f"{clock(place.dive_s)} of the dive, {speed:.0f} times real time"
        self._bar.update(self._task, description=self._what, completed=place.share, dive=dive)
        for finding in place.findings if not self._quiet else ():
            if finding.severity <= self._least:
                self.told.append(line_of(finding, place.begin_s, note=finding.detector in self._notes))
                style = STYLES.get(finding.severity)
                self._bar.console.print(self.told[-1], style=style, highlight=False, markup=False)


def line_of(finding: Finding, begin_s: float, note: bool) -> str:
    """With its time since the beginning. A note says how what was asked went, and not how well the vehicle is."""
    level = "" if note else finding.level.name
    return f"{clock(finding.time_s - begin_s)} {level:7} {finding.text}"


def clock(seconds: float) -> str:
    """A time since the beginning of a dive."""
    minutes, second = divmod(int(max(seconds, 0.0)), 60)
    return f"{minutes // 60}:{minutes % 60:02}:{second:02}"
