"""What lasts is said when it begins, or when it becomes another, and again every so often."""

from __future__ import annotations

from collections.abc import Hashable


class Reminder:
    """Decides what is said.

    Args:
        period_s: after which the same is said again.
    """

    __slots__ = ("_period_s", "_said", "_said_s")

    def __init__(self, period_s: float) -> None:
        self._period_s = period_s
        self._said: Hashable = None
        self._said_s = 0.0

    def due(self, what: Hashable, time_s: float) -> bool:
        """Whether this is to be said now: it counts as said then. `what`: anything but None."""
        if what == self._said and 0.0 <= time_s - self._said_s < self._period_s:
            return False
        self._said, self._said_s = what, time_s
        return True

    def over(self) -> None:
        """It is no more: when it comes again, it is new."""
        self._said = None
