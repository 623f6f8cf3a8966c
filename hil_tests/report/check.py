"""One thing that was expected of a play, or forbidden, and what came of it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Check:
    """See the module's text.

    Attributes:
        expected: in words, as a pilot would say it: "FAULT of thruster 3 within 2 s of 0:25".
        passed: whether it came about (or, if forbidden, did not).
        seen: what did: "0.31 s after it: T3 entangled? 1486 rpm, want 1619 (-8%)", or what came closest to it.
        time_s: when, in seconds since the start; None: never.
    """

    expected: str
    passed: bool
    seen: str
    time_s: float | None = None
