"""How fast a recorded dive is played: told the real time, it says how far the dive should be."""

from __future__ import annotations

from math import inf

SLOWEST, FASTEST = 0.125, 256.0
# of the speed that is reached: over so long it is averaged
SETTLE_S = 2.0


class Pace:
    """Time of the dive over real time.

    Args:
        speed: of the dive, 1 = as it was.

    Attributes:
        speed: as wanted.
        reached: as it is, over the last seconds: this machine may be too slow for more.
        paused: the dive stands still.
        dive_s: how far it is, from its beginning.

    Raises:
        ValueError: a speed that is none.
    """

    def __init__(self, speed: float = 1.0) -> None:
        if not SLOWEST <= speed <= FASTEST:  # NaN neither
            raise ValueError(f"speed = {speed}: want {SLOWEST:g} to {FASTEST:g} times real time")
        self.speed, self.paused = speed, False
        self.reached, self.dive_s = speed, 0.0
        self._real_s: float | None = None
        self._goal_s = -inf

    def wanted_s(self, real_s: float) -> float:
        """How far the dive should be by now."""
        elapsed_s = 0.0 if self._real_s is None else max(0.0, real_s - self._real_s)
        played_s = self.dive_s if self.paused else self.dive_s + self.speed * elapsed_s
        return max(played_s, self._goal_s)

    def at(self, dive_s: float, real_s: float) -> None:
        """How far the dive has come, by this time."""
        elapsed_s = 0.0 if self._real_s is None else real_s - self._real_s
        if self.paused and not self.skipping:
            self.reached = self.speed
        elif elapsed_s > 0.0:
            share = min(1.0, elapsed_s / SETTLE_S)
            self.reached += share * ((dive_s - self.dive_s) / elapsed_s - self.reached)
        self.dive_s, self._real_s = dive_s, real_s

    @property
    def skipping(self) -> bool:
        """It is on its way to a later place, as fast as this machine can."""
        return self._goal_s > self.dive_s

    def skip(self, seconds: float) -> None:
        """On to a later place of the dive, infinity: to its end, as fast as this machine can."""
        self._goal_s = max(self._goal_s, self.dive_s) + seconds

    def stay(self) -> None:
        """Stands still here, wherever it was on its way to."""
        self.paused, self._goal_s = True, -inf

    def restart(self) -> None:
        """At the beginning again, at the same speed."""
        self.reached, self.dive_s, self.paused = self.speed, 0.0, False
        self._real_s, self._goal_s = None, -inf

    def toggle(self) -> None:
        """Stands still, or goes on."""
        if self.skipping or not self.paused:
            self.stay()
        else:
            self.paused = False

    def faster(self) -> None:
        """Twice as fast."""
        self.speed = self.reached = min(FASTEST, 2.0 * self.speed)

    def slower(self) -> None:
        """Half as fast."""
        self.speed = self.reached = max(SLOWEST, self.speed / 2.0)
