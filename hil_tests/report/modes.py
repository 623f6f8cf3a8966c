"""The autopilot's mode over time, and what a scenario expects of it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

from hil_tests.report.outcome import ModeChange, Outcome
from hil_tests.report.windows import since_start_s


@dataclass(frozen=True, slots=True)
class ModeStretch:
    """A mode for as long as it lasted, in seconds since the start."""

    mode: str
    armed: bool
    from_s: float
    to_s: float

    @property
    def words(self) -> str:
        """For people: "ALT_HOLD", or "ALT_HOLD, disarmed"."""
        return self.mode if self.armed else f"{self.mode}, disarmed"

    def is_one_of(self, wanted: Sequence[str]) -> bool:
        """Whether one of these words is its mode's, or says ARMED or DISARMED as it is; upper or lower case."""
        own = {_plain(self.mode), "ARMED" if self.armed else "DISARMED"}
        return any(_plain(word) in own for word in wanted)


def stretches(outcome: Outcome) -> list[ModeStretch]:
    """One after the other, to the end of the play."""
    return list(_stretches(outcome))


def _stretches(outcome: Outcome) -> Iterator[ModeStretch]:
    last = ModeChange(outcome.end_s, "", False)
    for change, following in pairwise([*outcome.modes, last]):
        from_s, to_s = (since_start_s(outcome, one.time_s) for one in (change, following))
        yield ModeStretch(change.mode, change.armed, from_s, max(to_s, from_s))


def _plain(word: str) -> str:
    return word.strip().upper().replace(" ", "_")
