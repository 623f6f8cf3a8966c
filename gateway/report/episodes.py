"""How long each subject was at which level: stretches between one finding and the next."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from detectors.verdict import Level
from gateway.findings import Finding
from gateway.report.dive import Dive
from gateway.report.subjects import by_subject


@dataclass(frozen=True, slots=True)
class Episode:
    """A subject stays at a level.

    Attributes:
        subject, detector: as in the finding that it begins with.
        level: of it.
        from_s, to_s: seconds since the beginning of the dive; it ends with the next finding, or with the dive.
        text, score: of the finding that it begins with.
    """

    subject: str
    detector: str
    level: Level
    from_s: float
    to_s: float
    text: str
    score: float

    @property
    def duration_s(self) -> float:
        """How long it lasted."""
        return self.to_s - self.from_s


def episodes(dive: Dive) -> Mapping[str, tuple[Episode, ...]]:
    """Of each subject in order of time; the worst subject comes first."""
    return {subject: tuple(_of(dive, found)) for subject, found in by_subject(dive.findings).items()}


def troubles(dive: Dive, *subjects: str) -> tuple[Episode, ...]:
    """Episodes of these subjects at which something was wrong or seemed to be, in order of time."""
    several = episodes(dive)
    bad = (one for subject in subjects for one in several.get(subject, ()) if one.level >= Level.SUSPECT)
    return tuple(sorted(bad, key=lambda one: one.from_s))


def _of(dive: Dive, found: Sequence[Finding]) -> Iterator[Episode]:
    times_s = [max(one.time_s - dive.begin_s, 0.0) for one in found]
    times_s.append(max(dive.end_s - dive.begin_s, times_s[-1]))
    for one, (from_s, to_s) in zip(found, pairwise(times_s), strict=True):
        yield Episode(one.subject, one.detector, one.level, from_s, to_s, one.text, one.score)
