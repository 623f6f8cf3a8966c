"""So many in a second and no more: what somebody else sends must not decide how much we say."""

from __future__ import annotations

from collections import deque

PERIOD_S = 1.0


class RateLimit:
    """Admits at most so many in any second.

    Args:
        per_second: how many.

    Raises:
        ValueError: not at least one.
    """

    def __init__(self, per_second: int) -> None:
        if per_second < 1:
            raise ValueError(f"per_second must be at least 1, got {per_second}")
        self._admitted_s: deque[float] = deque(maxlen=per_second)

    def admits(self, time_s: float) -> bool:
        """Whether one more may be at this time; one that may not does not count."""
        full = len(self._admitted_s) == self._admitted_s.maxlen
        if full and 0.0 <= time_s - self._admitted_s[0] < PERIOD_S:
            return False
        self._admitted_s.append(time_s)
        return True
