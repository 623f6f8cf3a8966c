"""A sender's own clock brought onto ours: the jitter of the link between the two goes, their drift is followed.

A message arrives late by what it waits in queues, which differs from one to the next by tens of milliseconds on a
telemetry link; the sender's stamp is even. Reception minus stamp is the offset of the clocks plus that delay, so its
least value of late is the offset plus the shortest delay, which hardly changes. (So do NTP's clock filter and
MAVLink's time synchronisation in PX4 choose their samples.)

What is given out follows that least value, but no faster than `SLEW`: times that rise on the sender's clock rise
here, too, and no interval is wrong by more than that share. A clock that begins anew (a restart of the sender) or
leaps ahead is followed at once, and counted; a message that was held up for long is no such leap. At once goes, too,
what was learnt from a message that had waited for long, as those do that wait for a link to open: then times may go
back.
"""

from __future__ import annotations

from collections import deque

# Two quartz clocks that differ by 50 ppm part by 1.5 ms in this time.
WINDOW_S = 30
SLEW = 0.02
STEP_S = 0.1
# Messages do not overtake each other by as much.
LEAP_S = 5.0


class ClockOffset:
    """Stamps of one sender in, times on our clock out.

    Attributes:
        leaps: how often the sender's clock began anew or leapt.
    """

    def __init__(self) -> None:
        self.leaps = 0
        self._offset_s = 0.0
        self._newest_boot_s: float | None = None
        # least offset of each second of reception, oldest first
        self._least: deque[tuple[int, float]] = deque()

    def time_s(self, boot_s: float, received_s: float) -> float:
        """When, on our clock, the sender stamped a message.

        Args:
            boot_s: its stamp.
            received_s: reception; of successive messages in any order.

        Returns:
            Reception at the latest, but for the first seconds, in which the shortest delay is still looked for.
        """
        newest_boot_s, offset_s = self._newest_boot_s, received_s - boot_s
        if newest_boot_s is None:
            self._begin(boot_s, received_s)
        elif boot_s < newest_boot_s - LEAP_S or offset_s < self._offset_s - LEAP_S:
            self._leap(boot_s, received_s)
        else:
            self._hear(offset_s, received_s)
            wanted_s = min(least_s for _, least_s in self._least) - self._offset_s
            if wanted_s > LEAP_S:  # for a whole window: the sender's clock stood still
                self._leap(boot_s, received_s)
            elif boot_s > newest_boot_s:
                self._follow(wanted_s, boot_s - newest_boot_s)
                self._newest_boot_s = boot_s
        return boot_s + self._offset_s

    def _begin(self, boot_s: float, received_s: float) -> None:
        self._offset_s, self._newest_boot_s = received_s - boot_s, boot_s
        self._least = deque([(int(received_s), self._offset_s)])

    def _leap(self, boot_s: float, received_s: float) -> None:
        self.leaps += 1
        self._begin(boot_s, received_s)

    def _hear(self, offset_s: float, received_s: float) -> None:
        second, least_s = self._least[-1]
        if received_s < second + 1:
            self._least[-1] = (second, min(least_s, offset_s))
        else:
            self._least.append((int(received_s), offset_s))
        while self._least[0][0] < received_s - WINDOW_S:
            self._least.popleft()

    def _follow(self, wanted_s: float, passed_s: float) -> None:
        most_s = SLEW * passed_s
        self._offset_s += wanted_s if wanted_s < -STEP_S else max(-most_s, min(wanted_s, most_s))
