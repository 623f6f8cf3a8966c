"""When which telemetry is due: the autopilot's side of SET_MESSAGE_INTERVAL."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from math import inf

# A message that is due within this time is due: times are sums of intervals, and rounded.
EARLY_S = 1e-4


class Schedule:
    """The intervals of all messages that can be had.

    Args:
        defaults_s: seconds between two, by message id; infinity: only when asked for.
    """

    def __init__(self, defaults_s: Mapping[int, float]) -> None:
        self._defaults_s = dict(defaults_s)
        self._interval_s: dict[int, float] = {}
        self._next_s: dict[int, float] = {}
        self.forget()

    def forget(self) -> None:
        """All intervals as they are by default, from now on."""
        for message_id, interval_s in self._defaults_s.items():
            self._set(message_id, interval_s)

    def set_interval(self, message_id: int, interval_us: float) -> bool:
        """-1 stops a stream, 0 gives it its default rate back; False for what is never sent, or nonsense."""
        if message_id not in self._defaults_s or not (interval_us >= 0.0 or interval_us == -1.0):
            return False
        special_s = {-1.0: inf, 0.0: self._defaults_s[message_id]}
        self._set(message_id, special_s.get(interval_us, interval_us * 1e-6))
        return True

    def due(self, time_s: float, message_ids: Iterable[int]) -> Iterator[int]:
        """Those of the messages that are due; each is due again an interval after it was."""
        for message_id in message_ids:
            late_s, interval_s = time_s - self._next_s[message_id], self._interval_s[message_id]
            if late_s > -EARLY_S:
                self._next_s[message_id] = time_s + interval_s - (late_s if late_s < interval_s else 0.0)
                yield message_id

    def interval_s(self, message_id: int) -> float:
        """Seconds between two now."""
        return self._interval_s[message_id]

    def _set(self, message_id: int, interval_s: float) -> None:
        self._interval_s[message_id] = interval_s
        self._next_s[message_id] = -inf if interval_s < inf else inf
