"""Plots of the vehicle: its speed through the water, its track, depth and supply, and its navigation."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import hypot
from typing import Any

import numpy as np

from detectors.verdict import Level
from gateway.plotting.clock import clock
from gateway.plotting.decimation import decimated
from hil_tests.report.drawing import (
    COMMAND,
    HEALTHY,
    LEVELS,
    MEASURED,
    OTHER,
    POINTS_MAX,
    SCORE,
    Figure,
    Json,
    happened,
    line,
    rounded,
    rows,
    score_axis,
    threshold,
    time_axis,
)
from hil_tests.report.outcome import FloatArray, Outcome, Truth

ARROWS = 9
ARROW_SHARE = 0.12  # of the track's extent, for the strongest current
STILL_MPS = 0.01
NAVIGATION = {
    "NAVF": ("worst", SCORE),
    "DVLF": ("DVL", MEASURED),
    "DEPTHF": ("depth", OTHER),
    "GYROF": ("gyro", COMMAND),
    "ACCELF": ("accel", HEALTHY),
}


def motion_figures(outcome: Outcome) -> Iterator[Figure]:
    """Those for which there is something to draw."""
    yield from _speed(outcome)
    if outcome.truth is not None and len(outcome.truth.time_s):
        yield _track(outcome, outcome.truth)
        yield _depth_and_supply(outcome, outcome.truth)
    yield from _navigation(outcome)


def _over_time(title: str, outcome: Outcome, data: list[Json], axes: Json, height_px: int) -> Figure:
    last = max((int(name.removeprefix("yaxis") or 1) for name in axes), default=1)
    layout = axes | {
        "xaxis": time_axis(outcome, anchor=f"y{last}" if last > 1 else "y"),
        "shapes": happened(outcome.scenario.faults, outcome.end_s - outcome.start_s),
    }
    return Figure(title, data, layout, height_px)


def _scored(outcome: Outcome, name: str, label: str, colour: str, axis: int = 1) -> list[Json]:
    series = outcome.scores.get(name)
    return [] if series is None else [line(label, series.time_s - outcome.start_s, series.value, colour, axis=axis)]


def _speed(outcome: Outcome) -> Iterator[Figure]:
    data = _scored(outcome, "STW", "learnt", SCORE)
    if truth := outcome.truth:
        since_s = truth.time_s - outcome.start_s
        data.insert(0, line("through water", since_s, truth.through_water_mps, MEASURED))
        data.insert(1, line("over ground", since_s, truth.over_ground_mps, OTHER, dash="dot"))
    score = _scored(outcome, "SPDF", "score", COMMAND, axis=2)
    if not data:
        return
    axes = rows("m/s", "score", shares=(2.0, 1.0)) if score else rows("m/s")
    figure = _over_time("Speed", outcome, data + score, axes, 300 if score else 240)
    figure.layout["shapes"] += _normal_range(outcome.scenario.gateway.settings)
    if score:
        figure.layout["shapes"].append(threshold(2))
        score_axis(figure.layout, 2, [score[0]["y"]])
    yield figure


def _normal_range(settings: Mapping[str, Any]) -> list[Json]:
    """A band of the speeds that the scenario's own settings for the gateway call normal."""
    speed = settings.get("speed", {})
    if not {"minimum_mps", "maximum_mps"} <= speed.keys():
        return []
    place = {"xref": "paper", "x0": 0, "x1": 1, "yref": "y", "y0": speed["minimum_mps"], "y1": speed["maximum_mps"]}
    look = {
        "type": "rect",
        "layer": "below",
        "fillcolor": LEVELS[Level.NORMAL],
        "opacity": 0.12,
        "line": {"width": 0},
    }
    return [place | look]


def _depth_and_supply(outcome: Outcome, truth: Truth) -> Figure:
    since_s = truth.time_s - outcome.start_s
    data = [line("depth", since_s, truth.down_m, MEASURED), line("supply", since_s, truth.supply_v, HEALTHY, axis=2)]
    axes = rows("depth, m", "supply, V")
    axes["yaxis"]["autorange"] = "reversed"
    return _over_time("Depth and supply", outcome, data, axes, 260)


