"""Where a watch looks: at a running gateway, or at a dive that is played."""

from __future__ import annotations

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
