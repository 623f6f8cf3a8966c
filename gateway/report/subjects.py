"""What findings are about: the subjects of a dive, the worst first, and those that were well all along."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence

from detectors.verdict import Level
from gateway.findings import Finding
from gateway.outlet import NOTES

# Of these, one also wants to see that they were well; of links and signals, only if they were not.
DETECTORS = ("thruster", "speed", "navigation")


def by_subject(findings: Iterable[Finding]) -> Mapping[str, Sequence[Finding]]:
    """Findings of detectors and watches by subject, each in order of time; the worst subjects come first."""
    found: dict[str, list[Finding]] = {}
    for one in sorted(findings, key=lambda one: one.time_s):
        if one.detector not in NOTES:
            found.setdefault(one.subject, []).append(one)
    return dict(sorted(found.items(), key=_rank))


def calm_subjects(findings: Iterable[Finding]) -> frozenset[str]:
    """Those that were never worse than NORMAL."""
    return frozenset(subject for subject, found in by_subject(findings).items() if _worst(found) <= Level.NORMAL)


def _worst(found: Sequence[Finding]) -> Level:
    return max(one.level for one in found)


def _rank(entry: tuple[str, Sequence[Finding]]) -> tuple[int, int, str, int]:
    """Worse ones first, then detectors before watches, then by name, "thruster 2" before "thruster 10"."""
    subject, found = entry
    detector = found[0].detector
    place = DETECTORS.index(detector) if detector in DETECTORS else len(DETECTORS)
    number = re.search(r"\d+", subject)
    return -max(_worst(found), Level.NORMAL), place, re.sub(r"\d+", "", subject), int(number[0]) if number else 0
