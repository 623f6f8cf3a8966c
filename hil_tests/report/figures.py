"""All plots of a play, in the order in which they are looked at."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from gateway.plotting.figure import Figure
from hil_tests.report.check import Check
from hil_tests.report.motion_figures import motion_figures
from hil_tests.report.outcome import Outcome
from hil_tests.report.thruster_figures import residuals, thruster_figures
from hil_tests.report.timeline import timeline


def figures(outcome: Outcome, checks: Sequence[Check]) -> list[Figure]:
    """Only those for which there is something to draw: where nothing was simulated, the truth is not known."""
    drawn = [
        timeline(outcome, checks),
        *sorted(thruster_figures(outcome), key=lambda one: not one.main),
        *residuals(outcome),
        *motion_figures(outcome),
    ]
    whole = (0.0, outcome.end_s - outcome.start_s)
    return [replace(one, x_range=whole) if one.over_time else one for one in drawn if one.panels]
