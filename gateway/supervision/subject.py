"""One subject of the supervisor: its rules, its level, and what was said of it."""

from __future__ import annotations

import math
from dataclasses import dataclass

from detectors.verdict import Level
from gateway.observation import Observation
from gateway.supervision.actions import Action
from gateway.supervision.debounce import Debounce, DebounceTimes
from gateway.supervision.levels import Event


@dataclass(frozen=True, slots=True)
class Policy:
    """How the subjects of one detector are treated.

    Attributes:
        times: debounce.
        cleared_by: which of GOOD (recovered) and DISARMED clear a FAULT; an operator's word always does. A suspicion
            is over when NORMAL lasted, in any case.
        ladder: what the onset of a FAULT asks for, the next where the one before does not come about. "warn" is texts
            for the pilot, and that is all; "none" is findings only.
        several: the same, while two or more subjects of this detector are in FAULT; empty: as for one.

    Raises:
        ValueError: an unknown action, an empty ladder, or another event in `cleared_by`.
    """

    times: DebounceTimes
    cleared_by: frozenset[Event] = frozenset({Event.GOOD})
    ladder: tuple[Action, ...] = (Action.WARN,)
    several: tuple[Action, ...] = ()

    def __post_init__(self) -> None:
        for action in (*self.ladder, *self.several):
            if not isinstance(action, Action):
                raise ValueError(f"action = {action!r}: want one of {', '.join(Action)}")
        if not self.ladder:
            raise ValueError("ladder = (): want at least one action, e.g. warn")
        if not self.cleared_by <= {Event.GOOD, Event.DISARMED}:
            raise ValueError(
                f"cleared_by = {sorted(self.cleared_by)}: want {Event.GOOD!s}, {Event.DISARMED!s} or both"
            )

    @property
    def silent(self) -> bool:
        """True where the pilot is not told."""
        return self.ladder == (Action.NONE,)


@dataclass(slots=True)
class Subject:
    """State of one subject.

    Attributes:
        policy: its rules.
        debounce: of its levels.
        seen: newest observation; of what is latched, the last evidence of it.
        level: as the pilot was told.
        said_s: when a text of it was due last.
        acknowledged: the operator has seen it: it is not repeated.
        settled: nothing (more) is asked of the autopilot because of it.
        muted_until_s: no texts before.
    """

    policy: Policy
    debounce: Debounce
    seen: Observation
    level: Level = Level.UNKNOWN
    said_s: float = 0.0
    acknowledged: bool = False
    settled: bool = False
    muted_until_s: float = -math.inf

    def move(self, level: Level) -> None:
        """Takes a new level: what was settled or acknowledged was about the old one."""
        if level > self.level:
            self.acknowledged = self.settled = False
        self.level = level

    def clears(self, event: Event) -> bool:
        """Whether the policy has nothing against what an event leads to."""
        if event is Event.GOOD and self.level is not Level.FAULT:
            return True
        return event not in (Event.GOOD, Event.DISARMED) or event in self.policy.cleared_by

    def steady(self, time_s: float, level: Level) -> bool:
        """True where an observation of this level from now on would change nothing but `seen`."""
        calm = level is self.level and level < Level.SUSPECT and not self.seen.relies_on
        return calm and self.debounce.steady(time_s, level)

    def silenced(self, time_s: float) -> bool:
        """True where texts of it do not go out."""
        return self.policy.silent or time_s < self.muted_until_s


@dataclass(frozen=True, slots=True)
class Remembered:
    """What of a subject survives a restart of the program."""

    level: Level
    seen: Observation
    acknowledged: bool
    settled: bool
    muted_until_s: float
    said_s: float
