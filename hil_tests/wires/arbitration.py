"""A CAN bus that a babbling node shares with all others: who speaks first, and who never does.

While nobody babbles, frames pass at once: the bus that they came from has arbitrated them already. While somebody
does, they contend with his: whenever the bus is free, the frame with the lowest identifier of those that wait is
sent, and takes as long as its bits do. A frame that has waited too long is given up by its node.

Source: ISO 11898-1, bitwise arbitration; the bits of a frame as in `drivers.can.load`.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Sequence
from heapq import heapify, heappop, heappush
from math import inf, nextafter

from drivers.can.frame import CanFrame
from drivers.can.load import BitRates, byte_s, overhead_s
from hil_tests.scenario.fault import Fault
from hil_tests.wires.frame_faults import Due
from hil_tests.wires.way import Towards

# A node gives a frame up that could not be sent for so long: what comes later is newer.
GIVEN_UP_S = 0.02
BABBLE = bytes(8)
EXTENDED_BITS = 18  # that a long identifier has beyond a short one


def priority(frame: CanFrame) -> int:
    """What arbitration compares, the lowest wins: a short identifier before a long one that begins with it."""
    if frame.extended:
        base, rest = divmod(frame.identifier, 1 << EXTENDED_BITS)
        return (base << 1 | 1) << EXTENDED_BITS | rest
    return frame.identifier << EXTENDED_BITS + 1


class SharedBus:
    """The bus between both ends of a wire.

    Args:
        babblers: faults, "babbling", of this bus.
        start_s: what the times of faults are counted from, unix seconds.
        rates: of the bus.
        counts: frames of babblers that were sent, and others' that were given up, are counted here.
    """

    def __init__(self, babblers: Sequence[Fault], start_s: float, rates: BitRates, counts: Counter[str]) -> None:
        self._rates = rates
        self._counts = counts
        self._babblers = [_Babbler(fault, start_s) for fault in babblers]
        self._waiting: list[tuple[int, int, Due]] = []  # a heap: priority, order, frame and when it began to wait
        self._entered = 0
        self._free_s = -inf
        self._sent: deque[Due] = deque()

    def busy(self, time_s: float) -> bool:
        """Whether frames have to contend, or some are not through yet."""
        return bool(self._sent) or self._contended(time_s)

    def put(self, due: Due) -> None:
        """A frame that a node would send at `due.at_s`, which does not go back."""
        self._run(due.at_s)
        if due.frame.error or not self._contended(due.at_s):
            self._sent.append(due)
            return
        heappush(self._waiting, (priority(due.frame), self._entered, due))
        self._entered += 1

    def due(self, time_s: float) -> list[Due]:
        """What is through by now."""
        self._run(nextafter(time_s, inf))  # also what begins now
        through = []
        while self._sent and self._sent[0].at_s <= time_s:
            through.append(self._sent.popleft())
        return through

    def next_s(self) -> float:
        """When something happens by itself."""
        if self._sent:
            return self._sent[0].at_s
        return self._start_s()

    def _contended(self, time_s: float) -> bool:
        taken = bool(self._waiting) or time_s < self._free_s
        return taken or any(one.talks(time_s) for one in self._babblers)

    def _start_s(self) -> float:
        """When the next frame begins; infinity: there is none."""
        waits_s = min((due.at_s for _, _, due in self._waiting), default=inf)
        return max(self._free_s, min([waits_s, *(one.next_s for one in self._babblers)]))

    def _run(self, time_s: float) -> None:
        """Sends all that begins before `time_s`: at that very time more may still come to contend."""
        while (start_s := self._start_s()) < time_s:
            self._give_up(start_s)
            self._send_first(start_s)

    def _give_up(self, start_s: float) -> None:
        patient = [one for one in self._waiting if start_s - one[2].at_s < GIVEN_UP_S]
        if len(patient) < len(self._waiting):
            self._counts["frames driven out by babbling"] += len(self._waiting) - len(patient)
            heapify(patient)
            self._waiting = patient

    def _send_first(self, start_s: float) -> None:
        talking = min(
            (one for one in self._babblers if one.next_s <= start_s), key=lambda one: one.rank, default=None
        )
        if talking is not None and (not self._waiting or talking.rank <= self._waiting[0][0]):
            self._counts["frames babbled"] += 1
            frame = talking.speak(start_s)
            said = [Due(start_s, frame, end) for end in (Towards.AUTOPILOT, Towards.DEVICES)]
        elif self._waiting:
            said = [heappop(self._waiting)[2]]
            frame = said[0].frame
        else:  # nobody is left: those who had waited for this have given up
            return
        self._free_s = start_s + overhead_s(frame, self._rates) + len(frame.data) * byte_s(frame, self._rates)
        self._sent += [one.arriving(self._free_s) for one in said]


class _Babbler:
    """A node that has always something to say.

    Attributes:
        next_s: when it wants to begin its next frame; infinity: no more.
        rank: its frames' priority.
    """

    def __init__(self, fault: Fault, start_s: float) -> None:
        self._fault = fault
        self._start_s = start_s
        self._period_s = 1.0 / fault.values["frames_per_s"]
        self._identifier = int(fault.values["identifier"])
        self.rank = priority(CanFrame(0.0, self._identifier, BABBLE))
        self.next_s = start_s + fault.at_s

    def talks(self, time_s: float) -> bool:
        return self._fault.active(time_s - self._start_s)

    def speak(self, time_s: float) -> CanFrame:
        """Its frame that begins now; what the bus had no room for is not made up for."""
        following_s = self.next_s + self._period_s
        self.next_s = following_s if following_s > time_s else time_s + self._period_s
        if not self.talks(self.next_s):
            self.next_s = inf
        return CanFrame(time_s, self._identifier, BABBLE)
