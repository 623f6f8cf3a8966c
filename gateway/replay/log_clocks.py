"""By how much the clock of one log is ahead of that of another, where both are of one dive.

In this order, and the first that is sure is believed:

- **boot**: both heard one autopilot, which stamps its messages with its time since start (see `boot_clocks`). Good to
  the shortest time that a message took, which on a fast link is a millisecond.
- **commands**: both have commands of the same thrusters, one from CAN and one from the autopilot, say (see
  `series_match`). Good to some milliseconds.
- **speeds**: both have speeds of the same thrusters; the same, but a filter in between shows as time.

Where the logs are longer than 5 minutes, the drift of one clock against the other is found, too: 50 ppm, as two poor
quartz clocks have, is 0.18 s in an hour. Nothing here is found by the logs' own times: those may be anything.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum

from gateway.replay.boot_clocks import UNEXPLAINED_MAX, clock_line, unexplained
from gateway.replay.log_trace import LogTrace
from gateway.replay.series_match import Match, match

BOOT_ERROR_S = 0.002  # two stamps in whole milliseconds


class FoundBy(StrEnum):
    """What an offset was found by."""

    BOOT = "boot"
    COMMANDS = "commands"
    SPEEDS = "speeds"


@dataclass(frozen=True, slots=True)
class LogOffset:
    """What makes one log's times another's.

    Attributes:
        offset_s: to be added, at `at_s`.
        at_s: by the clock of the log whose times are to be changed.
        drift: seconds a second; 0.0 where the logs are too short to see it.
        found_by: how it was found.
        error_s: by which the offset may be wrong, roughly; by boot the shortest delay of the link comes to it.
        unexplained: share of the variance of what was compared that remains, 0.0 to 0.1.
        margin: how many times more of it the second best offset leaves; by boot there is no second.
        overlap_s: for how long both have what was compared.
    """

    offset_s: float
    at_s: float
    drift: float
    found_by: FoundBy
    error_s: float
    unexplained: float
    margin: float | None
    overlap_s: float

    def time_s(self, time_s: float) -> float:
        """A time of the one log by the clock of the other."""
        return time_s + self.offset_s + self.drift * (time_s - self.at_s)


def log_offset(reference: LogTrace, other: LogTrace) -> LogOffset | None:
    """What is to be added to the times of `other` to make them those of `reference`; None where nothing is sure."""
    found = _by_boot(reference, other)
    if found is None:
        found = _matched(match(reference.commands(), other.commands()), FoundBy.COMMANDS)
    return found or _matched(match(reference.speeds(), other.speeds()), FoundBy.SPEEDS)


def _matched(found: Match | None, found_by: FoundBy) -> LogOffset | None:
    if found is None:
        return None
    return LogOffset(
        offset_s=found.offset_s,
        at_s=found.at_s,
        drift=found.drift,
        found_by=found_by,
        error_s=found.error_s,
        unexplained=found.unexplained,
        margin=found.margin,
        overlap_s=found.overlap_s,
    )


def _by_boot(reference: LogTrace, other: LogTrace) -> LogOffset | None:
    pairs = [(one, two, unexplained(one, two)) for one in reference.sessions() for two in other.sessions()]
    known = [(told, one, two) for one, two, told in pairs if told is not None and told[0] <= UNEXPLAINED_MAX]
    if not known:
        return None
    (share, overlap_s), one, two = min(known, key=lambda pair: pair[0])
    mine, its = clock_line(one), clock_line(two)
    return LogOffset(
        offset_s=mine.at(its.at_s) - its.offset_s,
        at_s=its.at_s + its.offset_s,
        drift=(1.0 + mine.drift) / (1.0 + its.drift) - 1.0,
        found_by=FoundBy.BOOT,
        error_s=BOOT_ERROR_S,
        unexplained=share,
        margin=None,
        overlap_s=overlap_s,
    )
