"""What two or more replays of one dive have found, side by side: only here, only there, sooner, later."""

from __future__ import annotations

from bisect import bisect_left
from collections import defaultdict
from collections.abc import Callable, Hashable, Iterator, Sequence
from dataclasses import dataclass, replace

from gateway.findings import Finding
from gateway.outlet import NOTES

# findings of one subject further apart than this are of different happenings
WITHIN_S = 30.0
# sooner or later by less is not worth a word
SHIFT_MIN_S = 0.5


@dataclass(frozen=True, slots=True)
class Pair:
    """The same finding, in one replay and in another; None: it is not there."""

    here: Finding | None
    there: Finding | None

    @property
    def time_s(self) -> float:
        """When it was found, here if it was."""
        return self._either.time_s

    @property
    def shift_s(self) -> float:
        """How much later it was found there; 0 where it was not found in both."""
        return 0.0 if self.here is None or self.there is None else self.there.time_s - self.here.time_s

    @property
    def alike(self) -> bool:
        """Whether both say the same, and when."""
        if self.here is None or self.there is None:
            return False
        return self.here.level is self.there.level and abs(self.shift_s) < SHIFT_MIN_S

    def line(self, other: str) -> str:
        """What differs, in words. `other`: what the other replay is called."""
        found, text = self._either, _named(self._either)
        if self.there is None:
            return f"{text}: not with {other} ({found.text})"
        if self.here is None:
            return f"{text}: only with {other} ({found.text})"
        word = "later" if self.shift_s > 0.0 else "sooner"
        when = f"{abs(self.shift_s):.1f} s {word} " if abs(self.shift_s) >= SHIFT_MIN_S else ""
        what = "" if self.here.level is self.there.level else f"{self.there.level.name} "
        return f"{text}: {what}{when}with {other} ({found.text})"

    @property
    def _either(self) -> Finding:
        found = self.here or self.there
        if found is None:
            raise ValueError("a pair of nothing: want a finding here, or there")
        return found


def compared(here: Sequence[Finding], there: Sequence[Finding], within_s: float = WITHIN_S) -> list[Pair]:
    """Findings of two replays in pairs, in the order of time: of one subject and level, the nearest in time first.

    What is left of a subject is a pair although its level is another.
    """
    pairs, left_here, left_there = _paired(here, there, within_s, _subject_and_level)
    others, only_here, only_there = _paired(left_here, left_there, within_s, _subject)
    pairs += others
    pairs += [Pair(one, None) for one in only_here]
    pairs += [Pair(None, one) for one in only_there]
    return sorted(pairs, key=lambda pair: pair.time_s)


@dataclass(frozen=True, slots=True)
class Agreement:
    """How many of several replays have found it.

    Attributes:
        finding: of the first that has.
        count: how many.
        first_s, last_s: when, the soonest and the latest of them.
    """

    finding: Finding
    count: int
    first_s: float
    last_s: float

    def line(self, of: int, begin_s: float, clock: Callable[[float], str]) -> str:
        """In words.

        Args:
            of: how many replays there were.
            begin_s: of the dive.
            clock: a time since then in words.
        """
        first, last = clock(self.first_s - begin_s), clock(self.last_s - begin_s)
        when = first if first == last else f"{first} to {last}"
        text = f" ({self.finding.text})" if self.finding.detector in NOTES else ""
        return f"{_named(self.finding)}{text} at {when} in {self.count} of {of} phases"


def agreements(replays: Sequence[Sequence[Finding]], within_s: float = WITHIN_S) -> list[Agreement]:
    """What several replays have found, each thing once, in the order of time."""
    known: list[Agreement] = []
    for found in replays:
        pairs, _, new = _paired([one.finding for one in known], found, within_s, _subject_and_level)
        again = {id(pair.here): pair.there.time_s for pair in pairs if pair.there is not None}
        known = [_again(one, again.get(id(one.finding))) for one in known]
        known += [Agreement(one, 1, one.time_s, one.time_s) for one in new]
    return sorted(known, key=lambda one: one.first_s)


def _again(known: Agreement, time_s: float | None) -> Agreement:
    if time_s is None:
        return known
    return replace(known, count=known.count + 1, first_s=min(known.first_s, time_s), last_s=max(known.last_s, time_s))


def _named(finding: Finding) -> str:
    """A note has no level: it says what was asked or done."""
    return finding.detector if finding.detector in NOTES else f"{finding.subject} {finding.level.name}"


def _subject(finding: Finding) -> Hashable:
    """A note is about what was asked or said, whatever its level."""
    return finding.detector, finding.subject, finding.text if finding.detector in NOTES else ""


def _subject_and_level(finding: Finding) -> Hashable:
    return _subject(finding), finding.level


def _paired(
    here: Sequence[Finding], there: Sequence[Finding], within_s: float, key: Callable[[Finding], Hashable]
) -> tuple[list[Pair], list[Finding], list[Finding]]:
    """Pairs, and what is left of both."""
    candidates = sorted(_candidates(here, there, within_s, key))
    free_here, free_there = dict(enumerate(here)), dict(enumerate(there))
    pairs = [
        Pair(free_here.pop(one), free_there.pop(other))
        for _, one, other in candidates
        if one in free_here and other in free_there
    ]
    return pairs, list(free_here.values()), list(free_there.values())


def _candidates(
    here: Sequence[Finding], there: Sequence[Finding], within_s: float, key: Callable[[Finding], Hashable]
) -> Iterator[tuple[float, int, int]]:
    """How far apart in time, and the places of both."""
    places: defaultdict[Hashable, list[tuple[float, int]]] = defaultdict(list)
    for place, one in enumerate(there):
        places[key(one)].append((one.time_s, place))
    for several in places.values():
        several.sort()
    for place, one in enumerate(here):
        several = places.get(key(one), [])
        for time_s, other in several[bisect_left(several, (one.time_s - within_s, -1)) :]:
            if time_s > one.time_s + within_s:
                break
            yield abs(time_s - one.time_s), place, other
