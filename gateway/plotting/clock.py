"""Times of a dive as people say them."""

from __future__ import annotations

HOUR_S = 3600.0


def clock(since_s: float) -> str:
    """Time since the start, as a stop watch shows it: "0:25", "12:04.31", "1:05:00"."""
    minutes, seconds = divmod(round(abs(since_s), 2), 60.0)
    sign = "-" if since_s < 0.0 else ""
    hours, minutes = divmod(int(minutes), 60)
    told = f"{hours}:{minutes:02d}" if hours else f"{minutes}"
    return _short(f"{sign}{told}:{seconds:05.2f}")


def lasting(seconds: float) -> str:
    """A stretch of time: "0.31 s", "2 s"."""
    return _short(f"{seconds:.2f}") + " s"


def _short(text: str) -> str:
    return text.rstrip("0").rstrip(".")
