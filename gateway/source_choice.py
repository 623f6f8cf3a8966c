"""Where several sources say the same thing, one of them is listened to, and kept for as long as it lives.

The best one alive is chosen, `CHOICE_S` after the first was heard, for the better one may need some time to begin. It
stays until it has been silent for `SILENT_S`: two units differ by their offsets, so that each switch is a step.
"""

from __future__ import annotations

from collections.abc import Sequence

CHOICE_S = 2.0
SILENT_S = 10.0


class SourceChoice:
    """Names of sources in, whether to listen out.

    Args:
        ranked: kinds that may be chosen, the best first. The kind of a source is the first word of its name.

    Attributes:
        chosen: the source that is listened to; None before there is one.
    """

    def __init__(self, ranked: Sequence[str]) -> None:
        self.chosen: str | None = None
        self._ranked = tuple(ranked)
        self._heard_s: dict[str, float] = {}
        self._first_s: float | None = None

    def wants(self, source: str) -> bool:
        """Whether this source may be chosen at all."""
        return source.partition(" ")[0] in self._ranked

    def hears(self, source: str, time_s: float) -> bool:
        """Takes that a source said something; True where it is the one to listen to."""
        if not self.wants(source):
            return False
        self._heard_s[source] = time_s
        self._first_s = time_s if self._first_s is None else self._first_s
        if self.chosen is not None and not self._alive(self.chosen, time_s):
            self.chosen = None
        if self.chosen is None and (len(self._ranked) == 1 or time_s - self._first_s >= CHOICE_S):
            self.chosen = min((one for one in self._heard_s if self._alive(one, time_s)), key=self._rank)
        return source == self.chosen

    def _alive(self, source: str, time_s: float) -> bool:
        return time_s - self._heard_s[source] <= SILENT_S

    def _rank(self, source: str) -> tuple[int, str]:
        return self._ranked.index(source.partition(" ")[0]), source
