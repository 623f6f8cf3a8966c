"""The supervisor beside the plain loop that one would write without it: a text when a level has changed."""

from __future__ import annotations

from collections.abc import Sequence
from math import sin

from detectors.verdict import Level
from drivers.mavlink.messages import StatusText
from gateway.observation import Observation
from gateway.severity import Severity
from gateway.supervision.announcements import RateLimit
from gateway.supervision.debounce import DebounceTimes
from gateway.supervision.settings import Settings
from gateway.supervision.subject import Policy
from gateway.supervisor import Supervisor
from hil_tests.bench.timing import Comparison

THRUSTERS, RATE_HZ, DURATION_S = 8, 50.0, 60.0
TICK_S = 0.1
WITHOUT_REPEATS = Settings(repeat_s=1e9, suspect_repeat_s=1e9, limit=RateLimit(1e6, 1000))


def supervision() -> Comparison:
    """Eight thrusters for a minute, each of which is faulty for some seconds, with the supervisor's ticks.

    The peer remembers the levels, and says what has changed: it knows no rise and fall times, repeats, rate limit,
    common causes or requests. They agree where the same faults are told.
    """
    seen = [*_observations()]
    return Comparison(
        work="Supervisor.observe",
        peer="plain if-then loop",
        unit="observation",
        count=len(seen),
        ours=lambda: _supervised(seen),
        theirs=lambda: _plain(seen),
        agree=lambda ours, theirs: bool(ours) and ours == theirs,
    )


def _observations() -> list[Observation]:
    return [
        _observation(n / RATE_HZ, number)
        for n in range(round(DURATION_S * RATE_HZ))
        for number in range(1, THRUSTERS + 1)
    ]


def _observation(time_s: float, number: int) -> Observation:
    faulty = sin(time_s / 5.0 + number) > 0.9
    level, trouble = (Level.FAULT, "entangled?") if faulty else (Level.NORMAL, "")
    details = ("812 rpm", ", want 1043", " (-22%)")
    return Observation(time_s, "thruster", f"thruster {number}", f"T{number}", level, 1.7, trouble, details)


def _supervised(seen: Sequence[Observation]) -> list[tuple[int, str]]:
    supervisor = Supervisor({"thruster": Policy(DebounceTimes(0.0, 0.0, 0.0))}, WITHOUT_REPEATS)
    outgoing, tick_s = [], 0.0
    for one in seen:
        if one.time_s >= tick_s:
            tick_s += TICK_S
            outgoing += supervisor.advance(one.time_s)
        outgoing += supervisor.observe(one)
    return [(one.severity, one.text) for one in outgoing if isinstance(one, StatusText)]


def _plain(seen: Sequence[Observation]) -> list[tuple[int, str]]:
    levels: dict[str, Level] = {}
    said = []
    for one in seen:
        before = levels.get(one.subject, Level.UNKNOWN)
        if one.level is not before:
            levels[one.subject] = one.level
            if one.level is Level.FAULT:
                said.append((int(Severity.CRITICAL), one.text()))
            elif before is Level.FAULT:
                said.append((int(Severity.NOTICE), one.over_text()))
    return said
