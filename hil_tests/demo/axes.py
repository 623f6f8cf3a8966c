"""What the plots of a demonstration share: strips of colour for what a detector said, and lines for events."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager
from math import isfinite
from typing import TypeVar

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from detectors.verdict import Level

COLOURS = {Level.UNKNOWN: "0.75", Level.NORMAL: "#4c9f70", Level.SUSPECT: "#e0a100", Level.FAULT: "#c8102e"}
WORDS = {Level.UNKNOWN: "learning", Level.NORMAL: "normal", Level.SUSPECT: "suspect", Level.FAULT: "FAULT"}
MEASURED, PREDICTED, ONSET, TOLD, EVENT = "#1f4e79", "#e07b00", "#2e7d32", "#c8102e", "#6a3d9a"
CHARACTER_SHARE = 0.0115  # of the axes' width, for a letter of a label

Value = TypeVar("Value", Level, int)


def styled() -> AbstractContextManager[None]:
    """The look of all plots, for as long as it is entered."""
    return mpl.rc_context({"font.size": 11, "axes.grid": True, "grid.alpha": 0.3, "axes.axisbelow": True})


def draw_strip(
    axes: Axes,
    time_s: NDArray[np.float64],
    values: Sequence[Value],
    colours: Mapping[Value, str],
    words: Mapping[Value, str],
    label: str,
) -> None:
    """A strip of colour, one stretch for each time that a value lasted.

    Args:
        axes: where.
        time_s: (N,) of the values, N >= 1.
        values: N of them.
        colours, words: by value.
        label: of the strip.
    """
    begins: list[int] = [0, *(index for index in range(1, len(values)) if values[index] != values[index - 1])]
    width_s = max(float(time_s[-1] - time_s[0]), 1e-9)
    for begin, end in zip(begins, [*begins[1:], len(values) - 1], strict=True):
        value = values[begin]
        axes.axvspan(time_s[begin], time_s[end], color=colours[value], lw=0)
        if time_s[end] - time_s[begin] > CHARACTER_SHARE * len(words[value]) * width_s:
            middle_s = 0.5 * (time_s[begin] + time_s[end])
            axes.text(middle_s, 0.5, words[value], ha="center", va="center", color="white", fontweight="bold")
    axes.set_ylim(0.0, 1.0)
    axes.set_yticks([])
    axes.set_ylabel(label, rotation=0, ha="right", va="center")
    axes.grid(visible=False)
    axes.set_xlim(time_s[0], time_s[-1])


def mark(axes: Axes, since_s: float, lasted_s: float, colour: str, style: str, label: str) -> None:
    """A line down the axes at an event, if it fell within the demonstration."""
    if isfinite(since_s) and since_s <= lasted_s:
        axes.axvline(since_s, color=colour, ls=style, lw=1.8, label=label)
