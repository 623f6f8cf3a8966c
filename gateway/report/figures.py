"""All figures of a dive, in the order in which they are looked at."""

from __future__ import annotations

from dataclasses import replace

from gateway.plotting.figure import Figure
from gateway.report.dive import Dive
from gateway.report.link_figures import link_figures
from gateway.report.navigation_figures import navigation_figures
from gateway.report.speed_figures import speed_figures
from gateway.report.thruster_figures import thruster_figures
from gateway.report.timeline_figure import timeline_figure


def figures(dive: Dive) -> list[Figure]:
    """The time line, then what something was found of, then the rest; only those that show something."""
    several = [*thruster_figures(dive), *speed_figures(dive), *navigation_figures(dive), *link_figures(dive)]
    drawn = [timeline_figure(dive), *sorted(several, key=lambda one: not one.main)]
    whole = (dive.from_s, dive.end_s - dive.begin_s)  # of all the same: what happened at a time stands at one place
    return [replace(one, x_range=whole) if one.over_time else one for one in drawn if one.panels]
