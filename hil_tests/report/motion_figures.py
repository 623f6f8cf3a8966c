"""Plots of the vehicle: its speed through the water, its track, depth and supply, and its navigation."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from gateway.plotting.clock import clock
from gateway.plotting.figure import Band, Colour, Dash, Figure, FloatArray, Line, Mark, Panel, Points
from gateway.report.drawable import largest, panels, score_panel
from gateway.report.track import flow_arrows, way
from hil_tests.report.drawing import happened, scored
from hil_tests.report.outcome import Outcome, Truth

NAVIGATION = {
    "NAVF": ("worst", Colour.RESIDUAL),
    "DVLF": ("DVL", Colour.MEASURED),
    "DEPTHF": ("depth", Colour.OTHER),
    "GYROF": ("gyro", Colour.COMMAND),
    "ACCELF": ("accel", Colour.PREDICTED),
}


def motion_figures(outcome: Outcome) -> Iterator[Figure]:
    """Those for which there is something to draw."""
    yield from _speed(outcome)
    if outcome.truth is not None and len(outcome.truth.time_s):
        yield _track(outcome, outcome.truth)
        yield _depth_and_supply(outcome, outcome.truth)
    yield from _navigation(outcome)


def _speed(outcome: Outcome) -> Iterator[Figure]:
    behind = tuple(happened(outcome, outcome.scenario.faults))
    lines = [*_true_speeds(outcome), *scored(outcome, "STW", "learnt", Colour.RESIDUAL)]
    if lines:
        drawn = panels(
            Panel("speed, m/s", (*behind, *_normal_range(outcome), *lines), share=1.6),
            score_panel(list(scored(outcome, "SPDF", "score", Colour.COMMAND)), *behind),
        )
        yield Figure("speed", "Speed", drawn)


def _true_speeds(outcome: Outcome) -> Iterator[Line]:
    if truth := outcome.truth:
        since_s = truth.time_s - outcome.start_s
        yield Line("through water", since_s, truth.through_water_mps, Colour.MEASURED)
        yield Line("over ground", since_s, truth.over_ground_mps, Colour.OTHER, Dash.DOTTED)


def _normal_range(outcome: Outcome) -> Iterator[Mark]:
    """A band of the speeds that the scenario's own settings for the gateway call normal."""
    speed = outcome.scenario.gateway.settings.get("speed", {})
    if {"minimum_mps", "maximum_mps"} <= speed.keys():
        edges_s = np.array([0.0, outcome.end_s - outcome.start_s])
        low_mps, high_mps = (np.full(2, float(speed[f"{edge}_mps"])) for edge in ("minimum", "maximum"))
        yield Band("normal", edges_s, low_mps, high_mps, Colour.NORMAL)


def _depth_and_supply(outcome: Outcome, truth: Truth) -> Figure:
    since_s, behind = truth.time_s - outcome.start_s, tuple(happened(outcome, outcome.scenario.faults))
    depth = Line("depth", since_s, truth.down_m, Colour.MEASURED)
    supply = Line("supply", since_s, truth.supply_v, Colour.PREDICTED)
    deepest_m = 1.05 * largest(truth.down_m) + 0.5
    drawn = panels(
        Panel("depth, m", (*behind, depth), y_range=(deepest_m, -0.2)), Panel("supply, V", (*behind, supply))
    )
    return Figure("depth-and-supply", "Depth and supply", drawn)


def _navigation(outcome: Outcome) -> Iterator[Figure]:
    lines = [line for name, look in NAVIGATION.items() for line in scored(outcome, name, *look)]
    if lines:
        drawn = panels(score_panel(lines, *happened(outcome, outcome.scenario.faults)))
        yield Figure("navigation", "Navigation: scores", drawn)


def _track(outcome: Outcome, truth: Truth) -> Figure:
    """From above, north up; the arrows are the current along the way."""
    since_s = truth.time_s - outcome.start_s
    current_mps = np.column_stack((truth.current_north_mps, truth.current_east_mps))
    everywhere = np.ones(len(since_s), dtype=bool)
    marks = (
        *way("track", since_s, truth.north_m, truth.east_m),
        *flow_arrows(current_mps, everywhere, truth.north_m, truth.east_m),
        *_onsets(outcome, truth, since_s),
    )
    title = "Track, from above"
    return Figure("track", title, panels(Panel("north, m", marks, equal=True)), over_time=False, x_title="east, m")


def _onsets(outcome: Outcome, truth: Truth, since_s: FloatArray) -> Iterator[Mark]:
    faults = outcome.scenario.faults
    if faults:
        at = np.searchsorted(since_s, [fault.at_s for fault in faults]).clip(max=len(since_s) - 1)
        labels = tuple(f"{fault.words}, {clock(fault.at_s)}" for fault in faults)
        yield Points("fault", truth.east_m[at], truth.north_m[at], Colour.FAULT, labels)
