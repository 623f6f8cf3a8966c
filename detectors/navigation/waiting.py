"""Measurements that wait until the filter, which runs behind, has come to their instants."""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable
from math import inf

from detectors.navigation.innovation import KINDS, Measurement
from detectors.navigation.sample import AttitudeSample

WAITING_MAX = 64  # measurements of a kind, while the IMU is silent
# Headings of another system err for long in the same way: more of them say no more.
HEADING_S = 1.0


class WaitingMeasurements:
    """One queue for each kind, for each has its own delay.

    Attributes:
        refused: measurements that were not kept, by cause.
    """

    def __init__(self) -> None:
        self.refused: Counter[str] = Counter()
        self._queues: dict[type[Measurement], deque[Measurement]] = {kind: deque() for kind in KINDS}
        self._heading_s = -inf

    def add(self, measurement: Measurement) -> None:
        """Keeps a measurement, the newest of its kind; where there are too many, the oldest is dropped."""
        if isinstance(measurement, AttitudeSample):
            if measurement.time_s - self._heading_s < HEADING_S:
                return
            self._heading_s = measurement.time_s
        queue = self._queues[type(measurement)]
        if len(queue) == WAITING_MAX:
            queue.popleft()
            self.refused["measurement while the IMU was silent"] += 1
        queue.append(measurement)

    def due(self, until_s: float, delay_s: Callable[[type[Measurement]], float]) -> Measurement | None:
        """The next measurement whose instant is before; it waits no longer.

        Args:
            until_s: instant that the filter has come to.
            delay_s: by which a kind's stamps are later than what was measured.
        """
        first_s, first = inf, None
        for kind, queue in self._queues.items():
            if queue and (instant_s := queue[0].time_s - delay_s(kind)) < min(first_s, until_s):
                first_s, first = instant_s, kind
        return None if first is None else self._queues[first].popleft()

    def clear(self) -> None:
        """Forgets them all."""
        for queue in self._queues.values():
            queue.clear()
