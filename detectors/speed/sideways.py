"""Whether a vehicle is driven aside so hard that its command ahead says little of its speed ahead."""

from __future__ import annotations

from math import exp

# A hull goes on as it was driven for about so long
LASTS_S = 3.0
# Aside with more than this share of the thrust ahead: drag goes with the whole speed and not with the part of it
# ahead, and in a turn the one motion brakes the other, at times to a stop
HARD = 0.25
# ... but not where it is next to nothing, as of a vehicle that keeps its station
LEAST = 0.02  # share of the full thrust


class Sideways:
    """Means of the thrusts ahead and aside, forgotten exponentially. Picklable."""

    def __init__(self) -> None:
        self._ahead = self._aside = 0.0

    def take(self, ahead: float | None, aside: float, interval_s: float) -> None:
        """Takes the commands, each -1 to 1, that held during an interval; `ahead` None: not known."""
        keep = exp(-interval_s / LASTS_S)
        self._ahead = keep * self._ahead + (1.0 - keep) * (0.0 if ahead is None else ahead**2)
        self._aside = keep * self._aside + (1.0 - keep) * aside**2

    @property
    def hard(self) -> bool:
        """Whether speed ahead and flow cannot be learnt from the present motion, nor judged."""
        return self._aside > max(HARD * self._ahead, LEAST)
