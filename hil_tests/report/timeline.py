"""The plot that tells a play at a glance: one row each for faults, modes, messages, and what was found of whom.

Links and signals that were well all along have none.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise

from gateway.findings import Finding
from gateway.plotting.clock import lasting
from gateway.plotting.figure import Colour, Figure
from gateway.plotting.rows import Moment, Piece, Row, rows_panel, told_apart
from gateway.report.drawable import LEVEL_COLOURS
from gateway.report.subjects import DETECTORS, by_subject, calm_subjects
from gateway.severity import Severity
from hil_tests.report.check import Check
from hil_tests.report.commands import acts, told
from hil_tests.report.modes import stretches
from hil_tests.report.outcome import Outcome
from hil_tests.report.wanted import severity_name
from hil_tests.report.windows import since_start_s
from hil_tests.scenario.fault import Fault

URGENCY: Mapping[int, Colour] = {
    Severity.EMERGENCY: Colour.FAULT,
    Severity.ALERT: Colour.FAULT,
    Severity.CRITICAL: Colour.FAULT,
    Severity.ERROR: Colour.FAULT,
    Severity.WARNING: Colour.SUSPECT,
}


def timeline(outcome: Outcome, checks: Sequence[Check]) -> Figure:
    """The figure; `checks` are those of the play."""
    return Figure("timeline", "Time line", (rows_panel(list(_rows(outcome, checks))),))


def _rows(outcome: Outcome, checks: Sequence[Check]) -> Iterator[Row]:
    length_s = outcome.end_s - outcome.start_s
    for fault in outcome.scenario.faults:
        yield Row(fault.words, [_fault(fault, length_s)])
    yield Row("expected", moments=list(_checked(checks)))
    if outcome.modes:
        several = stretches(outcome)
        colours = told_apart(one.words for one in several)
        yield Row("mode", [Piece(one.from_s, one.to_s, colours[one.words], one.words) for one in several])
    acting = [one for one in outcome.commands if acts(one)]
    if acting:
        marks = [Moment(since_start_s(outcome, one.time_s), "", Colour.COMMAND, told(one)) for one in acting]
        yield Row("command", moments=marks)
    yield Row("STATUSTEXT", moments=list(_texts(outcome)))
    calm = calm_subjects(outcome.findings)
    for subject, found in by_subject(outcome.findings).items():
        if subject not in calm or found[0].detector in DETECTORS:
            yield Row(subject, list(_levels(outcome, found)))


def _levels(outcome: Outcome, found: Sequence[Finding]) -> Iterator[Piece]:
    ends_s = [since_start_s(outcome, one.time_s) for one in found] + [outcome.end_s - outcome.start_s]
    for one, (from_s, to_s) in zip(found, pairwise(ends_s), strict=True):
        yield Piece(from_s, max(from_s, to_s), LEVEL_COLOURS[one.level], one.level.name, one.text)


def _checked(checks: Sequence[Check]) -> Iterator[Moment]:
    for one in checks:
        if one.time_s is not None:
            name, colour = ("as expected", Colour.NORMAL) if one.passed else ("not as expected", Colour.FAULT)
            yield Moment(one.time_s, name, colour, one.expected)


def _texts(outcome: Outcome) -> Iterator[Moment]:
    for one in outcome.texts:
        colour = URGENCY.get(one.severity, Colour.UNKNOWN)
        text = f"{severity_name(one.severity)}: {one.text}"
        yield Moment(since_start_s(outcome, one.time_s), "", colour, text)


def _fault(fault: Fault, length_s: float) -> Piece:
    ramp = f", grows within {lasting(fault.ramp_s)}" if fault.ramp_s else ""
    size = ", ".join(f"{name} {value:g}" for name, value in fault.values.items())
    to_s = max(min(fault.until_s, length_s), fault.at_s)
    return Piece(fault.at_s, to_s, Colour.FAULT, fault.words, f"{size}{ramp}".removeprefix(", "))
