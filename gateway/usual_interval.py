"""How often commands that come as a stream usually come, and when they have become too rare to be of use."""

from __future__ import annotations

import math
from collections import deque
from statistics import fmean

# a stream's interval is known after so many; with one lost on the way, the next is still in time
USUAL_COMMANDS, USUAL_INTERVALS = 40, 2.2
# a program that is busy sees them as late as this
BUSY_S = 0.15
# a thruster answers within a fraction of a second: what is told more rarely does not say why it turns as it does
RARE_S = 0.3
# so many slow ones are no loss on the way
SLOW_COMMANDS = 5


class UsualInterval:
    """The interval of commands that come as a stream: the least mean of a while.

    Means, for what arrives in time is seen in bunches by a program that is busy.
    """

    def __init__(self) -> None:
        self._newest_s: deque[float] = deque(maxlen=USUAL_COMMANDS)
        self.usual_s = math.inf

    def take(self, interval_s: float) -> None:
        """Takes the interval between two commands."""
        self._newest_s.append(interval_s)
        if len(self._newest_s) == USUAL_COMMANDS:
            self.usual_s = min(self.usual_s, fmean(self._newest_s))

    @property
    def stale_s(self) -> float:
        """A command that is older than this is no longer known; infinity before the interval is."""
        usual_s = self.usual_s if math.isfinite(self.usual_s) else self._newest_mean_s()
        return 0.0 if usual_s > RARE_S else max(USUAL_INTERVALS * self.usual_s, BUSY_S)

    @property
    def slow(self) -> bool:
        """True while they come so rarely that they are not known most of the time."""
        return self._newest_mean_s() > self.stale_s

    def _newest_mean_s(self) -> float:
        """Of the newest intervals, 0 before there are enough of them."""
        newest_s = list(self._newest_s)[-SLOW_COMMANDS:]
        return fmean(newest_s) if len(newest_s) == SLOW_COMMANDS else 0.0
