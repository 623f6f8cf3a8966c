"""A recorded dive played at a pace: its own, so many times faster, as fast as it goes, or one instant at a time."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from math import inf, isfinite, isinf

from hil_tests.playback.log_outlets import Outlets
from hil_tests.playback.log_play import LogPlay, Sent

YIELD_EVERY = 50  # instants, where nothing is waited for: others want to be heard as well
LONGEST_WAIT_S = 0.2  # so that the play can be stopped, and progress be seen, in a pause of the dive

Shown = Callable[[float, Sent], None]  # of the time since the beginning, and what was sent then


@dataclass(frozen=True, slots=True)
class Pace:
    """How fast a dive is played.

    Attributes:
        speed: times its own; infinity: as fast as bus and link take it.

    Raises:
        ValueError: a speed that is none.
    """

    speed: float = 1.0

    def __post_init__(self) -> None:
        if not self.speed > 0.0:
            raise ValueError(f"speed = {self.speed}: want more than 0, or max")

    def wait_s(self, dive_s: float, passed_s: float) -> float:
        """How long it still takes until a time of the dive, when so much has passed; 0: it is due."""
        return 0.0 if isinf(self.speed) else max(dive_s / self.speed - passed_s, 0.0)

    def dive_s(self, passed_s: float, next_s: float) -> float:
        """Which time of the dive it is; at least `next_s`, for which was waited."""
        return next_s if isinf(self.speed) else max(passed_s * self.speed, next_s)


class LogPlayer:
    """Plays it.

    Args:
        play: what is due when.
        start_s: when that begins, unix.
        outlets: where it goes.
        shown: hears what was sent.

    Attributes:
        played_s: when the newest instant was that is played, since the beginning.
    """

    def __init__(self, play: LogPlay, start_s: float, outlets: Outlets, shown: Shown) -> None:
        self._play, self._start_s, self._outlets, self._shown = play, start_s, outlets, shown
        self.played_s = 0.0

    async def at_pace(self, pace: Pace, stopped: asyncio.Event) -> None:
        """Play until it is over, or stopped.

        Raises:
            CanPortError: a bus takes no frames any more.
            OSError: a log cannot be read any more.
        """
        now = asyncio.get_running_loop().time
        began_s, instants = now(), 0
        while not stopped.is_set() and isfinite(next_s := self._next_s()):
            wait_s = pace.wait_s(next_s, now() - began_s)
            instants += 1
            if wait_s > 0.0 or instants % YIELD_EVERY == 0:
                await asyncio.sleep(min(wait_s, LONGEST_WAIT_S))
            if wait_s <= LONGEST_WAIT_S:
                await self._send(pace.dive_s(now() - began_s, next_s))
                self.played_s = next_s
            else:
                self._shown(min((now() - began_s) * pace.speed, next_s), Sent((), ()))

    async def stepped(self, asked: Callable[[], Awaitable[bool]]) -> None:
        """Play one instant each time it is asked for; until it is over, or no more is.

        Raises:
            CanPortError, OSError: as `at_pace`.
        """
        while isfinite(next_s := self._next_s()) and await asked():
            await self._send(next_s)
            self.played_s = next_s

    def _next_s(self) -> float:
        """Of the next instant, since the beginning."""
        next_s = self._play.next_s()
        return inf if isinf(next_s) else max(next_s - self._start_s, 0.0)

    async def _send(self, dive_s: float) -> None:
        sent = self._play.due(self._start_s + dive_s)
        for bus, frame in sent.frames:
            await self._outlets.frame(bus, frame)
        for packet in sent.packets:
            self._outlets.packet(packet)
        self._shown(dive_s, sent)
