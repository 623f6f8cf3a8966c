"""Findings of two or more replays, side by side."""

from __future__ import annotations

from dataclasses import replace

import pytest

from detectors.verdict import Level
from gateway.findings import Finding
from gateway.replay.comparison import Pair, agreements, compared
from gateway.severity import Severity


def finding(time_s: float, subject: str = "thruster 3", level: Level = Level.FAULT, text: str = "T3 slow") -> Finding:
    return Finding(time_s, subject.partition(" ")[0], subject, level, 1.0, text, Severity.CRITICAL)


def clock(seconds: float) -> str:
    return f"{seconds:.0f}s"


def test_the_same_is_alike():
    found = [finding(1.0), finding(2.0, level=Level.NORMAL), finding(3.0)]
    pairs = compared(found, found)
    assert all(pair.alike for pair in pairs)
    assert [(pair.here, pair.there) for pair in pairs] == [(one, one) for one in found]


@pytest.mark.parametrize(
    ("here", "there", "said"),
    [
        ([finding(5.0)], [], "thruster 3 FAULT: not with b.toml (T3 slow)"),
        ([], [finding(5.0)], "thruster 3 FAULT: only with b.toml (T3 slow)"),
        ([finding(5.0)], [finding(8.2)], "thruster 3 FAULT: 3.2 s later with b.toml (T3 slow)"),
        ([finding(8.2)], [finding(5.0)], "thruster 3 FAULT: 3.2 s sooner with b.toml (T3 slow)"),
        ([finding(5.0)], [finding(5.1, level=Level.SUSPECT)], "thruster 3 FAULT: SUSPECT with b.toml (T3 slow)"),
    ],
)
def test_what_differs_is_said(here, there, said):
    (pair,) = compared(here, there)
    assert not pair.alike
    assert pair.line("b.toml") == said


HOLD = Finding(5.0, "failsafe", "vehicle", Level.SUSPECT, 1.0, "Hold done for T3", Severity.CRITICAL)


def test_what_was_asked_of_the_autopilot_has_no_level():
    (pair,) = compared([HOLD], [])
    assert pair.line("b.toml") == "failsafe: not with b.toml (Hold done for T3)"
    (one,) = agreements([[HOLD], []])
    assert one.line(2, 0.0, clock) == "failsafe (Hold done for T3) at 5s in 1 of 2 phases"


def test_the_nearest_in_time_go_together():
    pairs = compared([finding(10.0), finding(20.0)], [finding(19.0), finding(11.0)])
    assert [(pair.time_s, pair.shift_s) for pair in pairs] == [(10.0, 1.0), (20.0, -1.0)]


def test_what_is_too_far_apart_is_something_else():
    pairs = compared([finding(0.0)], [finding(31.0)])
    assert [(pair.here is None, pair.there is None) for pair in pairs] == [(False, True), (True, False)]


def test_the_same_level_goes_first():
    """Else a suspicion a moment before would be taken for the fault."""
    here, there = [finding(5.0)], [finding(4.9, level=Level.SUSPECT), finding(6.0)]
    pairs = compared(here, there)
    assert [(pair.here is None, pair.shift_s) for pair in pairs] == [(True, 0.0), (False, 1.0)]


def test_notes_are_told_apart_by_their_words():
    note = replace(finding(5.0, "all", Level.UNKNOWN), detector="operator")
    pairs = compared([replace(note, text="All accepted")], [replace(note, text="All muted")])
    assert not any(pair.alike for pair in pairs)


def test_a_pair_of_nothing_is_refused():
    with pytest.raises(ValueError, match="pair of nothing"):
        _ = Pair(None, None).time_s


def test_what_some_phases_find_is_told_with_their_number():
    often, once = finding(62.0), finding(90.0, "thruster 1")
    replays = [[often], [replace(often, time_s=62.4)], [replace(often, time_s=61.0), once]]
    told = agreements(replays)
    assert [(one.finding.subject, one.count) for one in told] == [("thruster 3", 3), ("thruster 1", 1)]
    assert told[0].line(3, 0.0, clock) == "thruster 3 FAULT at 61s to 62s in 3 of 3 phases"
    assert told[1].line(3, 30.0, clock) == "thruster 1 FAULT at 60s in 1 of 3 phases"


def test_one_phase_says_a_thing_twice_and_it_is_counted_as_two():
    told = agreements([[finding(1.0), finding(2.0)], [finding(1.0)]])
    assert sorted(one.count for one in told) == [1, 2]
