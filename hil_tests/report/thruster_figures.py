"""Plots of thrusters: speed beside what a healthy one would do, command, and what the gateway made of it."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

import numpy as np

from detectors.verdict import Level
from hil_tests.report.drawing import (
    COMMAND,
    HEALTHY,
    MEASURED,
    OTHER,
    SCORE,
    Figure,
    Json,
    happened,
    line,
    rows,
    score_axis,
    threshold,
    time_axis,
)
from hil_tests.report.outcome import Outcome
from hil_tests.scenario.fault import Fault

SCORED = re.compile(r"T(\d+)")
OF_THRUSTER = re.compile(r"thruster (\d+)\b")


def thruster_figures(outcome: Outcome) -> Iterator[Figure]:
    """One for each thruster that was simulated or scored; the main ones are those that something happened to."""
    struck = _struck(outcome)
    for number in sorted(_numbers(outcome)):
        yield _figure(outcome, number, number in struck)


def _numbers(outcome: Outcome) -> set[int]:
    simulated = range(1, 1 + (outcome.truth.command.shape[1] if outcome.truth else 0))
    scored = (SCORED.fullmatch(name) for name in outcome.scores)
    return {*simulated, *(int(found[1]) for found in scored if found)}


def _struck(outcome: Outcome) -> set[int]:
    """Thrusters with a fault, and those of which the gateway thought so."""
    faulty = {fault.subject.thruster for fault in outcome.scenario.faults}
    bad = (OF_THRUSTER.match(one.subject) for one in outcome.findings if one.level >= Level.SUSPECT)
    return {number for number in faulty if number is not None} | {int(found[1]) for found in bad if found}


def _figure(outcome: Outcome, number: int, main: bool) -> Figure:
    drawn = {"rpm": _speeds(outcome, number), "command": _command(outcome, number), "score": _scores(outcome, number)}
    titles = [title for title, row in drawn.items() if row]
    lines = [drawn[title] for title in titles]
    data = [trace | _on_row(index) for index, row in enumerate(lines) for trace in row]
    scored = titles.index("score") + 1 if "score" in titles else 0
    length_s = outcome.end_s - outcome.start_s
    layout = rows(*titles, shares=[2.0 if title == "rpm" else 1.0 for title in titles]) | {
        "xaxis": time_axis(outcome, anchor=f"y{len(lines)}" if len(lines) > 1 else "y"),
        "shapes": happened(_own(outcome.scenario.faults, number), length_s) + ([threshold(scored)] if scored else []),
    }
    if scored:
        score_axis(layout, scored, [trace["y"] for trace in lines[scored - 1]])
    return Figure(f"Thruster {number}", data, layout, 90 + 90 * len(lines), main)


def _own(faults: Sequence[Fault], number: int) -> list[Fault]:
    """Those that could show here: its own, and those of the supply that all thrusters share."""
    return [fault for fault in faults if fault.subject.thruster in {number, None}]


def _on_row(index: int) -> Json:
    return {"yaxis": f"y{index + 1}" if index else "y"}


def _speeds(outcome: Outcome, number: int) -> list[Json]:
    truth = outcome.truth
    if truth is None:
        return []
    since_s = truth.time_s - outcome.start_s
    return [
        line("healthy", since_s, truth.healthy_rpm[:, number - 1], HEALTHY, width=3.0),
        line("speed", since_s, truth.speed_rpm[:, number - 1], MEASURED),
    ]


def _command(outcome: Outcome, number: int) -> list[Json]:
    truth = outcome.truth
    if truth is None:
        return []
    return [line("command", truth.time_s - outcome.start_s, truth.command[:, number - 1], COMMAND)]


def _scores(outcome: Outcome, number: int) -> list[Json]:
    """The score with its threshold; without a simulation the residual is all that is known of the speed."""
    series = outcome.scores.get(f"T{number}")
    return [] if series is None else [line("score", series.time_s - outcome.start_s, np.asarray(series.value), SCORE)]


def residuals(outcome: Outcome) -> Figure | None:
    """Of all thrusters together, where their true speeds are not known; None: they are, or nothing was judged."""
    found = {int(name[1:-3]): one for name, one in outcome.scores.items() if re.fullmatch(r"T\d+RES", name)}
    if outcome.truth is not None or not found:
        return None
    data = [
        line(f"T{number}", one.time_s - outcome.start_s, one.value, OTHER) | {"line": {"width": 1.4}}
        for number, one in sorted(found.items())
    ]
    layout = rows("rpm") | {
        "xaxis": time_axis(outcome),
        "shapes": happened(outcome.scenario.faults, outcome.end_s - outcome.start_s),
    }
    return Figure("Thrusters: measured less predicted speed", data, layout)
