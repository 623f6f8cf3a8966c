"""When something was, so that a later run of the program can tell how long ago: by a clock that nobody sets.

Small computers often have no clock that goes on without power. After a boot they begin where they ended, so their
wall clock makes yesterday look like just now. Within one boot the time since then is certain; across boots no age is.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

BOOT_ID = Path("/proc/sys/kernel/random/boot_id")


@dataclass(frozen=True, slots=True)
class Moment:
    """An instant on this machine.

    Attributes:
        boot: which boot of the machine; empty where the kernel does not say.
        since_boot_s: seconds since then, standby included.
        unix_s: by the wall clock, for people to read.
    """

    boot: str
    since_boot_s: float
    unix_s: float

    def age_s(self, now: Moment) -> float | None:
        """How long ago this was; None where nobody can know, as after a boot."""
        if self.boot != now.boot or not self.since_boot_s <= now.since_boot_s:
            return None
        return now.since_boot_s - self.since_boot_s

    def date(self) -> str:
        """By the wall clock, as far as that can be trusted."""
        try:
            return time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(self.unix_s))
        except (OverflowError, ValueError, OSError):
            return f"{self.unix_s} s"


def present() -> Moment:
    """Now."""
    return Moment(_boot(), time.clock_gettime(time.CLOCK_BOOTTIME), time.time())


def _boot() -> str:
    try:
        return BOOT_ID.read_text(encoding="ascii").strip()
    except (OSError, ValueError):
        return ""
