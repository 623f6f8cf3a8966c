"""How a fault leads to a request to the autopilot: states, what moves them, and what is done, in one table.

| state | meaning |
|---|---|
| IDLE | nothing is to be done |
| REFRAINED | something should be done, and cannot be asked (again) now |
| COUNTDOWN | announced; the pilot can prevent it by changing the mode, by disarming, or by acknowledging the fault |
| ASKED | the command is on its way |
| CONFIRMING | accepted; HEARTBEAT does not show it yet |
| STANDING | it came about |
| YIELDED | somebody else changed the mode: nothing more is asked before all is well or the vehicle was disarmed |
| SPENT | nothing of the plan came about; the pilot knows |

Walked by `gateway.supervision.intervention`, by the tests, and by the README's diagram.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum, StrEnum, auto


class State(StrEnum):
    """See the module's text."""

    IDLE = "idle"
    REFRAINED = "refrained"
    COUNTDOWN = "countdown"
    ASKED = "asked"
    CONFIRMING = "confirming"
    STANDING = "standing"
    YIELDED = "yielded"
    SPENT = "spent"


class Happening(StrEnum):
    """What moves the table, the weightiest first: of several that hold, the first that the state knows counts."""

    SHOWN = "HEARTBEAT shows it"
    DISARMED = "vehicle disarmed"
    TAKEN_OVER = "mode changed by another"
    ALL_WELL = "no fault lasts"
    UNWANTED = "nothing is wanted"
    ALREADY = "it is so already"
    BLOCKED = "cannot be asked now"
    WORSE = "more is wanted"
    USELESS = "of no use any more"
    OTHER = "something else is wanted"
    EXHAUSTED = "failed, and nothing is left"
    HARSHER = "failed, and what is next is harsher"
    FAILED = "refused, unanswered or not shown"
    ACCEPTED = "autopilot accepted"
    DUE = "delay is over, mode as before"
    WANTED = "wanted"


class Effect(Enum):
    """What a step does."""

    NOTHING = auto()
    ANNOUNCE = auto()
    CHANGE = auto()
    REFRAIN = auto()
    CANCEL = auto()
    RECALL = auto()
    ASK = auto()
    AWAIT = auto()
    FALL_BACK = auto()
    POSTPONE = auto()
    ADOPT = auto()
    GIVE_UP = auto()
    DONE = auto()
    YIELD = auto()
    END = auto()


@dataclass(frozen=True, slots=True)
class Step:
    """Where something leads, and what is done."""

    state: State
    effect: Effect = Effect.NOTHING


