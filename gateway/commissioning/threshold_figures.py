"""How often healthy peaks exceed a threshold: as counted, as fitted, and where the threshold was put."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from gateway.commissioning.peaks import Tail
from gateway.plotting.figure import Band, Colour, Dash, Figure, Level, Line, Panel, Points

FloatArray: TypeAlias = NDArray[np.float64]

POINTS = 60


def threshold_figure(peaks: FloatArray, fitted: Tail, caution: float, wanted_per_hour: float) -> Figure:
    """Rates in powers of ten, over the threshold."""
    ordered = np.sort(peaks)[::-1]
    counted = np.log10(np.arange(1, len(ordered) + 1) / fitted.hours)
    levels = np.linspace(fitted.base, max(1.2 * caution, float(ordered[0])), POINTS)
    rates = [fitted.rate(level) for level in levels.tolist()]
    likely, bound = (np.log10([getattr(one, name) for one in rates]) for name in ("per_hour", "bound_per_hour"))
    top = float(max(bound.max(), counted.max()))
    bottom = float(np.log10(wanted_per_hour)) - 1.0
    return Figure(
        name="thrusters-threshold",
        title="How often healthy thrusters exceed a threshold",
        panels=(
            Panel(
                "times per hour, power of ten",
                (
                    Band("up to the 95 % bound", levels, likely, bound, Colour.OTHER),
                    Line("fitted tail", levels, likely, Colour.PREDICTED),
                    Points("peaks that were reached", ordered, counted, Colour.MEASURED),
                    Line("caution", np.full(2, caution), np.array([bottom, top]), Colour.THRESHOLD, Dash.DASHED),
                    Level(f"wanted: {wanted_per_hour:g} per hour", float(np.log10(wanted_per_hour))),
                ),
                share=2.0,
                y_range=(bottom, top + 0.2),
            ),
        ),
        about="0 is once per hour, -1 once in ten hours. Each dot is the greatest score of any thruster within ten"
        " seconds; 1 is the threshold of a fault with a caution of 1.",
        over_time=False,
        x_title="score, in thresholds",
    )
