"""Whether the gateway itself has found something in dives that are to be learnt from as healthy ones."""

from __future__ import annotations

from collections.abc import Sequence

from detectors.verdict import Level
from gateway.commissioning.dive import RecordedDive

TOLD = 2  # findings of a dive that are quoted


def faulty_dives(detector: str, dives: Sequence[RecordedDive], subject: str | None = None) -> tuple[str, ...]:
    """The dives in which a detector ("thruster", "speed", "navigation") said FAULT, each with the way out.

    Args:
        detector: whose findings count.
        dives: that should be healthy.
        subject: that is looked at, such as "thruster 3"; None: any.
    """
    return tuple(
        f"{dive.name} is not healthy: {found}. Leave it out; or say --healthy, if you know better"
        for dive in dives
        if (found := _found(detector, dive, subject))
    )


def _found(detector: str, dive: RecordedDive, subject: str | None) -> str:
    of_detector = [one for one in dive.findings if one.detector == detector and one.level is Level.FAULT]
    faults = [one for one in of_detector if subject in (None, one.subject)]
    told = [f"{_clock(one.time_s - dive.begin_s)} {one.text}" for one in faults]
    more = f" and {len(told) - TOLD} more" if len(told) > TOLD else ""
    return ", ".join(told[:TOLD]) + more


def _clock(seconds: float) -> str:
    minutes, second = divmod(int(max(seconds, 0.0)), 60)
    return f"{minutes // 60}:{minutes % 60:02}:{second:02}"
