"""New, repeated or late: told from the sender's own time stamps, for they survive any route that a packet takes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Hashable

WRAP_MS = 2**32
# A stamp that went forward by less than this did not wrap: the usual case, told at once.
NEWS_MAX = 2**31
# Between two messages of one autopilot the stamps may be out of order by the time that a packet waits somewhere.
LATE_S = 1.0


class Freshness:
    """Refuses messages that were there before: two routes to one vehicle deliver everything twice, UDP out of order.

    Args:
        drops: counted here: "repeated", "late".

    Attributes:
        stamps: the newest of each stream.
    """

    def __init__(self, drops: Counter[str]) -> None:
        self._drops = drops
        self.stamps: dict[Hashable, int] = {}

    def accepts(self, stream: Hashable, stamp: int, *, ticks_per_s: int, bits: int = 32) -> bool:
        """Whether this message is news.

        Args:
            stream: what the stamps belong to: a message id, or a part of one.
            stamp: the sender's time; 0 is a sender without a clock, and always accepted.
            ticks_per_s: unit of the stamp.
            bits: width of the stamp, which wraps: microseconds in 32 bits do so every 72 minutes.
        """
        previous = self.stamps.get(stream)
        if stamp and previous is not None and not previous < stamp < previous + NEWS_MAX:
            behind = (previous - stamp) % 2**bits
            if behind < LATE_S * ticks_per_s:
                self._drops["late" if behind else "repeated"] += 1
                return False
        self.stamps[stream] = stamp
        return True


class BootWatch:
    """Notices that the autopilot restarted: its time since boot went back.

    Attributes:
        latest_ms: the newest time since boot, of any message.
    """

    def __init__(self) -> None:
        self.latest_ms = 0

    def rebooted(self, boot_ms: int) -> bool:
        """Take the next `time_boot_ms` of any message; True once per restart."""
        if boot_ms >= self.latest_ms:
            self.latest_ms = boot_ms
            return False
        behind_s = (self.latest_ms - boot_ms) / 1000.0
        if 0.0 <= behind_s <= LATE_S:
            return False
        wrapped = behind_s > (WRAP_MS - 60_000) / 1000.0  # after 49.7 days
        self.latest_ms = boot_ms
        return behind_s > LATE_S and not wrapped
