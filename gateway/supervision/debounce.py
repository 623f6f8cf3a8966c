"""A level counts when it has lasted. Time is passed in; nothing here waits."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from detectors.verdict import Level
from gateway.supervision.levels import Event


@dataclass(frozen=True, slots=True)
class DebounceTimes:
    """How long each must last without a break before it counts; 0 = at once.

    Attributes:
        suspect_s: SUSPECT or worse.
        fault_s: FAULT.
        clear_s: NORMAL, and likewise UNKNOWN. A shorter UNKNOWN stops the time of NORMAL, and does not end it.

    Raises:
        ValueError: a negative time.
    """

    suspect_s: float
    fault_s: float
    clear_s: float

    def __post_init__(self) -> None:
        for name in self.__slots__:
            if not getattr(self, name) >= 0.0:
                raise ValueError(f"{name} = {getattr(self, name)!r}: want 0 or more seconds")


# the levels during which each event's time runs, the most urgent event first
_RUNS_AT: Mapping[Event, frozenset[Level]] = {
    Event.FAULTY: frozenset({Level.FAULT}),
    Event.SUSPICIOUS: frozenset({Level.SUSPECT, Level.FAULT}),
    Event.GOOD: frozenset({Level.NORMAL}),
    Event.LEARNING: frozenset({Level.UNKNOWN}),
}


class Debounce:
    """Turns a stream of levels into the events that have lasted long enough."""

    def __init__(self, times: DebounceTimes) -> None:
        self._lasts_s = {
            Event.FAULTY: times.fault_s,
            Event.SUSPICIOUS: times.suspect_s,
            Event.GOOD: times.clear_s,
            Event.LEARNING: times.clear_s,
        }
        self._since_s: dict[Event, float] = {}
        self._muted = False

    def update(self, time_s: float, level: Level) -> Event | None:
        """The most urgent event that the levels up to this one amount to, again and again while they last."""
        if self._muted and level >= Level.SUSPECT:
            return None
        self._muted = False
        self._leave_out_unknown(time_s, level)
        lasted = None
        for event, levels in _RUNS_AT.items():
            if level not in levels:
                if (event, level) != (Event.GOOD, Level.UNKNOWN):
                    self._since_s.pop(event, None)
            elif time_s - self._since_s.setdefault(event, time_s) >= self._lasts_s[event] and lasted is None:
                lasted = event
        if lasted is Event.LEARNING:
            self._since_s.pop(Event.GOOD, None)
        return lasted

    def _leave_out_unknown(self, time_s: float, level: Level) -> None:
        """Where NORMAL goes on after a short UNKNOWN, that one's time does not count as good."""
        if level is Level.NORMAL and {Event.GOOD, Event.LEARNING} <= self._since_s.keys():
            self._since_s[Event.GOOD] += time_s - self._since_s[Event.LEARNING]

    def steady(self, time_s: float, level: Level) -> bool:
        """True where this level, again from now on, only says again what has lasted long enough.

        Only for NORMAL and UNKNOWN.
        """
        event = Event.GOOD if level is Level.NORMAL else Event.LEARNING
        since_s = self._since_s.get(event)
        alone = since_s is not None and len(self._since_s) == 1 and not self._muted
        return alone and since_s is not None and time_s - since_s >= self._lasts_s[event]

    def mute(self) -> None:
        """What is bad now has been dealt with: it counts again only after it was away, or after `unmute`."""
        self._muted = True
        self._since_s.clear()

    def unmute(self) -> None:
        """Whatever is bad counts again."""
        self._muted = False

    def reset(self) -> None:
        """Nothing has lasted yet."""
        self._since_s.clear()
