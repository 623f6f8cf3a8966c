"""What pilot and findings are told of requests to the autopilot."""

from __future__ import annotations

import math
from collections.abc import Iterator

from detectors.verdict import Level
from drivers.mavlink.messages import StatusText
from gateway import texts
from gateway.findings import Finding
from gateway.severity import Severity
from gateway.supervision.actions import Action, Plan
from gateway.supervision.autopilots import AutopilotKind

NOT_HEARD = "autopilot not heard"
JUST_NOW = "asked just now"
# of these the pilot knows, or cannot be told
_QUIET = frozenset({NOT_HEARD, JUST_NOW})

_Words = Iterator[Finding | StatusText]


def obstacle(kind: AutopilotKind, plan: Plan, own_failsafe: bool, known: bool) -> str:
    """Why nothing of a plan can be asked of an autopilot that is heard and armed, "" where it can."""
    if not plan.actions:
        return plan.left_out
    if kind is AutopilotKind.OTHER:
        return "autopilot not known"
    if own_failsafe:
        return "autopilot in its own failsafe"
    return "" if known else f"{kind} has none"


def announced(time_s: float, action: Action, in_s: float, label: str) -> _Words:
    """An action will be asked for, unless the pilot prevents it."""
    seconds = f"{in_s:.0f}" if in_s >= 1.0 else f"{in_s:.1f}"
    text = texts.fitted(f"{_name(action)} in {seconds} s for {label}", (", change mode to stop",), "")
    return _both(time_s, Level.SUSPECT, Severity.ERROR, text)


def refrained(time_s: float, action: Action, why: str) -> _Words:
    """An action should be asked for, and is not."""
    text = texts.fitted(why if action is Action.NONE else f"{_name(action)} not asked: {why}")
    if why in _QUIET:
        return iter([_finding(time_s, Level.UNKNOWN, Severity.INFO, text)])
    return _both(time_s, Level.UNKNOWN, Severity.WARNING, text)


def cancelled(time_s: float, action: Action, why: str, label: str) -> _Words:
    """An announced action will not be asked for: for a reason, or as nothing is to be done any more."""
    text = f"{_name(action)} cancelled: {why}" if why else f"{_name(action)} for {label} cancelled"
    return _both(time_s, Level.NORMAL, Severity.NOTICE, texts.fitted(text))


def recalled(time_s: float, action: Action, label: str) -> _Words:
    """An action was asked for, and is not needed any more; the autopilot may have heard it."""
    text = texts.fitted(f"{_name(action)} not needed now, may still come", (f" ({label})",), "")
    return _both(time_s, Level.NORMAL, Severity.NOTICE, text)


def asked(time_s: float, action: Action, label: str) -> Finding:
    """The command has gone out; the pilot hears what comes of it."""
    return _finding(time_s, Level.SUSPECT, Severity.INFO, texts.fitted(f"{_name(action)} asked for {label}"))


def fell_back(time_s: float, action: Action, word: str, following: Action, label: str) -> _Words:
    """An action did not come about, the next is asked for."""
    text = texts.fitted(f"{_name(action)} {word}, asking {following}", (f" for {label}",), "")
    return _both(time_s, Level.SUSPECT, Severity.ERROR, text)


def failed(time_s: float, action: Action, word: str) -> _Words:
    """An action did not come about, and what is next is so already."""
    return _both(time_s, Level.SUSPECT, Severity.ERROR, texts.fitted(f"{_name(action)} {word}"))


def postponed(time_s: float, action: Action, word: str, following: Action, in_s: float, label: str) -> _Words:
    """An action did not come about, the next is graver, and announced."""
    text = texts.fitted(f"{_name(action)} {word}, {following} in {in_s:.0f} s", (f" for {label}",), "")
    return _both(time_s, Level.SUSPECT, Severity.ERROR, text)


def given_up(time_s: float, action: Action, word: str, label: str) -> _Words:
    """Nothing of the plan came about."""
    text = texts.fitted(f"{_name(action)} {word}: yours to act", (f" on {label}",), "")
    return _both(time_s, Level.SUSPECT, Severity.ERROR, text)


def done(time_s: float, action: Action, label: str, already: bool) -> _Words:
    """It came about; `already`: it was so before it was asked for."""
    if already:
        text = texts.fitted(f"{_name(action)} is on already, good for {label}")
        return _both(time_s, Level.NORMAL, Severity.NOTICE, text)
    return _both(time_s, Level.NORMAL, Severity.CRITICAL, texts.fitted(f"{_name(action)} done for {label}"))


def yielded(time_s: float) -> _Words:
    """Somebody else has changed the mode."""
    return _both(time_s, Level.NORMAL, Severity.NOTICE, "Mode changed: gateway keeps out until all is well")


def _name(action: Action) -> str:
    return action.capitalize()


def _both(time_s: float, level: Level, severity: Severity, text: str) -> _Words:
    yield _finding(time_s, level, severity, text)
    yield StatusText(severity, text)


def _finding(time_s: float, level: Level, severity: Severity, text: str) -> Finding:
    return Finding(time_s, "failsafe", "vehicle", level, math.nan, text, severity)
