"""How long subjects were at which level."""

from __future__ import annotations

from detectors.verdict import Level
from gateway.report.episodes import episodes, troubles
from gateway.report.tests.made_dive import LENGTH_S, dive, finding

FOUND = (
    finding(5.0, Level.NORMAL, "thruster 1"),
    finding(10.0, Level.SUSPECT, "thruster 2", score=0.7),
    finding(12.0, Level.FAULT, "thruster 2", score=1.3),
    finding(12.5, Level.SUSPECT, "vehicle", "Hold asked for T2", "failsafe"),
    finding(20.0, Level.NORMAL, "thruster 2"),
    finding(30.0, Level.SUSPECT, "thruster 1"),
)


def test_an_episode_lasts_until_the_next_finding_of_its_subject_or_the_end() -> None:
    found = episodes(dive(findings=FOUND))
    assert list(found) == ["thruster 2", "thruster 1"]
    assert [(one.level, one.from_s, one.to_s) for one in found["thruster 2"]] == [
        (Level.SUSPECT, 10.0, 12.0),
        (Level.FAULT, 12.0, 20.0),
        (Level.NORMAL, 20.0, LENGTH_S),
    ]
    assert [one.duration_s for one in found["thruster 1"]] == [25.0, LENGTH_S - 30.0]
    assert found["thruster 2"][1].score == 1.3


def test_troubles_are_what_was_suspected_or_found() -> None:
    some = dive(findings=FOUND)
    assert [(one.subject, one.from_s) for one in troubles(some, "thruster 1", "thruster 2")] == [
        ("thruster 2", 10.0),
        ("thruster 2", 12.0),
        ("thruster 1", 30.0),
    ]
    assert troubles(some, "thruster 9") == ()


def test_findings_around_the_dive_are_within_it() -> None:
    found = episodes(dive(findings=(finding(-3.0, Level.NORMAL, "dvl"), finding(LENGTH_S + 1.0, Level.FAULT, "dvl"))))
    assert [(one.from_s, one.to_s) for one in found["dvl"]] == [(0.0, LENGTH_S + 1.0), (LENGTH_S + 1.0,) * 2]
