"""A CAN wire between the autopilot's end of a bus, where the gateway listens as well, and its ESCs, with its faults.

What a frame goes through, in this order: faults of the signals in it, second devices, faults of frames, the bus that
babblers share, and the gateway's controller, which may be bus-off.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from heapq import heappop, heappush
from math import inf
from typing import Protocol

from drivers.can.frame import CanFrame
from hil_tests.scenario.failures import Target
from hil_tests.scenario.fault import Fault
from hil_tests.wires.arbitration import SharedBus
from hil_tests.wires.can_signals import CanSignals
from hil_tests.wires.frame_faults import ALL_NODES, FRAME_FAULTS, Due
from hil_tests.wires.message_edits import MessageEdits
from hil_tests.wires.second_device import SecondNode, SecondSender
from hil_tests.wires.thruster_values import values_of
from hil_tests.wires.transfer_edits import TransferEdits
from hil_tests.wires.way import Passed, Towards

# So long before an onset true values are watched: what is stuck is the newest of them.
WATCHED_S = 2.0
# ... and so long after the end, for times in unix seconds are rounded to fractions of a microsecond
BEYOND_S = 0.001
# Error classes of Linux include/uapi/linux/can/error.h; drivers send them with 8 bytes, here of zeros.
BUS_OFF, RESTARTED = 0x40, 0x100
ERROR_DATA = bytes(8)


class CanWire:
    """A wire as `hil_tests.wires.way.Wire` has it.

    Frames that are late are stamped with as much; those of a DroneCAN transfer that may change come together with its
    last one, for only then its checksum is known. What a signal's fault withholds leaves no hole in transfer ids,
    alive counters and pulse counts: they are renumbered from then on, after the fault's end as well, for a jump back
    would be a fault that nobody has written down.

    Args:
        bus: its name in the gateway's configuration.
        signals: where commands and speeds are in its frames.
        faults: any; those that are neither of this bus nor of a signal on it are left alone.
        start_s: what their times are counted from, unix seconds.
        seed: of all chance.

    Attributes:
        counts: what faults have done, by cause.

    Raises:
        ValueError: a fault of a node on a bus that does not have it.
    """

    def __init__(self, bus: str, signals: CanSignals, faults: Sequence[Fault], start_s: float, seed: int = 0) -> None:
        self.counts: Counter[str] = Counter()
        of_bus = [one for one in faults if one.subject.target is Target.BUS and one.subject.name == bus]
        _refuse_nodes(signals, of_bus)
        self._start_s = start_s
        of_signals = signals.concerned(faults)
        self._edits = _edits(signals, of_signals, seed, self.counts)
        self._stages = [*self._edits, *_bus_stages(signals, of_bus, seed, self.counts)]
        babblers = [one for one in of_bus if one.failure == "babbling"]
        self._shared = SharedBus(babblers, start_s, signals.rates, self.counts)
        self._stretches = [
            (start_s + one.at_s - WATCHED_S, start_s + one.until_s + BEYOND_S) for one in (*of_bus, *of_signals)
        ]
        self._ready: list[Passed[CanFrame]] = []  # what passes untouched
        self._newest_s = -inf
        self._under_way: list[tuple[float, int, Due]] = []  # a heap: arrival, order
        self._entered = 0
        self._bus_off = [one for one in of_bus if one.failure == "bus_off"]
        self._tell_of_bus_off()
        self._quiet_until_s = self._quiet(-inf)

    def put(self, time_s: float, item: CanFrame, towards: Towards) -> None:
        """A frame enters; `time_s`, in unix seconds, does not go back."""
        self._newest_s = time_s
        if time_s < self._quiet_until_s:
            self._ready.append(Passed(item, towards))
            return
        since_s = time_s - self._start_s
        dues = [Due(time_s, item, towards)]
        for stage in self._stages:
            dues = [passed for due in dues for passed in stage.take(since_s, due)]
        for due in dues:
            self._send(due)

    def due(self, time_s: float) -> list[Passed[CanFrame]]:
        """What has arrived by now, in order of arrival."""
        arrived, self._ready = self._ready, []
        if time_s >= self._quiet_until_s:
            arrived += self._late(time_s)
            self._quiet_until_s = self._quiet(time_s)
        return arrived

    def next_s(self) -> float:
        """When more is due without anything being put in; infinity: never."""
        if self._ready:
            return self._newest_s
        return min(self._under_way[0][0] if self._under_way else inf, self._shared.next_s())

    def _send(self, due: Due) -> None:
        heappush(self._under_way, (due.at_s, self._entered, due))
        self._entered += 1

    def _late(self, time_s: float) -> list[Passed[CanFrame]]:
        while self._under_way and self._under_way[0][0] <= time_s:
            self._shared.put(heappop(self._under_way)[2])
        through = self._shared.due(time_s)
        return [Passed(due.frame, due.towards) for due in through if due.frame.error or not self._is_off(due)]

    def _is_off(self, due: Due) -> bool:
        off = any(fault.active(due.at_s - self._start_s) for fault in self._bus_off)
        if off:
            self.counts["frames lost while bus-off"] += 1
        return off

    def _tell_of_bus_off(self) -> None:
        """What the gateway's controller is going to report."""
        for fault in self._bus_off:
            for since_s, what in ((fault.at_s, BUS_OFF), (fault.until_s, RESTARTED)):
                if since_s < inf:
                    at_s = self._start_s + since_s
                    told = CanFrame(at_s, what, ERROR_DATA, extended=False, error=True)
                    self._send(Due(at_s, told, Towards.AUTOPILOT))

    def _quiet(self, time_s: float) -> float:
        """Until when frames pass untouched, and none comes by itself."""
        if self._shared.busy(time_s) or any(edits.renumbers for edits in self._edits):
            return -inf
        under_way_s = self._under_way[0][0] if self._under_way else inf
        return min([under_way_s, *(_begins(stretch, time_s) for stretch in self._stretches)])


