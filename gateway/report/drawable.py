"""What the figures of a report have in common: levels as colours, times of trouble, and nothing drawn of nothing."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from detectors.verdict import Level as VerdictLevel
from gateway.plotting.figure import Band, Colour, FloatArray, Level, Line, Mark, Panel, Points, Span
from gateway.report.episodes import Episode

LEVEL_COLOURS: Mapping[VerdictLevel, Colour] = {
    VerdictLevel.UNKNOWN: Colour.UNKNOWN,
    VerdictLevel.NORMAL: Colour.NORMAL,
    VerdictLevel.SUSPECT: Colour.SUSPECT,
    VerdictLevel.FAULT: Colour.FAULT,
}
# beyond it, the threshold could no longer be seen
SCORE_SHOWN_MAX = 10.0
MARGIN = 1.1


def trouble_spans(troubles: Iterable[Episode]) -> Iterator[Span]:
    """The times behind a plot at which something was suspected, and those at which it was found."""
    for one in troubles:
        yield Span(one.level.name, one.from_s, one.to_s, LEVEL_COLOURS[one.level])


def panels(*wanted: Panel) -> tuple[Panel, ...]:
    """Those that show something, without the lines that show nothing."""
    found = (_without_nothing(panel) for panel in wanted)
    return tuple(panel for panel in found if any(not isinstance(mark, Span | Level) for mark in panel.marks))


def score_panel(lines: Sequence[Line], *behind: Mark) -> Panel:
    """Scores with the threshold of a FAULT, cut where it would no longer be seen.

    Args:
        lines: the scores.
        behind: what is drawn first.
    """
    highest = max((largest(line.y) for line in lines), default=0.0)
    title = "score" if highest <= SCORE_SHOWN_MAX else f"score, cut at {SCORE_SHOWN_MAX:g}"
    y_range = (0.0, min(max(1.35, MARGIN * highest), SCORE_SHOWN_MAX))
    return Panel(title, (*behind, *lines, Level("FAULT", 1.0)), share=0.8, y_range=y_range)


def largest(value: FloatArray) -> float:
    """Largest size of what is a number; 0.0 where nothing is."""
    return float(np.abs(value[np.isfinite(value)]).max(initial=0.0))


def where(condition: NDArray[np.bool_], value: FloatArray) -> FloatArray:
    """(N,) the values at which the condition holds, with gaps elsewhere."""
    return np.where(condition, value, np.nan)


def even(count: int, count_max: int) -> NDArray[np.intp]:
    """Indices of at most so many of `count` samples, evenly apart, the first and the last among them."""
    return np.unique(np.linspace(0, count - 1, min(count, count_max)).round().astype(np.intp))


def _without_nothing(panel: Panel) -> Panel:
    return replace(panel, marks=tuple(mark for mark in panel.marks if _shows(mark)))


def _shows(mark: Mark) -> bool:
    match mark:
        case Line() | Points():
            return bool((np.isfinite(mark.x) & np.isfinite(mark.y)).any())
        case Band():
            return bool((np.isfinite(mark.low) & np.isfinite(mark.high)).any())
        case Level():
            return bool(np.isfinite(mark.y))
        case _:
            return True
