"""Who speaks for what: one node for each ESC index, and one that commands.

The first node that speaks has the claim until it is silent for longer than a node may be: then another may take its
place, as that of an ESC that was changed or that restarted with another node id. Where two speak at the same time,
nobody can tell which of them is right: the first goes on being believed, and that there is a rival is told.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from drivers.can.dronecan.reminder import Reminder

# A node is offline after this silence (DroneCAN NodeStatus.OFFLINE_TIMEOUT_MS), and another may take its place.
NODE_TIMEOUT_S = 3.0
CONFLICT_REPEAT_S = 10.0


@dataclass(frozen=True, slots=True)
class Admissions:
    """What a claim makes of N messages.

    Attributes:
        admitted: (N,) whether each is to be believed.
        handovers: (place, node) of each message from which on another node has the claim.
        contests: (place, nodes) of what is to be told.
    """

    admitted: NDArray[np.bool_]
    handovers: list[tuple[int, int]]
    contests: list[tuple[int, tuple[int, ...]]]


class Claim:
    """One thing that one node may speak for.

    Args:
        node_id: the only node that may; None: the first that does.

    Attributes:
        node_id: as given.
        owner: who speaks for it; None: nobody yet.
        rivals: when other nodes spoke for it, while the owner was not offline.
    """

    __slots__ = ("_last_s", "_reminder", "node_id", "owner", "rivals")

    def __init__(self, node_id: int | None = None) -> None:
        self.node_id = self.owner = node_id
        self.rivals: dict[int, float] = {}
        self._last_s = -inf
        self._reminder = Reminder(CONFLICT_REPEAT_S)

    def admits(self, node: int, time_s: float) -> bool:
        """Whether a node that speaks is the one to be believed."""
        if node != self.owner:
            if self._held(time_s):
                self.rivals[node] = time_s
                return False
            self.owner = node
            self.rivals.pop(node, None)
        self._last_s = time_s
        return True

    def contested(self, node: int, time_s: float) -> tuple[int, ...]:
        """Who speaks for it, ascending, where that is more than one and is to be told now; else empty.

        To be asked after `admits`, of the same node, while there are rivals. One that speaks once while the owner is
        silent may be its successor: there is a conflict when the owner speaks again. The wrong node is one at once.
        """
        others = [rival for rival, spoke_s in self.rivals.items() if _of_late(spoke_s, time_s)]
        if not others:
            self.rivals.clear()
            self._reminder.over()
            return ()
        if self.node_id is None and node != self.owner:
            return ()
        owner = [self.owner] if self.owner is not None and _of_late(self._last_s, time_s) else []
        nodes = tuple(sorted(owner + others))
        return nodes if self._reminder.due(nodes, time_s) else ()

    def admit(self, nodes: NDArray[np.int64], time_s: NDArray[np.float64]) -> Admissions:
        """Takes (N,) messages at once; N is not 0."""
        node = int(nodes[0])
        if not self.rivals and self.owner in (None, node) and bool((nodes == node).all()):
            handovers = [] if self.owner == node else [(0, node)]
            self.admits(node, float(time_s[-1]))
            return Admissions(np.ones(len(nodes), np.bool_), handovers, [])
        return self._one_by_one(nodes.tolist(), time_s.tolist())

    def _one_by_one(self, nodes: list[int], times_s: list[float]) -> Admissions:
        taken = Admissions(np.zeros(len(nodes), np.bool_), [], [])
        for place, (node, time_s) in enumerate(zip(nodes, times_s, strict=True)):
            owner = self.owner
            taken.admitted[place] = self.admits(node, time_s)
            if self.owner != owner:
                taken.handovers.append((place, node))
            if self.rivals and (contest := self.contested(node, time_s)):
                taken.contests.append((place, contest))
        return taken

    def _held(self, time_s: float) -> bool:
        return self.node_id is not None or (self.owner is not None and _of_late(self._last_s, time_s))


def _of_late(spoke_s: float, time_s: float) -> bool:
    return 0.0 <= time_s - spoke_s < NODE_TIMEOUT_S
