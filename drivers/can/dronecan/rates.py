"""Whether a node babbles: sends more frames than any should.

Eight commands 400 times a second are 1200 frames, twenty are 2400; a bus of 1 Mbit/s holds some 7500. Of what a node
sends, only those frames are seen that the decoder wants: what else it sends shows in the load of the bus.
"""

from __future__ import annotations

from math import floor

import numpy as np
from numpy.typing import NDArray

from drivers.bus_readings import BabblingNode
from drivers.can.dronecan.claims import CONFLICT_REPEAT_S
from drivers.can.dronecan.reminder import Reminder
from drivers.can.dronecan.transfer import NODE_ID_MAX

FRAMES_PER_S_MAX = 3000
# frames to a second, in the mean, from which on they are counted all at once
SPANS_SHARE = 10


class FrameRates:
    """Counts the frames of every node, from one full second to the next."""

    def __init__(self) -> None:
        self._second: float | None = None
        self._counts = [0] * (NODE_ID_MAX + 1)
        self._reminders: dict[int, Reminder] = {}

    def take(self, node: int, time_s: float) -> BabblingNode | None:
        """Takes a frame; what is to be told of its node."""
        second = floor(time_s)
        if second != self._second:
            self._second = second
            self._counts = [0] * (NODE_ID_MAX + 1)
        self._counts[node] = count = self._counts[node] + 1
        return self._told(node, time_s) if count == FRAMES_PER_S_MAX + 1 else None

    def take_block(self, nodes: NDArray[np.int64], time_s: NDArray[np.float64]) -> list[tuple[int, BabblingNode]]:
        """Takes (N,) frames; what is to be told, each with the place of its frame, ascending."""
        if not len(nodes):
            return []
        seconds = np.floor(time_s)
        spans = np.cumsum(np.diff(seconds, prepend=seconds[0]) != 0.0)
        if len(nodes) < SPANS_SHARE * int(spans[-1]):  # a clock that jumps: no table of all seconds for so few frames
            return self._one_by_one(nodes, time_s)
        before = np.array(self._counts if seconds[0] == self._second else [0] * (NODE_ID_MAX + 1))
        of_node = spans * len(before) + nodes  # a number for each node in each second
        counts = np.bincount(of_node, minlength=(int(spans[-1]) + 1) * len(before))
        counts[: len(before)] += before
        self._second, self._counts = float(seconds[-1]), counts[-len(before) :].tolist()
        crossed = []
        for one in np.flatnonzero(counts > FRAMES_PER_S_MAX).tolist():
            earlier = int(before[one]) if one < len(before) else 0
            if earlier <= FRAMES_PER_S_MAX:
                crossed.append(int(np.flatnonzero(of_node == one)[FRAMES_PER_S_MAX - earlier]))
        told = ((place, self._told(int(nodes[place]), float(time_s[place]))) for place in sorted(crossed))
        return [(place, reading) for place, reading in told if reading is not None]

    def _one_by_one(self, nodes: NDArray[np.int64], time_s: NDArray[np.float64]) -> list[tuple[int, BabblingNode]]:
        told = (self.take(*frame) for frame in zip(nodes.tolist(), time_s.tolist(), strict=True))
        return [(place, reading) for place, reading in enumerate(told) if reading is not None]

    def _told(self, node: int, time_s: float) -> BabblingNode | None:
        reminder = self._reminders.setdefault(node, Reminder(CONFLICT_REPEAT_S))
        return BabblingNode(time_s, node, FRAMES_PER_S_MAX) if reminder.due(node, time_s) else None
