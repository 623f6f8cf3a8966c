"""TIMESYNC both ways: how far our clock is from the autopilot's, and an answer for whoever asks how far his is.

One exchange: we ask at `t0` by our clock, the autopilot answers with its own time `tb`, and that is here at `t1`. Its
`tb` was somewhere between the two, so the offset of the clocks is `(t0 + t1) / 2 - tb`, wrong by at most half of the
round trip `t1 - t0` (Cristian 1989, section 4). Of the last exchanges the one that bounds this error best is
believed, as in NTP's clock filter (RFC 5905, section 10), with the clocks' drift since.

An answer that cannot be true together with the one believed, by the bounds of both, says that a clock stepped (the
autopilot restarted): all before it is forgotten. ArduPilot adds its system id to its nanoseconds, which is nothing.
"""

from __future__ import annotations

from collections import Counter, deque
from dataclasses import dataclass
from math import inf

from drivers.mavlink.autopilot import AUTOPILOT_COMPONENT
from drivers.mavlink.formats import TIMESYNC
from drivers.mavlink.frames import Packet
from drivers.mavlink.messages import TimeSync
from drivers.mavlink.rate import RateLimit
from drivers.readings import AutopilotClock

PERIOD_S = 5.0
WINDOW = 12  # a minute of exchanges
ROUND_TRIP_MAX_S = 2.0
# PX4 asks ten times a second; five of its kind may.
ANSWERS_MAX = 50
DRIFT = 100e-6  # two poor quartz clocks against each other
MARGIN_S = 0.001  # what it takes to read a clock and to get the packet out


@dataclass(frozen=True, slots=True)
class _Exchange:
    at_s: float
    offset_s: float
    round_trip_s: float

    def error_s(self, time_s: float) -> float:
        """The most by which its offset can be wrong at a later time."""
        return self.round_trip_s / 2.0 + DRIFT * (time_s - self.at_s)


class Timesync:
    """Exchanges with one autopilot.

    Args:
        own_component: our component id.
        drops: counted here by cause.
    """

    def __init__(self, own_component: int, drops: Counter[str]) -> None:
        self._own_component = own_component
        self._drops = drops
        self._asked_s = -inf
        self._system: int | None = None
        self._open: deque[int] = deque(maxlen=4)
        self._exchanges: deque[_Exchange] = deque(maxlen=WINDOW)
        self._answers = RateLimit(ANSWERS_MAX)

    def question(self, own_system: int, time_s: float) -> TimeSync | None:
        """What to send to the autopilot now, at once: a question each 5 s, else None."""
        if 0.0 <= time_s - self._asked_s < PERIOD_S:
            return None
        self._asked_s = time_s
        question = TimeSync(0, round(time_s * 1e9), own_system, AUTOPILOT_COMPONENT)
        self.asked(question.asked_ns)
        return question

    def asked(self, asked_ns: int) -> None:
        """A question with this time of ours went out: its answer is waited for."""
        self._open.append(asked_ns)

    def take(self, packet: Packet, own_system: int | None, time_s: float) -> AutopilotClock | TimeSync | None:
        """What comes of a TIMESYNC: the newest of the autopilot's clock, an answer to send, or nothing.

        Args:
            packet: from anybody but ourselves.
            own_system: ours and the autopilot's, None before it is known.
            time_s: reception.
        """
        answered_ns, asked_ns, system, component = TIMESYNC.unpack(packet.payload)
        if system not in (0, own_system) or component not in (0, self._own_component):
            return None
        if answered_ns == 0:
            return self._answer(packet, asked_ns, time_s)
        if (packet.system_id, packet.component_id) != (own_system, AUTOPILOT_COMPONENT):
            return None  # the answer to somebody else's question, or somebody else's answer to ours
        if asked_ns not in self._open:
            return None
        self._open.remove(asked_ns)  # by another route it comes again, and later
        return self._exchanged(packet.system_id, asked_ns / 1e9, answered_ns / 1e9, time_s)

    def _answer(self, packet: Packet, asked_ns: int, time_s: float) -> TimeSync | None:
        if not self._answers.admits(time_s):
            self._drops[f"TIMESYNC beyond {ANSWERS_MAX} a second"] += 1
            return None
        return TimeSync(round(time_s * 1e9), asked_ns, packet.system_id, packet.component_id)

    def _exchanged(self, system: int, asked_s: float, boot_s: float, time_s: float) -> AutopilotClock | None:
        round_trip_s = time_s - asked_s
        if not (0.0 <= round_trip_s <= ROUND_TRIP_MAX_S and boot_s > 0.0):
            self._drops["implausible TIMESYNC answer"] += 1
            return None
        newest = _Exchange(time_s, (asked_s + time_s) / 2.0 - boot_s, round_trip_s)
        if system != self._system or self._contradicts(newest):
            self._exchanges.clear()
        self._system = system
        self._exchanges.append(newest)
        best = min(self._exchanges, key=lambda exchange: exchange.error_s(time_s))
        return AutopilotClock(time_s, boot_s, system, best.offset_s, best.round_trip_s)

    def _contradicts(self, newest: _Exchange) -> bool:
        return any(
            abs(newest.offset_s - before.offset_s)
            > before.error_s(newest.at_s) + newest.round_trip_s / 2.0 + MARGIN_S
            for before in self._exchanges
        )
