"""What the failsafe table of the configuration needs of the others: an action that cannot come is no safety."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from gateway.config_sections import MAVLINK, Failsafe, Thruster
from gateway.problems import Problem
from gateway.supervision.actions import NEEDS, Action, Need, sends
from gateway.supervision.autopilots import REQUESTS

# keys of the table, with the detector that each is of
KEYS: Mapping[str, str] = {
    "thruster_fault": "thruster",
    "thrusters_fault": "thruster",
    "speed_fault": "speed",
    "navigation_fault": "navigation",
}
_IN_WORDS: Mapping[str, str] = {
    "thruster_fault": "at a fault of a thruster",
    "thrusters_fault": "at a fault of two or more",
    "speed_fault": "at a fault of the speed",
    "navigation_fault": "at a fault of a navigation sensor",
}
# tables that switch a watch on
WATCHES = frozenset({"speed", "navigation"})
NO_SECOND_EVIDENCE = f'has no second kind of evidence, without which nothing above "{Action.HOLD}" is asked'


def contradictions(failsafe: Failsafe, thrusters: Sequence[Thruster], tables: Mapping[str, Any]) -> Iterator[Problem]:
    """Actions that can never come about.

    Args:
        failsafe: the table.
        thrusters: what is valid of them.
        tables: the raw file.
    """
    for key, detector in KEYS.items():
        for action in filter(sends, getattr(failsafe, key) or ()):
            for wanted in _wanted(action, detector, thrusters, tables):
                yield Problem(f"failsafe.{key}", str(action), wanted)


def _wanted(action: Action, detector: str, thrusters: Sequence[Thruster], tables: Mapping[str, Any]) -> Iterator[str]:
    if MAVLINK not in tables:
        yield f'needs a [mavlink] table to reach the autopilot, else want "{Action.WARN}" or "{Action.NONE}"'
    if detector in WATCHES and detector not in tables:
        yield f"means nothing without a table [{detector}]"
    if not any(known is action for _, known in REQUESTS):
        yield f'neither ArduSub nor a PX4 submarine does that: want "{Action.SURFACE}" or "{Action.HOLD}"'
    if Need.EVIDENCE in NEEDS[action] and detector == "navigation":
        yield f'a navigation sensor {NO_SECOND_EVIDENCE}: want "{Action.MANUAL}" or "{Action.HOLD}"'
    if Need.EVIDENCE in NEEDS[action] and detector == "thruster" and "speed" not in tables:
        yield f"a thruster {NO_SECOND_EVIDENCE}: want a table [speed], which can confirm it"
    if Need.VERTICAL_THRUST in NEEDS[action] and _may_be_vertical(thrusters):
        yield "needs to know whether vertical thrust is left: want down = 1 or -1 for each vertical [[thruster]]"


def _may_be_vertical(thrusters: Sequence[Thruster]) -> bool:
    """Whether none is known to be vertical, and of some it is not known which way they drive."""
    return not any(one.down for one in thrusters) and any(not (one.ahead or one.right) for one in thrusters)


def in_words(failsafe: Failsafe) -> str:
    """What is asked of the autopilot and when, e.g. `...: surface, else hold at a fault of a thruster`."""
    ladders = {words: getattr(failsafe, key) or () for key, words in _IN_WORDS.items()}
    asked = [
        f"{', else '.join(map(str, filter(sends, ladder)))} {words}"
        for words, ladder in ladders.items()
        if any(map(sends, ladder))
    ]
    if not asked:
        return "advice only: nothing is asked of the autopilot"
    return f"asked of the autopilot, announced {failsafe.delay_s:g} s before: {'; '.join(asked)}"