# What is not listed changes nothing.
TABLE: Mapping[tuple[State, Happening], Step] = {
    (State.IDLE, Happening.ALREADY): Step(State.STANDING, Effect.ADOPT),
    (State.IDLE, Happening.BLOCKED): Step(State.REFRAINED, Effect.REFRAIN),
    (State.IDLE, Happening.WANTED): Step(State.COUNTDOWN, Effect.ANNOUNCE),
    (State.REFRAINED, Happening.SHOWN): Step(State.STANDING, Effect.DONE),
    (State.REFRAINED, Happening.DISARMED): Step(State.IDLE, Effect.END),
    (State.REFRAINED, Happening.TAKEN_OVER): Step(State.YIELDED, Effect.YIELD),
    (State.REFRAINED, Happening.UNWANTED): Step(State.IDLE, Effect.END),
    (State.REFRAINED, Happening.ALREADY): Step(State.STANDING, Effect.ADOPT),
    (State.REFRAINED, Happening.WANTED): Step(State.COUNTDOWN, Effect.ANNOUNCE),
    (State.COUNTDOWN, Happening.SHOWN): Step(State.STANDING, Effect.DONE),
    (State.COUNTDOWN, Happening.DISARMED): Step(State.IDLE, Effect.CANCEL),
    (State.COUNTDOWN, Happening.TAKEN_OVER): Step(State.YIELDED, Effect.YIELD),
    (State.COUNTDOWN, Happening.UNWANTED): Step(State.IDLE, Effect.CANCEL),
    (State.COUNTDOWN, Happening.BLOCKED): Step(State.REFRAINED, Effect.REFRAIN),
    (State.COUNTDOWN, Happening.WORSE): Step(State.COUNTDOWN, Effect.ANNOUNCE),
    (State.COUNTDOWN, Happening.OTHER): Step(State.COUNTDOWN, Effect.CHANGE),
    (State.COUNTDOWN, Happening.DUE): Step(State.ASKED, Effect.ASK),
    (State.ASKED, Happening.SHOWN): Step(State.STANDING, Effect.DONE),
    (State.ASKED, Happening.DISARMED): Step(State.IDLE, Effect.END),
    (State.ASKED, Happening.TAKEN_OVER): Step(State.YIELDED, Effect.YIELD),
    (State.ASKED, Happening.UNWANTED): Step(State.IDLE, Effect.RECALL),
    (State.ASKED, Happening.BLOCKED): Step(State.REFRAINED, Effect.REFRAIN),
    (State.ASKED, Happening.USELESS): Step(State.COUNTDOWN, Effect.ANNOUNCE),
    (State.ASKED, Happening.EXHAUSTED): Step(State.SPENT, Effect.GIVE_UP),
    (State.ASKED, Happening.HARSHER): Step(State.COUNTDOWN, Effect.POSTPONE),
    (State.ASKED, Happening.FAILED): Step(State.ASKED, Effect.FALL_BACK),
    (State.ASKED, Happening.ACCEPTED): Step(State.CONFIRMING, Effect.AWAIT),
    (State.CONFIRMING, Happening.SHOWN): Step(State.STANDING, Effect.DONE),
    (State.CONFIRMING, Happening.DISARMED): Step(State.IDLE, Effect.END),
    (State.CONFIRMING, Happening.TAKEN_OVER): Step(State.YIELDED, Effect.YIELD),
    (State.CONFIRMING, Happening.BLOCKED): Step(State.REFRAINED, Effect.REFRAIN),
    (State.CONFIRMING, Happening.EXHAUSTED): Step(State.SPENT, Effect.GIVE_UP),
    (State.CONFIRMING, Happening.HARSHER): Step(State.COUNTDOWN, Effect.POSTPONE),
    (State.CONFIRMING, Happening.FAILED): Step(State.ASKED, Effect.FALL_BACK),
    (State.STANDING, Happening.DISARMED): Step(State.IDLE, Effect.END),
    (State.STANDING, Happening.TAKEN_OVER): Step(State.YIELDED, Effect.YIELD),
    (State.STANDING, Happening.UNWANTED): Step(State.IDLE, Effect.END),
    (State.STANDING, Happening.WORSE): Step(State.COUNTDOWN, Effect.ANNOUNCE),
    (State.STANDING, Happening.USELESS): Step(State.COUNTDOWN, Effect.ANNOUNCE),
    (State.YIELDED, Happening.DISARMED): Step(State.IDLE, Effect.END),
    (State.YIELDED, Happening.ALL_WELL): Step(State.IDLE, Effect.END),
    (State.SPENT, Happening.SHOWN): Step(State.STANDING, Effect.DONE),
    (State.SPENT, Happening.DISARMED): Step(State.IDLE, Effect.END),
    (State.SPENT, Happening.TAKEN_OVER): Step(State.YIELDED, Effect.YIELD),
    (State.SPENT, Happening.UNWANTED): Step(State.IDLE, Effect.END),
    (State.SPENT, Happening.WORSE): Step(State.COUNTDOWN, Effect.ANNOUNCE),
}


def diagram() -> str:
    """`TABLE` as a mermaid state diagram."""
    lines = ["stateDiagram-v2", f"    [*] --> {State.IDLE.name}"]
    for (state, happening), step in TABLE.items():
        lines.append(f"    {state.name} --> {step.state.name}: {happening}")
    return "\n".join(lines)
