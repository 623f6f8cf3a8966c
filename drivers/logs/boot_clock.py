"""Clocks of logs that count from the start of the autopilot."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

SINCE_BOOT = "since boot"
BY_GPS = "GPS"


@dataclass(frozen=True, slots=True)
class BootClock:
    """From an autopilot's time since boot to the times of its log's readings.

    Attributes:
        offset_s: to be added to the time since boot; 0.0 where nobody knows when that was.
        source: who knew the time: `BY_GPS`, or `SINCE_BOOT` where nobody did.

    Raises:
        ValueError: an offset that is not finite.
    """

    offset_s: float = 0.0
    source: str = SINCE_BOOT

    def __post_init__(self) -> None:
        if not isfinite(self.offset_s):
            raise ValueError(f"offset_s = {self.offset_s}: want a finite number")

    @property
    def is_unix(self) -> bool:
        """True where the readings' times are seconds since 1970."""
        return self.source != SINCE_BOOT
