"""How many a second come over each link, from counts that are seen now and then."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping

from gateway.telemetry import Telemetry

# long enough for a steady number, short enough to see a link stop
WINDOW_S = 3.0


class Rates:
    """One telemetry after the other in, rates by link out."""

    def __init__(self) -> None:
        self._seen: deque[tuple[float, dict[str, int]]] = deque()

    def take(self, telemetry: Telemetry) -> Mapping[str, float]:
        """What came over each link, by second, over the last seconds; none of a link before it was seen twice."""
        received = {link.name: link.received for link in telemetry.links}
        if self._seen and _begins_anew(self._seen[-1], telemetry.time_s, received):
            self._seen.clear()
        if not self._seen or telemetry.time_s > self._seen[-1][0]:
            self._seen.append((telemetry.time_s, received))
        while len(self._seen) > 2 and self._seen[1][0] <= telemetry.time_s - WINDOW_S:
            self._seen.popleft()
        (first_s, before), (last_s, now) = self._seen[0], self._seen[-1]
        if last_s <= first_s:
            return {}
        return {link: (count - before[link]) / (last_s - first_s) for link, count in now.items() if link in before}


def _begins_anew(last: tuple[float, dict[str, int]], time_s: float, received: Mapping[str, int]) -> bool:
    """A gateway that was started again counts from zero."""
    last_s, before = last
    return time_s < last_s or any(received.get(link, count) < count for link, count in before.items())