class _Stage(Protocol):
    """Something that happens to one frame after the other."""

    def take(self, since_s: float, due: Due) -> list[Due]:
        """What goes on when a frame comes."""
        ...


def _edits(
    signals: CanSignals, faults: Sequence[Fault], seed: int, counts: Counter[str]
) -> list[TransferEdits | MessageEdits]:
    if not faults:
        return []
    speeds, commands = (values_of(faults, target, seed, counts) for target in (Target.RPM, Target.COMMAND))
    if signals.protocol == "dronecan":
        return [TransferEdits(signals.thrusters, speeds, commands)]
    return [MessageEdits(signals.messages, speeds, commands, counts)]


def _bus_stages(signals: CanSignals, faults: Sequence[Fault], seed: int, counts: Counter[str]) -> list[_Stage]:
    """Second devices first: they are on the bus, and what befalls its frames befalls theirs."""
    stages: list[_Stage] = []
    for place, fault in enumerate(faults):
        if fault.failure == "node_conflict" and signals.protocol == "dronecan":
            stages.append(SecondNode(fault, [seed, place], counts))
        elif fault.failure == "node_conflict":
            stages.append(SecondSender(fault, signals.messages, [seed, place], counts))
    struck = [(place, fault) for place, fault in enumerate(faults) if fault.failure in FRAME_FAULTS]
    return [*stages, *(FRAME_FAULTS[fault.failure](fault, [seed, place], counts) for place, fault in struck)]


def _begins(stretch: tuple[float, float], time_s: float) -> float:
    """When a stretch of time begins; minus infinity: it has, infinity: it is over."""
    from_s, until_s = stretch
    if time_s < from_s:
        return from_s
    return -inf if time_s < until_s else inf


def _refuse_nodes(signals: CanSignals, faults: Sequence[Fault]) -> None:
    for fault in faults:
        node = fault.values.get("node", ALL_NODES)
        if node != ALL_NODES and fault.failure in FRAME_FAULTS and signals.protocol != "dronecan":
            raise ValueError(
                f"node = {node:g} of {fault.words}: leave it out, frames of a {signals.protocol} bus tell no node"
            )
