"""What expectations and prohibitions are of: findings, texts, commands; how one is known, and what is close to it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from difflib import SequenceMatcher
from typing import Protocol, TypeVar

from detectors.verdict import Level
from gateway.findings import Finding
from gateway.outlet import NOTES
from gateway.severity import Severity
from hil_tests.report.commands import ANY, acts, told, word_of
from hil_tests.report.outcome import Outcome
from hil_tests.rig.notes import ReceivedCommand, ReceivedText
from hil_tests.scenario.expectations import FindingPattern
from hil_tests.scenario.finding_subjects import subject_matches

SIMILAR = 0.5  # ratio of equal letters from which on a text passes for what was meant


class Timed(Protocol):
    """Something that came at a time."""

    @property
    def time_s(self) -> float: ...


Item = TypeVar("Item", bound=Timed)


class Wanted(Protocol[Item]):
    """A kind of thing that can come of a play."""

    @property
    def words(self) -> str:
        """What it is, e.g. "FAULT of thruster 3"."""

    def candidates(self, outcome: Outcome) -> Sequence[Item]:
        """All that it could be."""

    def fits(self, item: Item) -> bool:
        """Whether it is this."""

    def tell(self, item: Item) -> str:
        """It in words."""

    def closest(self, items: Sequence[Item]) -> str:
        """In words, which of those that do not fit came closest; why there is none, if so."""


@dataclass(frozen=True, slots=True)
class WantedFinding:
    """See `FindingPattern`. What the failsafe and the operator note is of no level of its own."""

    pattern: FindingPattern

    @property
    def words(self) -> str:
        """As in `Wanted`."""
        at_least = "SUSPECT or FAULT" if self.pattern.at_least == "SUSPECT" else self.pattern.at_least
        text = f' that says "{self.pattern.text}"' if self.pattern.text else ""
        return f"{self.pattern.level or at_least or 'finding'} of {self._subject}{text}"

    def candidates(self, outcome: Outcome) -> Sequence[Finding]:
        """As in `Wanted`."""
        judged = self.pattern.level is not None or self.pattern.at_least is not None
        return [one for one in outcome.findings if not (judged and one.detector in NOTES)]

    def fits(self, item: Finding) -> bool:
        """As in `Wanted`."""
        return self._of_subject(item) and self._of_level(item) and self._says(item)

    def tell(self, item: Finding) -> str:
        """As in `Wanted`."""
        return f"{item.level.name} of {item.subject}: {item.text}"

    def closest(self, items: Sequence[Finding]) -> str:
        """As in `Wanted`: its subject at another level, or worse ones of other subjects."""
        own = [one for one in items if self._of_subject(one)]
        if worded := [one for one in own if self._of_level(one)]:
            return f"but in other words: {self.tell(worded[0])}"
        if own:
            return f"at most {self.tell(max(own, key=lambda one: one.level))}"
        others = [one for one in items if one.level >= Level.SUSPECT and one.detector not in NOTES]
        nothing = f"nothing of {self._subject} was found"
        return f"{nothing}, but {self.tell(max(others, key=lambda one: one.level))}" if others else nothing

    @property
    def _subject(self) -> str:
        subject = "anything" if self.pattern.subject == "*" else self.pattern.subject
        return f"{subject} besides {self.pattern.besides}" if self.pattern.besides else subject

    def _of_subject(self, item: Finding) -> bool:
        besides = self.pattern.besides
        return subject_matches(self.pattern.subject, item.subject) and not (
            besides and subject_matches(besides, item.subject)
        )

    def _of_level(self, item: Finding) -> bool:
        if self.pattern.level is not None and item.level is not Level[self.pattern.level]:
            return False
        return self.pattern.at_least is None or item.level >= Level[self.pattern.at_least]

    def _says(self, item: Finding) -> bool:
        return self.pattern.text is None or re.search(self.pattern.text, item.text) is not None


@dataclass(frozen=True, slots=True)
class WantedText:
    """A STATUSTEXT.

    Attributes:
        pattern: a regular expression that is found in it.
        severity: its own, or one more urgent; None: any.
    """

    pattern: str
    severity: Severity | None = None

    @property
    def words(self) -> str:
        """As in `Wanted`."""
        urgency = f"{self.severity.name} " if self.severity is not None else ""
        return f'{urgency}STATUSTEXT "{self.pattern}"'

    def candidates(self, outcome: Outcome) -> Sequence[ReceivedText]:
        """As in `Wanted`."""
        return outcome.texts

    def fits(self, item: ReceivedText) -> bool:
        """As in `Wanted`."""
        urgent = self.severity is None or item.severity <= self.severity
        return urgent and self._says(item)

    def tell(self, item: ReceivedText) -> str:
        """As in `Wanted`."""
        return f'{severity_name(item.severity)} "{item.text}"'

    def closest(self, items: Sequence[ReceivedText]) -> str:
        """As in `Wanted`: what says it less urgently, or is of similar letters."""
        if less_urgent := [one for one in items if self._says(one)]:
            return f"but only as {self.tell(min(less_urgent, key=lambda one: one.severity))}"
        if not items:
            return "no text came"
        nearest = max(items, key=self._likeness)
        if self._likeness(nearest) >= SIMILAR:
            return f"closest: {self.tell(nearest)}"
        return f"none of the {len(items)} texts is like it, the first: {self.tell(items[0])}"

    def _says(self, item: ReceivedText) -> bool:
        return re.search(self.pattern, item.text) is not None

    def _likeness(self, item: ReceivedText) -> float:
        wanted = re.sub(r"[^\w ]+", "", self.pattern).lower()
        matcher = SequenceMatcher(None, wanted, item.text.lower(), autojunk=False)
        return sum(block.size for block in matcher.get_matching_blocks()) / max(len(wanted), 1)


@dataclass(frozen=True, slots=True)
class WantedCommand:
    """A command to the autopilot, by its word; "*": any that acts on the vehicle."""

    word: str

    @property
    def words(self) -> str:
        """As in `Wanted`."""
        return "command that acts on the vehicle" if self.word == ANY else f'command "{self.word}"'

    def candidates(self, outcome: Outcome) -> Sequence[ReceivedCommand]:
        """As in `Wanted`."""
        return outcome.commands

    def fits(self, item: ReceivedCommand) -> bool:
        """As in `Wanted`."""
        return acts(item) if self.word == ANY else word_of(item) == self.word

    def tell(self, item: ReceivedCommand) -> str:
        """As in `Wanted`."""
        return told(item)

    def closest(self, items: Sequence[ReceivedCommand]) -> str:
        """As in `Wanted`."""
        others = [self.tell(one) for one in items if acts(one)]
        return f"but {'; '.join(others[:3])}" if others else "no command came"


def severity_name(severity: int) -> str:
    """As MAVLink has it; of a number that it has not, the number."""
    return Severity(severity).name if severity in set(Severity) else f"severity {severity}"
