"""What is on its way along a CAN wire: late frames, those that contend with a babbler's, a controller's bus-off."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from heapq import heappop, heappush
from math import inf

from drivers.can.frame import CanFrame
from drivers.can.load import BitRates
from hil_tests.scenario.fault import Fault
from hil_tests.wires.arbitration import SharedBus
from hil_tests.wires.frame_faults import Due
from hil_tests.wires.stretches import Stretches
from hil_tests.wires.way import Passed, Towards

# Error classes of Linux include/uapi/linux/can/error.h; drivers send them with 8 bytes, here of zeros.
BUS_OFF, RESTARTED = 0x40, 0x100
ERROR_DATA = bytes(8)


class Arrivals:
    """Frames from when they are sent to when they arrive, each stamped with that.

    Args:
        faults: of the bus; it is "babbling" and "bus_off" that it acts on.
        start_s: what their times are counted from, unix seconds.
        rates: of the bus.
        counts: what they do is counted here.

    Attributes:
        open_until_s: until then nothing is on its way or in the way, so that frames need not come through here.
    """

    def __init__(self, faults: Sequence[Fault], start_s: float, rates: BitRates, counts: Counter[str]) -> None:
        babblers = [one for one in faults if one.failure == "babbling"]
        self._bus_off = [one for one in faults if one.failure == "bus_off"]
        self._start_s = start_s
        self._counts = counts
        self._shared = SharedBus(babblers, start_s, rates, counts)
        self._closed = Stretches(start_s, [*babblers, *self._bus_off])
        self._under_way: list[tuple[float, int, Due]] = []  # a heap: arrival, order
        self._entered = 0
        self.open_until_s = self._closed.next_s(-inf)
        self._tell_of_bus_off()

    def put(self, due: Due) -> None:
        """A frame, to arrive at `due.at_s` at the earliest."""
        heappush(self._under_way, (due.at_s, self._entered, due))
        self._entered += 1
        self.open_until_s = min(self.open_until_s, due.at_s)

    def due(self, time_s: float) -> list[Passed[CanFrame]]:
        """What has arrived by now, in order of arrival."""
        if time_s < self.open_until_s:
            return []
        while self._under_way and self._under_way[0][0] <= time_s:
            self._shared.put(heappop(self._under_way)[2])
        through = self._shared.due(time_s)
        under_way_s = self._under_way[0][0] if self._under_way else inf
        self.open_until_s = -inf if self._shared.busy(time_s) else min(under_way_s, self._closed.next_s(time_s))
        return [Passed(due.frame, due.towards) for due in through if due.frame.error or not self._is_missed(due)]

    def next_s(self) -> float:
        """When more arrives; infinity: nothing is on its way."""
        return min(self._under_way[0][0] if self._under_way else inf, self._shared.next_s())

    def bus_off(self, time_s: float) -> bool:
        """Whether the gateway's controller is bus-off then."""
        return any(fault.active(time_s - self._start_s) for fault in self._bus_off)

    def _is_missed(self, due: Due) -> bool:
        """By a gateway whose controller is bus-off; the ESCs have controllers of their own."""
        missed = due.towards is Towards.AUTOPILOT and self.bus_off(due.at_s)
        if missed:
            self._counts["frames lost while bus-off"] += 1
        return missed

    def _tell_of_bus_off(self) -> None:
        """What the gateway's controller is going to report."""
        for fault in self._bus_off:
            for since_s, what in ((fault.at_s, BUS_OFF), (fault.until_s, RESTARTED)):
                if since_s < inf:
                    at_s = self._start_s + since_s
                    told = CanFrame(at_s, what, ERROR_DATA, extended=False, error=True)
                    self.put(Due(at_s, told, Towards.AUTOPILOT))
