"""The state of a bus as its frames tell it, live and in a log: error frames, and data after a bus-off."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from drivers.can.error_frame import BusCondition, condition
from drivers.can.frame import CanFrame
from drivers.can.frame_block import ERROR, FrameBlock

# What a condition means for the link: (up, detail). Other conditions are counted only.
_STATES = {
    BusCondition.BUS_OFF: (False, "bus-off (back by restart-ms only)"),
    BusCondition.RESTARTED: (True, ""),
    BusCondition.ACTIVE: (True, ""),
    BusCondition.PASSIVE: (True, BusCondition.PASSIVE.value),
    BusCondition.WARNING: (True, BusCondition.WARNING.value),
}


@dataclass(frozen=True, slots=True)
class BusChange:
    """A bus is in another state than before.

    Attributes:
        row: of the frame in its block that shows it.
        up, detail: as in `LinkState`.
    """

    row: int
    up: bool
    detail: str


class BusState:
    """Follows a bus.

    Args:
        counters: error frames are counted here by what they say.
    """

    def __init__(self, counters: Counter[str]) -> None:
        self._counters = counters
        self._known: tuple[bool, str] | None = None

    def becomes(self, up: bool, detail: str) -> bool:
        """Takes a state; whether it is another than before."""
        before, self._known = self._known, (up, detail)
        return before != self._known

    def changes(self, frames: FrameBlock) -> list[BusChange]:
        """What frames change, in their order; the first state is a change, too, but not that data comes."""
        errors = np.flatnonzero(frames.kind & ERROR)
        if not len(errors) and self._alive() is None:
            return []
        # a state only changes with an error frame, and with the first data after it
        rows = np.union1d([0], [errors, errors + 1]).astype(np.intp)
        rows = rows[rows < len(frames)]
        told = zip(rows.tolist(), frames.part(rows).frames(), strict=True)
        return [change for row, frame in told for change in self._told(row, frame)]

    def _told(self, row: int, frame: CanFrame) -> Iterator[BusChange]:
        state = self._said(frame) if frame.error else self._alive()
        if state is not None and self.becomes(*state):
            yield BusChange(row, *state)

    def _said(self, frame: CanFrame) -> tuple[bool, str] | None:
        said = condition(frame)
        self._counters[said.value] += 1
        return _STATES.get(said)

    def _alive(self) -> tuple[bool, str] | None:
        """Data frames come: some drivers restart after bus-off without a word."""
        return (True, "") if self._known is not None and not self._known[0] else None
