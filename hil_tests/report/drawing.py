"""What the plots of a play have in common: what the gateway told as lines, and when there were faults."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from gateway.plotting.figure import Colour, Line, Mark, Span
from hil_tests.report.outcome import Outcome
from hil_tests.scenario.fault import Fault


def scored(outcome: Outcome, name: str, label: str, colour: Colour) -> Iterator[Line]:
    """The line of what the gateway plots by that name; none where it never told it."""
    if name in outcome.scores:
        series = outcome.scores[name]
        yield Line(label, series.time_s - outcome.start_s, series.value, colour)


def happened(outcome: Outcome, faults: Sequence[Fault]) -> Iterator[Mark]:
    """When there were faults, behind a plot."""
    length_s = outcome.end_s - outcome.start_s
    for fault in faults:
        if fault.at_s < length_s:
            yield Span("fault", fault.at_s, min(fault.until_s, length_s), Colour.FAULT)
