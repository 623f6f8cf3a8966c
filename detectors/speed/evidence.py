"""From a speed and its uncertainty to a level."""

from __future__ import annotations

from dataclasses import dataclass
from math import copysign, hypot

from detectors.verdict import Level

# A speed that is out of its range by z standard deviations is evidence of z^2 - 4 in a second: nothing up to two
NOTHING_AT = 2.0
MOST_AT = 6.0  # ... and not more than by six, however sure the estimator is
FAULT_AT = 6.0  # so much evidence is a FAULT: three standard deviations for 1.2 s, two and a half for 2.7 s
SUSPECT_AT = 3.0
REMEMBERED = 2.0 * FAULT_AT
LONGEST_S = 0.5  # one position is evidence for no more than this: seldom ones must agree, too
# What no filter knows: that a healthy speed is not quite constant, nor the heading quite right; a share of the usual
MODEL_ERROR = 0.01


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
    spread = hypot(error, MODEL_ERROR)
    return Weight(max(low - ratio, ratio - high) / spread, spread > 0.5 * (high - low))


class Evidence:
    """Sums up one weight after the other; a FAULT stays until as much speaks against it. Picklable."""

    def __init__(self) -> None:
        self.level = Level.UNKNOWN
        self._sum = 0.0

    @property
    def score(self) -> float:
        """1.0 and more is a FAULT."""
        return self._sum / FAULT_AT

    def take(self, weight: Weight, interval_s: float) -> None:
        """Takes a weight that stands for an interval."""
        deviations = max(min(weight.deviations, MOST_AT), -MOST_AT)
        if not (weight.uncertain and deviations < NOTHING_AT):  # what is not known speaks neither for nor against
            change = copysign(deviations**2, deviations) - NOTHING_AT**2
            self._sum = min(max(self._sum + change * min(interval_s, LONGEST_S), 0.0), REMEMBERED)
        if self._sum >= FAULT_AT or (self.level is Level.FAULT and self._sum > 0.0):
            self.level = Level.FAULT
        elif self._sum >= SUSPECT_AT:
            self.level = Level.SUSPECT
        else:
            self.level = Level.UNKNOWN if weight.uncertain else Level.NORMAL

    def nothing(self) -> None:
        """No speed, or no range to hold it against: a FAULT stays one, all else is unknown."""
        if self.level is not Level.FAULT:
            self.clear()

    def clear(self) -> None:
        """Begins anew."""
        self.level, self._sum = Level.UNKNOWN, 0.0
