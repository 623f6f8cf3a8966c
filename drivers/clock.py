"""The one clock of the program: unix seconds that never step, and kernel time stamps brought onto it."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

FloatArray: TypeAlias = NDArray[np.float64]

# A frame waits in a socket buffer for milliseconds, for seconds if the process was stopped or starved; those that
# waited must keep their order. Older than this, the wall clock was set meanwhile, and the age says nothing.
MAX_AGE_S = 60.0
# The two clocks are read one after the other, so their difference jitters by as much as the scheduler pauses us.
# It is held until it really moved, else frames stamped in order by the kernel could come out in another order.
OFFSET_TOLERANCE_S = 0.002


class Clock:
    """Unix time at the start plus monotonic time since: it does not step when NTP or a user sets the wall clock.

    Args:
        wall: source of unix seconds.
        monotonic: source of seconds that never go back.
    """

    def __init__(
        self, wall: Callable[[], float] = time.time, monotonic: Callable[[], float] = time.monotonic
    ) -> None:
        self._wall = wall
        self._monotonic = monotonic
        self._start_s = wall() - monotonic()
        self._wall_offset_s = 0.0

    def now(self) -> float:
        """Seconds since 1970 as they stood at the start, going on evenly."""
        return self._start_s + self._monotonic()

    def stamp(self, unix_s: float) -> float:
        """Bring a wall-clock stamp of the recent past onto this clock, by its age.

        Args:
            unix_s: wall-clock time at which the kernel received something, in seconds since 1970.

        Returns:
            The same instant on this clock, never in the future; `now()` where the stamp is no recent past.
        """
        now_s, wall_s = self.now(), self._wall()
        if not 0.0 <= wall_s - unix_s <= MAX_AGE_S:  # also false for NaN
            return now_s
        self._hold_offset(now_s, wall_s)
        return min(now_s, unix_s + self._wall_offset_s)

    def stamps(self, unix_s: FloatArray) -> FloatArray:
        """Bring many stamps onto this clock at once, as `stamp` does with each.

        Args:
            unix_s: (N,) wall-clock seconds since 1970; NaN where there is no stamp.

        Returns:
            (N,) instants on this clock, none in the future.
        """
        now_s, wall_s = self.now(), self._wall()
        age_s = wall_s - unix_s
        recent = (age_s >= 0.0) & (age_s <= MAX_AGE_S)  # False for NaN
        if recent.any():
            self._hold_offset(now_s, wall_s)
        return np.where(recent, np.minimum(now_s, unix_s + self._wall_offset_s), now_s)

    def _hold_offset(self, now_s: float, wall_s: float) -> None:
        offset_s, pause_s = now_s - wall_s, self.now() - now_s
        if pause_s <= OFFSET_TOLERANCE_S < abs(offset_s - self._wall_offset_s):  # not if we were paused in between
            self._wall_offset_s = offset_s
