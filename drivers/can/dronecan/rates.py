"""Whether a node babbles: sends more frames than any should.

Eight commands 400 times a second are 1200 frames, twenty are 2400; a bus of 1 Mbit/s holds some 7500. Of what a node
sends, only those frames are seen that the decoder wants: what else it sends shows in the load of the bus.
"""

from __future__ import annotations

from collections import Counter
from math import floor

import numpy as np
from numpy.typing import NDArray

from drivers.bus_readings import BabblingNode
from drivers.can.dronecan.claims import CONFLICT_REPEAT_S
from drivers.can.dronecan.reminder import Reminder
from drivers.can.dronecan.transfer import NODE_ID_MAX

FRAMES_PER_S_MAX = 3000


class FrameRates:
    """Counts the frames of every node, from one full second to the next."""

    def __init__(self) -> None:
        self._second: float | None = None
        self._counts: Counter[int] = Counter()
        self._reminders: dict[int, Reminder] = {}

    def take(self, node: int, time_s: float) -> BabblingNode | None:
        """Takes a frame; what is to be told of its node."""
        second = floor(time_s)
        if second != self._second:
            self._second = second
            self._counts.clear()
        self._counts[node] = count = self._counts[node] + 1
        return self._told(node, time_s) if count == FRAMES_PER_S_MAX + 1 else None

    def take_block(self, nodes: NDArray[np.int64], time_s: NDArray[np.float64]) -> list[tuple[int, BabblingNode]]:
        """Takes (N,) frames; what is to be told, each with the place of its frame, ascending."""
        if not len(nodes):
            return []
        seconds = np.floor(time_s)
        spans = np.cumsum(np.diff(seconds, prepend=seconds[0]) != 0.0)
        before = np.zeros(NODE_ID_MAX + 1, np.int64)
        if seconds[0] == self._second:
            before[list(self._counts)] = list(self._counts.values())
        of_node = spans * (NODE_ID_MAX + 1) + nodes  # a number for each node in each second
        counts = np.bincount(of_node, minlength=(int(spans[-1]) + 1) * len(before))
        counts[: len(before)] += before
        crossed = [
            int(np.flatnonzero(of_node == one)[FRAMES_PER_S_MAX - (before[one] if one < len(before) else 0)])
            for one in np.flatnonzero(counts > FRAMES_PER_S_MAX)
            if one >= len(before) or before[one] <= FRAMES_PER_S_MAX
        ]
        last = counts[-len(before) :]
        self._second = float(seconds[-1])
        self._counts = Counter({int(node): int(last[node]) for node in np.flatnonzero(last)})
        told = ((place, self._told(int(nodes[place]), float(time_s[place]))) for place in sorted(crossed))
        return [(place, reading) for place, reading in told if reading is not None]

    def _told(self, node: int, time_s: float) -> BabblingNode | None:
        reminder = self._reminders.setdefault(node, Reminder(CONFLICT_REPEAT_S))
        return BabblingNode(time_s, node, FRAMES_PER_S_MAX) if reminder.due(node, time_s) else None
