"""What a scenario expects and forbids, held against what came of playing it.

Times are compared to the microsecond, as findings have them. All bounds belong to their window, but for a
prohibition's `before_s`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import inf, isfinite

from gateway.plotting.clock import clock, lasting
from gateway.severity import Severity
from hil_tests.report.check import Check
from hil_tests.report.mode_checks import ends_in, goes_into
from hil_tests.report.outcome import Outcome
from hil_tests.report.wanted import Item, Wanted, WantedCommand, WantedFinding, WantedText
from hil_tests.report.windows import Window, since_start_s
from hil_tests.scenario.document import Scenario
from hil_tests.scenario.expectations import Expectation, Prohibition


def checks(outcome: Outcome) -> list[Check]:
    """Every expectation and prohibition, in the order of the file; a play that came to no end fails one more."""
    return list(_checks(outcome))


def passed(outcome: Outcome) -> bool:
    """Whether it came to its end, all came about that was expected, and nothing that was forbidden."""
    return all(one.passed for one in _checks(outcome))


def found_after_s(outcome: Outcome) -> float | None:
    """How long after it was to be looked for the first expected finding came, or if none is expected, the first text.

    None: neither was expected, or it did not come as it should.
    """
    scenario = outcome.scenario
    told = [one for one in scenario.expect if one.finding or one.statustext]
    first = next((one for one in told if one.finding), next(iter(told), None))
    if first is None:
        return None
    check = _expected(first, outcome)
    return None if check.time_s is None or not check.passed else check.time_s - Window.of(first, scenario).after_s


def _checks(outcome: Outcome) -> Iterator[Check]:
    if outcome.broken is not None:
        yield Check("the play comes to its end", False, outcome.broken)
    for expectation in outcome.scenario.expect:
        yield _expected(expectation, outcome)
    for prohibition in outcome.scenario.never:
        yield _forbidden(prohibition, outcome)


def _expected(expectation: Expectation, outcome: Outcome) -> Check:
    window = Window.of(expectation, outcome.scenario)
    if expectation.finding is not None:
        return _came(WantedFinding(expectation.finding), window, outcome)
    if expectation.statustext is not None:
        return _came(WantedText(expectation.statustext, _severity(expectation)), window, outcome)
    if expectation.command is not None:
        return _came(WantedCommand(expectation.command), window, outcome)
    modes = expectation.mode or ()
    wanted = (modes,) if isinstance(modes, str) else modes
    if expectation.within_s is None:
        return ends_in(wanted, window, outcome)
    return goes_into(wanted, window, outcome)


def _severity(expectation: Expectation) -> Severity | None:
    return None if expectation.severity is None else Severity[expectation.severity]


def _came(wanted: Wanted[Item], window: Window, outcome: Outcome) -> Check:
    expected = f"{wanted.words} {window.words}"
    items = _in_time(wanted.candidates(outcome))
    counted = [one for one in items if since_start_s(outcome, one.time_s) >= window.after_s]
    first = next((one for one in counted if wanted.fits(one)), None)
    if first is None:
        return Check(expected, False, _missed(wanted, window, outcome, items, counted))
    since_s = since_start_s(outcome, first.time_s)
    wrong = window.verdict(since_s)
    seen = f"after {lasting(since_s - window.after_s)}{wrong}: {wanted.tell(first)}"
    return Check(expected, not wrong, seen, since_s)


def _in_time(items: Sequence[Item]) -> list[Item]:
    """By their own times: what follows from a sample may be told after what a clock's tick brought."""
    return sorted(items, key=lambda one: one.time_s)


def _missed(
    wanted: Wanted[Item], window: Window, outcome: Outcome, items: Sequence[Item], counted: Sequence[Item]
) -> str:
    """What came instead: the same before it counted, or something like it since."""
    before = next((one for one in reversed(items) if wanted.fits(one)), None)
    if before is None:
        return f"never: {wanted.closest(counted)}"
    since_s = since_start_s(outcome, before.time_s)
    early = lasting(window.after_s - since_s)
    return f"not then: last at {clock(since_s)}, {early} before: {wanted.tell(before)}"


def _forbidden(prohibition: Prohibition, outcome: Outcome) -> Check:
    if prohibition.finding is not None:
        return _stayed_away(WantedFinding(prohibition.finding), prohibition, outcome)
    if prohibition.statustext is not None:
        return _stayed_away(WantedText(prohibition.statustext), prohibition, outcome)
    return _stayed_away(WantedCommand(prohibition.command or ""), prohibition, outcome)


def _stayed_away(wanted: Wanted[Item], prohibition: Prohibition, outcome: Outcome) -> Check:
    before_s = _before_s(prohibition, outcome.scenario)
    expected = f"no {wanted.words} {_span(prohibition.from_s, before_s)}"
    found = [
        (since_start_s(outcome, one.time_s), one) for one in _in_time(wanted.candidates(outcome)) if wanted.fits(one)
    ]
    wrong = [(since_s, one) for since_s, one in found if prohibition.from_s <= since_s < before_s]
    if not wrong:
        return Check(expected, True, "none")
    since_s, first = wrong[0]
    more = f", and {len(wrong) - 1} more" if len(wrong) > 1 else ""
    return Check(expected, False, f"at {clock(since_s)}: {wanted.tell(first)}{more}", since_s)


def _before_s(prohibition: Prohibition, scenario: Scenario) -> float:
    """Where there is no fault, "before it" is to the end."""
    if prohibition.before_s == "fault":
        return scenario.first_fault_s if scenario.faults else inf
    return inf if prohibition.before_s is None else prohibition.before_s


def _span(from_s: float, before_s: float) -> str:
    if isfinite(before_s):
        return f"from {clock(from_s)} to {clock(before_s)}" if from_s else f"before {clock(before_s)}"
    return f"after {clock(from_s)}" if from_s else "at all"
