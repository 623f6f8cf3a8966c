"""A CAN wire between the autopilot's end of a bus, where the gateway listens as well, and its ESCs, with its faults.

What a frame goes through, in this order: faults of the signals in it, second devices, faults of frames, the bus that
babblers share, and the gateway's controller, which may be bus-off.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from math import inf
from typing import Protocol

from drivers.can.frame import CanFrame
from hil_tests.scenario.failures import Target
from hil_tests.scenario.fault import Fault
from hil_tests.wires.arrivals import Arrivals
from hil_tests.wires.can_signals import CanSignals
from hil_tests.wires.frame_faults import ALL_NODES, FRAME_FAULTS, Due
from hil_tests.wires.message_edits import MessageEdits
from hil_tests.wires.second_device import SecondNode, SecondSender
from hil_tests.wires.stretches import Stretches
from hil_tests.wires.thruster_values import values_of
from hil_tests.wires.transfer_edits import TransferEdits
from hil_tests.wires.way import Passed, Towards


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
        self._stretches = Stretches(start_s, [*of_bus, *of_signals])
        self._arrivals = Arrivals(of_bus, start_s, signals.rates, self.counts)
        self._ready: list[Passed[CanFrame]] = []  # what has arrived without being on its way
        self._newest_s = -inf
        self._untouched_until_s = -inf

    def put(self, time_s: float, item: CanFrame, towards: Towards) -> None:
        """A frame enters; `time_s`, in unix seconds, does not go back."""
        self._newest_s = time_s
        if time_s < self._untouched_until_s:
            self._ready.append(Passed(item, towards))
        else:
            self._put_through_stages(time_s, item, towards)

    def due(self, time_s: float) -> list[Passed[CanFrame]]:
        """What has arrived by now, in order of arrival."""
        arrived, self._ready = self._ready, []
        if time_s >= self._untouched_until_s:
            arrived += self._arrivals.due(time_s)
            renumbers = any(edits.renumbers for edits in self._edits)
            acts_from_s = -inf if renumbers else self._stretches.next_s(time_s)
            self._untouched_until_s = min(acts_from_s, self._arrivals.open_until_s)
        return arrived

    def next_s(self) -> float:
        """When more is due without anything being put in; infinity: never."""
        return self._newest_s if self._ready else self._arrivals.next_s()

    def bus_off(self, time_s: float) -> bool:
        """Whether the gateway's controller is bus-off: it does not hear the autopilot's frames either, which have no
        wire to pass before they come to it."""
        return self._arrivals.bus_off(time_s)

    def _put_through_stages(self, time_s: float, item: CanFrame, towards: Towards) -> None:
        since_s = time_s - self._start_s
        dues = [Due(time_s, item, towards)]
        for stage in self._stages:
            dues = [passed for due in dues for passed in stage.take(since_s, due)]
        for due in dues:
            if due.at_s <= time_s < self._arrivals.open_until_s:
                self._ready.append(Passed(due.frame, due.towards))
            else:
                self._arrivals.put(due)
        self._untouched_until_s = min(self._untouched_until_s, self._arrivals.open_until_s)


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


def _refuse_nodes(signals: CanSignals, faults: Sequence[Fault]) -> None:
    for fault in faults:
        node = fault.values.get("node", ALL_NODES)
        if node != ALL_NODES and fault.failure in FRAME_FAULTS and signals.protocol != "dronecan":
            raise ValueError(
                f"node = {node:g} of {fault.words}: leave it out, frames of a {signals.protocol} bus tell no node"
            )
