"""What can be asked of an autopilot, in PX4's order and words, and what each action needs to be of any use.

none < warn < manual < hold < return, surface < land < disarm < terminate: the worst wins (PX4, `Safety` guide;
`manual` stands where PX4 has its fallbacks to manual modes, `surface` is ArduSub's way home).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum


class Action(StrEnum):
    """What the onset of a FAULT may ask for."""

    NONE = "none"  # findings only
    WARN = "warn"  # and texts for the pilot
    MANUAL = "manual"  # give back control: no controller that relies on what is faulty
    HOLD = "hold"  # hold the depth
    RETURN = "return"
    SURFACE = "surface"
    LAND = "land"
    DISARM = "disarm"
    TERMINATE = "terminate"


RANK: Mapping[Action, int] = {
    Action.NONE: 0,
    Action.WARN: 1,
    Action.MANUAL: 2,
    Action.HOLD: 3,
    Action.RETURN: 4,
    Action.SURFACE: 4,
    Action.LAND: 5,
    Action.DISARM: 6,
    Action.TERMINATE: 7,
}
# Above this a forged frame must not be able to get: two independent kinds of evidence.
ONE_EVIDENCE_MAX = RANK[Action.HOLD]


class Need(StrEnum):
    """What an action relies on, in the words that say that it is not there."""

    VERTICAL_THRUST = "no vertical thrust"
    DEPTH = "depth not known"
    POSITION = "position not known"
    EVIDENCE = "one kind of evidence only"


NEEDS: Mapping[Action, frozenset[Need]] = {
    Action.NONE: frozenset(),
    Action.WARN: frozenset(),
    Action.MANUAL: frozenset(),
    Action.HOLD: frozenset({Need.VERTICAL_THRUST, Need.DEPTH}),
    Action.RETURN: frozenset({Need.VERTICAL_THRUST, Need.DEPTH, Need.POSITION, Need.EVIDENCE}),
    Action.SURFACE: frozenset({Need.VERTICAL_THRUST, Need.DEPTH, Need.EVIDENCE}),
    Action.LAND: frozenset({Need.VERTICAL_THRUST, Need.DEPTH, Need.EVIDENCE}),
    Action.DISARM: frozenset({Need.EVIDENCE}),
    Action.TERMINATE: frozenset({Need.EVIDENCE}),
}


def sends(action: Action) -> bool:
    """Whether it asks anything of the autopilot."""
    return RANK[action] > RANK[Action.WARN]


@dataclass(frozen=True, slots=True)
class Plan:
    """What is to be asked now: the first of these actions, and where that does not come about, the next.

    Attributes:
        label: of what it is for, e.g. "T3".
        actions: in the order in which they are tried, none of them pointless; each asks something.
        left_out: why actions of higher rank than the first are not among them, "" = none was left out.
        position_trusted: False where a mode that holds a position is no better than one that holds the depth.
    """

    label: str
    actions: tuple[Action, ...]
    left_out: str = ""
    position_trusted: bool = True

    @property
    def rank(self) -> int:
        """Rank of the first action."""
        return RANK[self.actions[0]]


def possible(ladder: Sequence[Action], missing: Collection[Need]) -> tuple[tuple[Action, ...], str]:
    """The actions of a ladder that are of use while something is missing, and why the others are not ("" = none)."""
    useful = tuple(action for action in ladder if sends(action) and not NEEDS[action] & set(missing))
    why = (
        f"{action.capitalize()} not asked: {next(need for need in Need if need in NEEDS[action] & set(missing))}"
        for action in ladder
        if NEEDS[action] & set(missing)
    )
    return useful, next(why, "")
