"""The plot that tells a play at a glance: one lane each for faults, modes, messages, and what was found of whom.

Links and signals that were well all along have none.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from itertools import pairwise

from detectors.verdict import Level
from gateway.findings import Finding
from gateway.plotting.clock import clock
from gateway.report.subjects import DETECTORS, by_subject, calm_subjects
from gateway.severity import Severity
from hil_tests.report.check import Check
from hil_tests.report.commands import acts, told
from hil_tests.report.drawing import (
    COMMAND,
    FAULT_LINE,
    LEVELS,
    OTHER,
    Figure,
    Json,
    happened,
    instant,
    time_axis,
)
from hil_tests.report.modes import stretches
from hil_tests.report.outcome import Outcome
from hil_tests.report.wanted import severity_name
from hil_tests.report.windows import since_start_s
from hil_tests.scenario.fault import Fault

LANE_PX, MARGIN_PX = 24, 60
MARGIN_SHARE = 0.012  # of the length, before the start: markers of the first moment are whole
HALF = 0.36  # of a bar's height, in lanes
URGENCY: Mapping[int, str] = {
    Severity.EMERGENCY: LEVELS[Level.FAULT],
    Severity.ALERT: LEVELS[Level.FAULT],
    Severity.CRITICAL: LEVELS[Level.FAULT],
    Severity.ERROR: LEVELS[Level.FAULT],
    Severity.WARNING: LEVELS[Level.SUSPECT],
}


@dataclass(frozen=True, slots=True)
class Lane:
    """A lane and what is drawn in it, around y = 0."""

    label: str
    traces: Sequence[Json]


@dataclass(frozen=True, slots=True)
class Bar:
    """A stretch of time, in seconds since the start."""

    from_s: float
    to_s: float
    words: str
    hover: str
    colour: str


@dataclass(frozen=True, slots=True)
class Marker:
    """An instant."""

    since_s: float
    hover: str
    colour: str


def timeline(outcome: Outcome, checks: Sequence[Check]) -> Figure:
    """The figure; `checks` are those of the play."""
    length_s = outcome.end_s - outcome.start_s
    lanes = list(_lanes(outcome, checks))
    data = [_moved(trace, -index) for index, lane in enumerate(lanes) for trace in lane.traces]
    labels = [escape(lane.label) for lane in lanes]
    axis = {
        "tickvals": [-index for index in range(len(lanes))],
        "ticktext": labels,
        "range": [0.6 - len(lanes), 0.6],
        "fixedrange": True,
        "zeroline": False,
        "automargin": True,
    }
    layout = {
        "barmode": "overlay",
        "showlegend": False,
        "hovermode": "closest",
        "uniformtext": {"minsize": 9, "mode": "hide"},
        "xaxis": time_axis(outcome, range=[instant(-MARGIN_SHARE * length_s), instant(length_s)]),
        "yaxis": axis,
        "shapes": happened(outcome.scenario.faults, length_s),
    }
    return Figure("Time line", data, layout, MARGIN_PX + LANE_PX * len(lanes))


def _lanes(outcome: Outcome, checks: Sequence[Check]) -> Iterator[Lane]:
    length_s = outcome.end_s - outcome.start_s
    for fault in outcome.scenario.faults:
        yield Lane(fault.words, [_fault(fault, length_s)])
    yield Lane("expected", [_checked(checks, passed=True), _checked(checks, passed=False)])
    if outcome.modes:
        yield Lane("mode", [_modes(outcome)])
    acting = [one for one in outcome.commands if acts(one)]
    if acting:
        marks = [Marker(since_start_s(outcome, one.time_s), told(one), COMMAND) for one in acting]
        yield Lane("command", [_markers(marks, "diamond", 11)])
    texts = [
        Marker(
            since_start_s(outcome, one.time_s),
            f"{severity_name(one.severity)}: {one.text}",
            _urgency(one.severity),
        )
        for one in outcome.texts
    ]
    yield Lane("STATUSTEXT", [_markers(texts, "triangle-down", 11)])
    calm = calm_subjects(outcome.findings)
    for subject, found in by_subject(outcome.findings).items():
        if subject not in calm or found[0].detector in DETECTORS:
            yield Lane(subject, [_bars(_levels(outcome, found))])


def _levels(outcome: Outcome, found: Sequence[Finding]) -> list[Bar]:
    ends_s = [since_start_s(outcome, one.time_s) for one in found] + [outcome.end_s - outcome.start_s]
    return [
        Bar(from_s, max(from_s, to_s), one.level.name, f"{one.level.name}: {one.text}", LEVELS[one.level])
        for one, (from_s, to_s) in zip(found, pairwise(ends_s), strict=True)
    ]


def _modes(outcome: Outcome) -> Json:
    bars = [Bar(one.from_s, one.to_s, one.words, one.words, OTHER) for one in stretches(outcome)]
    return _bars(bars) | {"marker": {"color": OTHER, "line": {"width": 1.5, "color": "rgba(255,255,255,0.6)"}}}


def _checked(checks: Sequence[Check], *, passed: bool) -> Json:
    colour = LEVELS[Level.NORMAL if passed else Level.FAULT]
    marks = [
        Marker(one.time_s, one.expected, colour) for one in checks if one.passed is passed and one.time_s is not None
    ]
    return _markers(marks, "circle" if passed else "x", 10)


def _urgency(severity: int) -> str:
    return URGENCY.get(severity, LEVELS[Level.UNKNOWN])


def _bars(bars: Sequence[Bar]) -> Json:
    return {
        "type": "bar",
        "orientation": "h",
        "base": [instant(one.from_s) for one in bars],
        "x": [round(1000.0 * (one.to_s - one.from_s)) for one in bars],
        "y": [0.0] * len(bars),
        "width": 2.0 * HALF,
        "marker": {"color": [one.colour for one in bars]},
        "text": [escape(one.words) for one in bars],
        "textposition": "inside",
        "insidetextanchor": "middle",
        "textangle": 0,
        "insidetextfont": {"color": "white"},
        "hovertext": [f"{clock(one.from_s)} to {clock(one.to_s)}<br>{escape(one.hover)}" for one in bars],
        "hoverinfo": "text",
    }


def _markers(marks: Sequence[Marker], symbol: str, size: int) -> Json:
    return {
        "type": "scatter",
        "mode": "markers",
        "x": [instant(one.since_s) for one in marks],
        "y": [0.0] * len(marks),
        "marker": {"symbol": symbol, "size": size, "color": [one.colour for one in marks]},
        "hovertext": [f"{clock(one.since_s)}<br>{escape(one.hover)}" for one in marks],
        "hoverinfo": "text",
        "cliponaxis": False,
    }


def _fault(fault: Fault, length_s: float) -> Json:
    """A bar whose left end rises as the fault does."""
    until_s = min(fault.until_s, length_s)
    full_s = min(fault.at_s + fault.ramp_s, until_s)
    words = ", ".join(f"{name} {value:g}" for name, value in fault.values.items())
    hover = f"{clock(fault.at_s)} to {clock(until_s)}<br>{escape(fault.words)}<br>{escape(words)}"
    corners_s = [fault.at_s, full_s, until_s, until_s, fault.at_s]
    return {
        "type": "scatter",
        "mode": "lines",
        "x": [instant(one) for one in corners_s],
        "y": [-HALF, HALF, HALF, -HALF, -HALF],
        "fill": "toself",
        "fillcolor": FAULT_LINE,
        "line": {"width": 0},
        "hoveron": "fills",
        "text": hover,
        "hoverinfo": "text",
    }


def _moved(trace: Json, lane: int) -> Json:
    return trace | {"y": [y + lane for y in trace["y"]]}
