"""From a speed and its uncertainty to a level."""

from __future__ import annotations

from dataclasses import dataclass
from math import copysign, hypot

from detectors.verdict import Level

# A speed that is out of its range by z standard deviations is evidence of z^2 - 2.25 in a second
NOTHING_AT = 1.5
FAULT_AT = 4.0  # so much evidence is a FAULT: two standard deviations for 2.3 s, three for two estimates
SUSPECT_AT = 2.0
REMEMBERED = 2.0 * FAULT_AT
MOST = 0.5 * FAULT_AT  # that one estimate is evidence for, however far off it is: two must agree
# What no filter knows: that a healthy speed is not quite constant, nor the heading quite right; a share of the usual
MODEL_ERROR = 0.01
# No fault makes a vehicle so fast, nor drives it backwards: what then is wrong is a heading, or a position
LEAST, MOST_OF_HIGH = -0.5, 2.0
# Much makes a vehicle slow and little makes it fast: to believe that takes so many times as much
FAST = 1.5


@dataclass(frozen=True, slots=True)
class Weight:
    """What one estimate says.

    Attributes:
        deviations: that the speed is out of its range, negative inside.
        uncertain: the range would fit into the doubt, or the speed is impossible.
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
    impossible = not LEAST <= ratio <= MOST_OF_HIGH * high
    deviations = max(low - ratio, (ratio - high) / FAST) / spread
    return Weight(deviations, impossible or spread > 0.5 * (high - low))


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
        if not weight.uncertain:  # what is not known speaks neither for nor against
            square = copysign(weight.deviations**2, weight.deviations) - NOTHING_AT**2
            change = max(min(square * interval_s, MOST), -MOST)
            self._sum = min(max(self._sum + change, 0.0), REMEMBERED)
        if self._sum >= FAULT_AT or (self.level is Level.FAULT and self._sum > 0.0):
            self.level = Level.FAULT
        elif self._sum >= SUSPECT_AT:
            self.level = Level.SUSPECT
        else:
            in_doubt = weight.uncertain or weight.deviations > 0.0
            self.level = Level.UNKNOWN if in_doubt else Level.NORMAL

    def nothing(self) -> None:
        """No speed, or no range to hold it against: a FAULT stays one, all else is unknown."""
        if self.level is not Level.FAULT:
            self.clear()

    def clear(self) -> None:
        """Begins anew."""
        self.level, self._sum = Level.UNKNOWN, 0.0