def _navigation(outcome: Outcome) -> Iterator[Figure]:
    found = {name: look for name, look in NAVIGATION.items() if name in outcome.scores}
    if not found:
        return
    data = [trace for name, (label, colour) in found.items() for trace in _scored(outcome, name, label, colour)]
    figure = _over_time("Navigation: scores", outcome, data, rows("score"), 240)
    figure.layout["shapes"].append(threshold(1))
    score_axis(figure.layout, 1, [trace["y"] for trace in data])
    yield figure


def _track(outcome: Outcome, truth: Truth) -> Figure:
    """From above, north up; the arrows are the current along the way."""
    since_s = truth.time_s - outcome.start_s
    kept = np.union1d(decimated(truth.north_m, POINTS_MAX // 2), decimated(truth.east_m, POINTS_MAX // 2))
    path = _places(truth, kept) | {
        "mode": "lines",
        "name": "track",
        "line": {"color": MEASURED, "width": 2},
        "text": [clock(one) for one in since_s[kept].tolist()],
    }
    onsets = [
        _spot(truth, since_s, fault.at_s, fault.words, LEVELS[Level.FAULT], "x") for fault in outcome.scenario.faults
    ]
    ends = [
        _spot(truth, since_s, 0.0, "start", LEVELS[Level.NORMAL], "circle"),
        _spot(truth, since_s, float(since_s[-1]), "end", MEASURED, "square"),
    ]
    layout = {
        "xaxis": {"title": {"text": "east, m"}},
        "yaxis": {"title": {"text": "north, m"}, "scaleanchor": "x"},
        "hovermode": "closest",
        "annotations": _current(truth),
    }
    return Figure("Track, from above", [path, *ends, *onsets], layout, 380)


def _places(truth: Truth, kept: Any) -> Json:
    return {
        "type": "scatter",
        "x": rounded(truth.east_m[kept]),
        "y": rounded(truth.north_m[kept]),
        "hovertemplate": "%{text}<br>%{x} m east, %{y} m north",
    }


def _spot(truth: Truth, since_s: FloatArray, at_s: float, name: str, colour: str, symbol: str) -> Json:
    index = min(int(np.searchsorted(since_s, at_s)), len(since_s) - 1)
    return _places(truth, [index]) | {
        "mode": "markers",
        "name": name,
        "text": [f"{name}, {clock(float(since_s[index]))}"],
        "marker": {"color": colour, "size": 10, "symbol": symbol},
    }


def _current(truth: Truth) -> list[Json]:
    indices = np.unique(np.linspace(0, len(truth.time_s) - 1, ARROWS).astype(int)).tolist()
    north_mps, east_mps = truth.current_north_mps, truth.current_east_mps
    strongest_mps = max(hypot(north_mps[index], east_mps[index]) for index in indices)
    if strongest_mps < STILL_MPS:
        return []
    extent_m = max(float(np.ptp(truth.north_m)), float(np.ptp(truth.east_m)), 1.0)
    m_per_mps = ARROW_SHARE * extent_m / strongest_mps
    return [
        _arrow(
            float(truth.east_m[index]),
            float(truth.north_m[index]),
            m_per_mps * float(east_mps[index]),
            m_per_mps * float(north_mps[index]),
            f"current {hypot(north_mps[index], east_mps[index]):.2f} m/s",
        )
        for index in indices
        if hypot(north_mps[index], east_mps[index]) >= STILL_MPS
    ]


def _arrow(east_m: float, north_m: float, to_east_m: float, to_north_m: float, words: str) -> Json:
    """An annotation without a text, whose tail is at a place and whose head lies so far from it."""
    return {
        "x": round(east_m + to_east_m, 3),
        "y": round(north_m + to_north_m, 3),
        "ax": round(east_m, 3),
        "ay": round(north_m, 3),
        "xref": "x",
        "yref": "y",
        "axref": "x",
        "ayref": "y",
        "text": "",
        "hovertext": words,
        "showarrow": True,
        "arrowhead": 2,
        "arrowwidth": 1.5,
        "arrowcolor": OTHER,
    }
