"""What a bad link does to datagrams: loss, delay, another order, twice the same, nothing at all for a while.

Pure: datagrams (or whatever stands for them) and the time go in, and come out when it is their time. The same seed
does the same.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from heapq import heappop, heappush
from math import inf, isfinite
from typing import Generic, TypeVar

import numpy as np

Datagram = TypeVar("Datagram")


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkConditions:
    """How bad a link is, each way.

    Attributes:
        loss: share of the datagrams that never arrive.
        duplication: share that arrives twice.
        latency_s: how long each takes.
        jitter_s: up to so much longer, evenly distributed; more than the gap between two makes them overtake.
        reordering: share that is held back for `held_s`, so that later ones overtake it.
        held_s: see there.

    Raises:
        ValueError: a share outside of 0..1, or a time below 0.
    """

    loss: float = 0.0
    duplication: float = 0.0
    latency_s: float = 0.0
    jitter_s: float = 0.0
    reordering: float = 0.0
    held_s: float = 0.1

    def __post_init__(self) -> None:
        for name in ("loss", "duplication", "reordering"):
            if not 0.0 <= getattr(self, name) <= 1.0:
                raise ValueError(f"{name} = {getattr(self, name)!r}: want a share of 0 to 1")
        for name in ("latency_s", "jitter_s", "held_s"):
            if not (isfinite(getattr(self, name)) and getattr(self, name) >= 0.0):
                raise ValueError(f"{name} = {getattr(self, name)!r}: want 0 or more seconds")


IDEAL = LinkConditions()


class Line(Generic[Datagram]):
    """One direction of a link.

    Args:
        conditions: how bad it is; can be set anew at any time.
        seed: of what is lost, late, or twice there.

    Attributes:
        conditions: for what is put in from now on.
        counts: datagrams by what became of them: "passed", "lost", "cut", "duplicated", "held back".
    """

    def __init__(self, conditions: LinkConditions = IDEAL, seed: int = 0) -> None:
        self.conditions = conditions
        self.counts: Counter[str] = Counter()
        self._random = np.random.default_rng(seed)
        self._under_way: list[tuple[float, int, Datagram]] = []
        self._entered = 0
        self._cut_from_s = self._cut_until_s = inf

    def cut(self, from_s: float, until_s: float = inf) -> None:
        """Nothing that is put in between these times arrives."""
        self._cut_from_s, self._cut_until_s = from_s, until_s

    def mend(self) -> None:
        """It is not cut, and will not be."""
        self._cut_from_s = self._cut_until_s = inf

    def put(self, time_s: float, datagram: Datagram) -> None:
        """Send a datagram."""
        if self._cut_from_s <= time_s < self._cut_until_s:
            self.counts["cut"] += 1
            return
        if self._happens(self.conditions.loss):
            self.counts["lost"] += 1
            return
        self._send(time_s, datagram)
        if self._happens(self.conditions.duplication):
            self.counts["duplicated"] += 1
            self._send(time_s, datagram)

    def due(self, time_s: float) -> list[Datagram]:
        """What arrives by now, in its order."""
        arrived = []
        while self._under_way and self._under_way[0][0] <= time_s:
            arrived.append(heappop(self._under_way)[2])
        self.counts["passed"] += len(arrived)
        return arrived

    def next_s(self) -> float:
        """When the next datagram arrives; infinity: none is under way."""
        return self._under_way[0][0] if self._under_way else inf

    def _send(self, time_s: float, datagram: Datagram) -> None:
        conditions = self.conditions
        arrival_s = time_s + conditions.latency_s + conditions.jitter_s * float(self._random.random())
        if self._happens(conditions.reordering):
            self.counts["held back"] += 1
            arrival_s += conditions.held_s
        heappush(self._under_way, (arrival_s, self._entered, datagram))
        self._entered += 1

    def _happens(self, share: float) -> bool:
        return share > 0.0 and float(self._random.random()) < share
