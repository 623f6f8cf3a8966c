"""The order in which subjects are shown, and which of them need not be."""

from __future__ import annotations

from detectors.verdict import Level
from gateway.report.subjects import by_subject, calm_subjects
from hil_tests.report.tests.plays import finding, play


def test_the_worst_first_then_detectors_in_their_order() -> None:
    found = [
        finding(3.0, Level.NORMAL, "link can0", detector="link"),
        finding(3.0, Level.NORMAL, "thruster 10"),
        finding(3.0, Level.UNKNOWN, "thruster 2"),
        finding(3.0, Level.NORMAL, "dvl", detector="navigation"),
        finding(3.0, Level.NORMAL, "vehicle", detector="speed"),
        finding(4.0, Level.SUSPECT, "vehicle", "Hold asked for T3", detector="failsafe"),
        finding(5.0, Level.SUSPECT, "link mavlink", detector="link"),
        finding(9.0, Level.NORMAL, "thruster 3"),
        finding(6.0, Level.FAULT, "thruster 3"),
    ]
    outcome = play(findings=found)
    subjects = by_subject(outcome.findings)
    assert list(subjects) == [
        "thruster 3",
        "link mavlink",
        "thruster 2",
        "thruster 10",
        "vehicle",
        "dvl",
        "link can0",
    ]
    assert [one.level for one in subjects["thruster 3"]] == [Level.FAULT, Level.NORMAL]
    assert [one.level for one in subjects["vehicle"]] == [Level.NORMAL]
    assert calm_subjects(outcome.findings) == {"link can0", "thruster 2", "thruster 10", "vehicle", "dvl"}
