"""Texts to the pilot under one rate limit: the gravest first, and of each subject only its newest state.

A bucket of tokens (`burst`, refilled evenly); the last ones are kept for what is an ERROR or worse: the onset of a
fault, and what will be, was or could not be asked of the autopilot, which the pilot must know in time. What has to
wait is not lost: it goes out later, unless its subject has something newer to say by then. The findings have all of
it.
"""

from __future__ import annotations

from dataclasses import dataclass

from drivers.mavlink.messages import StatusText
from gateway.severity import Severity

KEPT_FOR_ERRORS = 2.0


@dataclass(frozen=True, slots=True)
class RateLimit:
    """How many texts may go out.

    Attributes:
        per_minute: in the long run.
        burst: at once, after a quiet time.

    Raises:
        ValueError: a rate not above 0, or a burst that leaves nothing beside what is kept for errors.
    """

    per_minute: float = 30.0
    burst: int = 8

    def __post_init__(self) -> None:
        if not self.per_minute > 0.0:
            raise ValueError(f"per_minute = {self.per_minute!r}: want more than 0")
        if not self.burst > KEPT_FOR_ERRORS:
            raise ValueError(f"burst = {self.burst!r}: want more than {KEPT_FOR_ERRORS:.0f}")


class Announcements:
    """See the module's text."""

    def __init__(self, limit: RateLimit) -> None:
        self._limit = limit
        self._tokens = float(limit.burst)
        self._refilled_s: float | None = None
        self._waiting: dict[str, StatusText] = {}

    def say(self, time_s: float, subject: str, text: StatusText) -> list[StatusText]:
        """Takes a text of a subject; returns what goes out now."""
        self._waiting.pop(subject, None)  # to the end of the queue
        self._waiting[subject] = text
        return self.advance(time_s)

    def withdraw(self, subject: str) -> None:
        """What the subject had to say is no longer so."""
        self._waiting.pop(subject, None)

    def advance(self, time_s: float) -> list[StatusText]:
        """Returns what goes out now."""
        if not self._waiting:
            return []
        self._refill(time_s)
        out: list[StatusText] = []
        for subject, text in sorted(self._waiting.items(), key=lambda item: item[1].severity):  # stable: oldest first
            if self._tokens < 1.0 + (0.0 if text.severity <= Severity.ERROR else KEPT_FOR_ERRORS):
                break
            self._tokens -= 1.0
            out.append(self._waiting.pop(subject))
        return out

    def _refill(self, time_s: float) -> None:
        if self._refilled_s is not None and time_s > self._refilled_s:
            gained = (time_s - self._refilled_s) * self._limit.per_minute / 60.0
            self._tokens = min(self._tokens + gained, float(self._limit.burst))
        self._refilled_s = time_s if self._refilled_s is None else max(time_s, self._refilled_s)
