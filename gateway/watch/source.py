"""Where a watch looks: at a running gateway, or at a dive that is played."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

from gateway.telemetry import Telemetry


@dataclass(frozen=True, slots=True)
class Look:
    """What is to be seen.

    Attributes:
        telemetry: the newest; None: there was none yet.
        state: where it comes from, or why there is none, in words for one line.
        note: what goes on changing of that, such as how long it is so.
        fresh: it is how things are, and not how they were.
        time: of the telemetry, as it is told on a line of text.
        ended: nothing comes after it.
    """

    telemetry: Telemetry | None
    state: str
    note: str = ""
    fresh: bool = True
    time: str = ""
    ended: bool = False


class Source(Protocol):
    """What is looked at, again and again; never in two threads at once."""

    def look(self) -> Look:
        """What is to be seen now. It may take a while: not for an event loop."""
        ...

    def close(self) -> None:
        """After the last look."""
        ...


class Played(Source, Protocol):
    """A dive that is played."""

    @property
    def acts(self) -> Mapping[str, Callable[[], None]]:
        """What a player's keys do, at any time, from any thread: "pause", "faster", "slower", "skip", ..."""
        ...


# between two looks, however long the first one took, whoever shows them has his turn
REST_S = 0.02


class Rhythm:
    """When the next look is due, where each takes its own time.

    Args:
        every_s: from the beginning of one look to that of the next.
        now: in seconds from anywhere.
    """

    def __init__(self, every_s: float, now: Callable[[], float]) -> None:
        self._every_s, self._now = every_s, now
        self._due_s = now() + every_s

    def rest_s(self) -> float:
        """From now until the next look; one that is late does not make the next ones early."""
        now_s = self._now()
        due_s = max(self._due_s, now_s + REST_S)
        self._due_s = due_s + self._every_s
        return due_s - now_s
