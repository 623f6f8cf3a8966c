"""The levels of a subject and what moves them: the table that code, tests and the README's diagram all read.

- A FAULT is latched. Its clear conditions have names: NORMAL lasted, vehicle disarmed, operator accepted, a sensor
  that it relies on is faulty. That its detector does not know (any more) clears nothing, nor does one NORMAL of a
  detector that has just learnt the faulty state.
- Not knowing is no good news: a suspicion stays until it is confirmed, refuted or dealt with.
- One text when a subject gets worse, one when it is over, and while it lasts again now and then.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum, StrEnum, auto

from detectors.verdict import Level
from gateway.severity import Severity


class Event(StrEnum):
    """What moves a subject."""

    LEARNING = "UNKNOWN lasted"
    GOOD = "NORMAL lasted"
    SUSPICIOUS = "SUSPECT or worse lasted"
    FAULTY = "FAULT lasted"
    DISTRUSTED = "a sensor that it relies on is faulty"
    DISARMED = "vehicle disarmed"
    ACCEPTED = "operator accepted"
    REPEAT_DUE = "repeat due"


class Say(Enum):
    """What a transition tells the pilot."""

    NOTHING = auto()
    WORSE = auto()
    REPEAT = auto()
    OVER = auto()


@dataclass(frozen=True, slots=True)
class Transition:
    """Where an event leads, and what is said."""

    level: Level
    say: Say = Say.NOTHING


TABLE: Mapping[tuple[Level, Event], Transition] = {
    (Level.UNKNOWN, Event.LEARNING): Transition(Level.UNKNOWN),
    (Level.UNKNOWN, Event.GOOD): Transition(Level.NORMAL),
    (Level.UNKNOWN, Event.SUSPICIOUS): Transition(Level.SUSPECT, Say.WORSE),
    (Level.UNKNOWN, Event.FAULTY): Transition(Level.FAULT, Say.WORSE),
    (Level.UNKNOWN, Event.DISTRUSTED): Transition(Level.UNKNOWN),
    (Level.UNKNOWN, Event.DISARMED): Transition(Level.UNKNOWN),
    (Level.UNKNOWN, Event.ACCEPTED): Transition(Level.UNKNOWN),
    (Level.UNKNOWN, Event.REPEAT_DUE): Transition(Level.UNKNOWN),
    (Level.NORMAL, Event.LEARNING): Transition(Level.UNKNOWN),
    (Level.NORMAL, Event.GOOD): Transition(Level.NORMAL),
    (Level.NORMAL, Event.SUSPICIOUS): Transition(Level.SUSPECT, Say.WORSE),
    (Level.NORMAL, Event.FAULTY): Transition(Level.FAULT, Say.WORSE),
    (Level.NORMAL, Event.DISTRUSTED): Transition(Level.UNKNOWN),
    (Level.NORMAL, Event.DISARMED): Transition(Level.NORMAL),
    (Level.NORMAL, Event.ACCEPTED): Transition(Level.NORMAL),
    (Level.NORMAL, Event.REPEAT_DUE): Transition(Level.NORMAL),
    (Level.SUSPECT, Event.LEARNING): Transition(Level.SUSPECT),
    (Level.SUSPECT, Event.GOOD): Transition(Level.NORMAL, Say.OVER),
    (Level.SUSPECT, Event.SUSPICIOUS): Transition(Level.SUSPECT),
    (Level.SUSPECT, Event.FAULTY): Transition(Level.FAULT, Say.WORSE),
    (Level.SUSPECT, Event.DISTRUSTED): Transition(Level.UNKNOWN, Say.OVER),
    (Level.SUSPECT, Event.DISARMED): Transition(Level.UNKNOWN, Say.OVER),
    (Level.SUSPECT, Event.ACCEPTED): Transition(Level.UNKNOWN, Say.OVER),
    (Level.SUSPECT, Event.REPEAT_DUE): Transition(Level.SUSPECT, Say.REPEAT),
    (Level.FAULT, Event.LEARNING): Transition(Level.FAULT),
    (Level.FAULT, Event.GOOD): Transition(Level.NORMAL, Say.OVER),
    (Level.FAULT, Event.SUSPICIOUS): Transition(Level.FAULT),
    (Level.FAULT, Event.FAULTY): Transition(Level.FAULT),
    (Level.FAULT, Event.DISTRUSTED): Transition(Level.UNKNOWN, Say.OVER),
    (Level.FAULT, Event.DISARMED): Transition(Level.UNKNOWN, Say.OVER),
    (Level.FAULT, Event.ACCEPTED): Transition(Level.UNKNOWN, Say.OVER),
    (Level.FAULT, Event.REPEAT_DUE): Transition(Level.FAULT, Say.REPEAT),
}

SEVERITY_OF_WORSE: Mapping[Level, Severity] = {Level.SUSPECT: Severity.WARNING, Level.FAULT: Severity.CRITICAL}


def diagram() -> str:
    """`TABLE` as a mermaid state diagram; transitions that change and say nothing are left out."""
    lines = ["stateDiagram-v2", f"    [*] --> {Level.UNKNOWN.name}"]
    for (level, event), transition in TABLE.items():
        if transition.level is not level or transition.say is not Say.NOTHING:
            said = "" if transition.say is Say.NOTHING else f" / say {transition.say.name.lower()}"
            lines.append(f"    {level.name} --> {transition.level.name}: {event}{said}")
    return "\n".join(lines)
