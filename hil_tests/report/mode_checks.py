"""Which mode the autopilot goes into, and how it ends: held against its modes over time."""

from __future__ import annotations

from collections.abc import Sequence

from gateway.plotting.clock import clock, lasting
from hil_tests.report.check import Check
from hil_tests.report.modes import ModeStretch, stretches
from hil_tests.report.outcome import Outcome
from hil_tests.report.windows import Window


def ends_in(wanted: Sequence[str], window: Window, outcome: Outcome) -> Check:
    """Whether one of these modes is there at the end, and came no sooner than it may."""
    not_before = window.first_s > window.after_s
    expected = f"mode {' or '.join(wanted)} at the end"
    expected += f", not before {clock(window.first_s)}" if not_before else ""
    history = stretches(outcome)
    if not history:
        return Check(expected, False, "the autopilot's mode was never heard")
    last = history[-1]
    if not last.is_one_of(wanted):
        return Check(expected, False, f"{last.words} since {clock(last.from_s)}")
    entered_s = _entered_s(history, wanted)
    early = not_before and entered_s < window.first_s
    seen = f"{last.words} since {clock(entered_s)}{', too early' if early else ''}"
    return Check(expected, not early, seen, entered_s)


def _entered_s(history: Sequence[ModeStretch], wanted: Sequence[str]) -> float:
    """Since when it has been one of these without a break, to the end."""
    since_s = history[-1].from_s
    for stretch in reversed(history):
        if not stretch.is_one_of(wanted):
            break
        since_s = stretch.from_s
    return since_s


def goes_into(wanted: Sequence[str], window: Window, outcome: Outcome) -> Check:
    """Whether one of these modes is there within a window; it may have been before."""
    expected = f"mode {' or '.join(wanted)} {window.words}"
    counted = [one for one in stretches(outcome) if one.to_s > window.after_s]
    first = next((one for one in counted if one.is_one_of(wanted)), None)
    if first is None:
        told = " > ".join(one.words for one in counted) or "never heard"
        return Check(expected, False, f"never: {told}")
    since_s = max(first.from_s, window.after_s)
    wrong = window.verdict(since_s)
    waited = f"after {lasting(since_s - window.after_s)}" if first.from_s >= window.after_s else "already"
    return Check(expected, not wrong, f"{waited}{wrong}: {first.words}", since_s)
