"""From a speed and its uncertainty to a level."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, sqrt

from detectors.verdict import Level

# Standard deviations that the speed is out of its range: a FAULT, a suspicion, and where a FAULT is over
FAULT_AT, SUSPECT_AT, OVER_AT = 3.0, 2.0, -1.0
# for so long without a break, and at so many positions
LASTING_S, POSITIONS = 1.0, 3
# What no filter knows: that a healthy speed is not quite constant, nor the heading quite right; a share of the usual
MODEL_ERROR = 0.01
SCORE_MAX = 100.0


@dataclass(frozen=True, slots=True)
class Weight:
    """What one estimate says.

    Attributes:
        deviations: that the speed is out of its range, negative inside.
        uncertain: the range would fit into the doubt.
    """

    deviations: float
    uncertain: bool


def weigh(ratio: float, error: float, low: float, high: float) -> Weight:
    """How far a speed is out of its range; all in shares of the usual speed.

    Args:
        ratio: the speed.
        error: its standard deviation.
        low, high: the normal range.
    """
    spread = sqrt(error**2 + MODEL_ERROR**2)
    return Weight(max(low - ratio, ratio - high) / spread, spread > 0.5 * (high - low))


class Evidence:
    """Turns one weight after the other into levels; a FAULT stays until the speed is known to be back. Picklable."""

    def __init__(self) -> None:
        self.level = Level.UNKNOWN
        self.score = 0.0
        self._since: dict[Level, tuple[float, int]] = {}

    def take(self, time_s: float, weight: Weight) -> Level:
        """The level after this one."""
        deviations = weight.deviations if isfinite(weight.deviations) else 0.0
        self.score = min(max(deviations / FAULT_AT, 0.0), SCORE_MAX)
        fault = self._lasts(Level.FAULT, deviations >= FAULT_AT, time_s)
        suspect = self._lasts(Level.SUSPECT, deviations >= SUSPECT_AT, time_s)
        stays = self.level is Level.FAULT and (weight.uncertain or deviations > OVER_AT)
        if fault or stays:
            self.level = Level.FAULT
        elif suspect:
            self.level = Level.SUSPECT
        else:
            self.level = Level.UNKNOWN if weight.uncertain else Level.NORMAL
        return self.level

    def nothing(self) -> Level:
        """No speed, or no range to hold it against: a FAULT stays one, all else is unknown."""
        self._since.clear()
        self.score = 0.0 if self.level is not Level.FAULT else self.score
        self.level = Level.FAULT if self.level is Level.FAULT else Level.UNKNOWN
        return self.level

    def clear(self) -> None:
        """Begins anew."""
        self._since.clear()
        self.level, self.score = Level.UNKNOWN, 0.0

    def _lasts(self, level: Level, holds: bool, time_s: float) -> bool:
        if not holds:
            self._since.pop(level, None)
            return False
        since_s, count = self._since.get(level, (time_s, 0))
        self._since[level] = since_s, count + 1
        return time_s - since_s >= LASTING_S and count + 1 >= POSITIONS
