"""Plots of thrusters: speed beside what a healthy one would do, command, and what the gateway made of it."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from detectors.verdict import Level
from gateway.plotting.figure import Colour, Figure, Line, Mark, Panel
from gateway.report.drawable import panels, score_panel
from hil_tests.report.drawing import happened, scored
from hil_tests.report.outcome import Outcome
from hil_tests.scenario.fault import Fault

SCORED = re.compile(r"T(\d+)")
RESIDUAL = re.compile(r"T(\d+)RES")
OF_THRUSTER = re.compile(r"thruster (\d+)\b")


def thruster_figures(outcome: Outcome) -> Iterator[Figure]:
    """One for each thruster that was simulated or scored; the main ones are those that something happened to."""
    struck = _struck(outcome)
    for number in sorted(_numbers(outcome)):
        yield _figure(outcome, number, main=number in struck)


def _numbers(outcome: Outcome) -> set[int]:
    simulated = range(1, 1 + (outcome.truth.command.shape[1] if outcome.truth else 0))
    told = (SCORED.fullmatch(name) for name in outcome.scores)
    return {*simulated, *(int(found[1]) for found in told if found)}


def _struck(outcome: Outcome) -> set[int]:
    """Thrusters with a fault, and those of which the gateway thought so."""
    faulty = {fault.subject.thruster for fault in outcome.scenario.faults}
    bad = (OF_THRUSTER.match(one.subject) for one in outcome.findings if one.level >= Level.SUSPECT)
    return {number for number in faulty if number is not None} | {int(found[1]) for found in bad if found}


def _figure(outcome: Outcome, number: int, *, main: bool) -> Figure:
    behind = tuple(happened(outcome, _own(outcome.scenario.faults, number)))
    drawn = panels(
        Panel("speed, rpm", (*behind, *_speeds(outcome, number)), share=1.6),
        Panel("command, %", (*behind, *_command(outcome, number)), share=0.8),
        score_panel(list(scored(outcome, f"T{number}", "score", Colour.RESIDUAL)), *behind),
    )
    return Figure(f"thruster-{number}", f"Thruster {number}", drawn, main=main)


def _own(faults: Sequence[Fault], number: int) -> list[Fault]:
    """Those that could show here: its own, and those of the supply that all thrusters share."""
    return [fault for fault in faults if fault.subject.thruster in {number, None}]


def _speeds(outcome: Outcome, number: int) -> Iterator[Mark]:
    if truth := outcome.truth:
        since_s = truth.time_s - outcome.start_s
        yield Line("healthy", since_s, truth.healthy_rpm[:, number - 1], Colour.PREDICTED, width=3.0)
        yield Line("measured", since_s, truth.speed_rpm[:, number - 1], Colour.MEASURED)


def _command(outcome: Outcome, number: int) -> Iterator[Mark]:
    if truth := outcome.truth:
        yield Line("command", truth.time_s - outcome.start_s, 100.0 * truth.command[:, number - 1], Colour.COMMAND)


def residuals(outcome: Outcome) -> Iterator[Figure]:
    """Of all thrusters together, where their true speeds are not known; none: they are, or nothing was judged."""
    names = {int(found[1]): name for name in outcome.scores if (found := RESIDUAL.fullmatch(name))}
    if outcome.truth is None and names:
        lines = [line for one in sorted(names) for line in scored(outcome, names[one], f"T{one}", Colour.OTHER)]
        drawn = panels(Panel("rpm", (*happened(outcome, outcome.scenario.faults), *lines)))
        yield Figure("residuals", "Thrusters: measured less predicted speed", drawn)
