"""The stretches of time in which faults have to be thought of, so that nobody has to in between."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

from hil_tests.scenario.fault import Fault

# So long before an onset true values are watched: what is stuck is the newest of them.
WATCHED_S = 2.0
# ... and so long after an end, for times in unix seconds are rounded to fractions of a microsecond
BEYOND_S = 0.001


class Stretches:
    """When faults are watched for.

    Args:
        start_s: what their times are counted from, unix seconds.
        faults: whose.
    """

    def __init__(self, start_s: float, faults: Sequence[Fault]) -> None:
        self._stretches = [(start_s + one.at_s - WATCHED_S, start_s + one.until_s + BEYOND_S) for one in faults]
        self._next_s, self._from_s, self._until_s = 0.0, inf, -inf

    def next_s(self, time_s: float) -> float:
        """When the next one begins; minus infinity within one, infinity after the last."""
        if not self._from_s <= time_s < self._until_s:
            self._look(time_s)
        return self._next_s

    def _look(self, time_s: float) -> None:
        """Until when the answer stays what it is now."""
        edges = [edge for stretch in self._stretches for edge in stretch]
        self._from_s = max((edge for edge in edges if edge <= time_s), default=-inf)
        self._until_s = min((edge for edge in edges if edge > time_s), default=inf)
        within = any(from_s <= time_s < until_s for from_s, until_s in self._stretches)
        begin_s = min((from_s for from_s, _ in self._stretches if from_s > time_s), default=inf)
        self._next_s = -inf if within else begin_s
