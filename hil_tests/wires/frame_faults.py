"""What bus faults do to one CAN frame after the other: lost, damaged, doubled, late, or of a wrong length.

Chance is drawn for each frame that a fault concerns; a ramp lets the share of frames grow, or the delay.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from bisect import bisect_left
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from math import inf
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from drivers.can.frame import CanFrame
from hil_tests.scenario.fault import Fault
from hil_tests.wires.way import Towards

SOURCE_NODE_MASK = 0x7F  # of a DroneCAN identifier
ALL_NODES = -1
FLIPPED_BITS_MAX = 3
# Lengths that a frame's DLC can tell: ISO 11898-1
CLASSIC_LENGTHS = tuple(range(9))
FD_LENGTHS = (*CLASSIC_LENGTHS, 12, 16, 20, 24, 32, 48, 64)


class Due(NamedTuple):
    """A frame under way.

    Attributes:
        at_s: when it arrives, unix seconds.
        frame: stamped as it will arrive.
        towards: where.
    """

    at_s: float
    frame: CanFrame
    towards: Towards

    def arriving(self, at_s: float) -> Due:
        """The same, later: its stamp by as much."""
        if at_s == self.at_s:
            return self
        return Due(at_s, replace(self.frame, time_s=self.frame.time_s + (at_s - self.at_s)), self.towards)


class FrameFault(ABC):
    """One fault at work on frames.

    Args:
        fault: of a bus.
        seed: of its chance.
        counts: what is done is counted here.
    """

    done: str  # how its work is called in the counts

    def __init__(self, fault: Fault, seed: list[int], counts: Counter[str]) -> None:
        self._fault = fault
        self._random = np.random.default_rng(seed)
        self._counts = counts
        self._node = int(fault.values.get("node", ALL_NODES))

    def take(self, since_s: float, due: Due) -> list[Due]:
        """What becomes of a frame that enters the wire `since_s` after the start; itself where nothing does."""
        if not self._fault.active(since_s) or not self._concerns(due.frame):
            return [due]
        struck = self._struck(due, self._fault.grown(since_s))
        if struck != [due]:
            self._counts[self.done] += 1
        return struck

    @abstractmethod
    def _struck(self, due: Due, grown: float) -> list[Due]:
        """What becomes of a frame that the fault is about; `grown` is 0 to 1."""

    def _concerns(self, frame: CanFrame) -> bool:
        of_node = self._node == ALL_NODES or (frame.extended and frame.identifier & SOURCE_NODE_MASK == self._node)
        return of_node and not frame.error

    def _happens(self, grown: float) -> bool:
        return float(self._random.random()) < self._fault.values["share"] * grown


class _Loss(FrameFault):
    done = "frames lost"

    def _struck(self, due: Due, grown: float) -> list[Due]:
        return [] if self._happens(grown) else [due]


class _Corruption(FrameFault):
    """One bit to three, each another one: what the bus's own CRC would have caught has been caught before."""

    done = "frames corrupted"

    def _struck(self, due: Due, grown: float) -> list[Due]:
        bits = 8 * len(due.frame.data)
        if not bits or not self._happens(grown):
            return [due]
        data = bytearray(due.frame.data)
        flips = self._random.choice(bits, int(self._random.integers(1, FLIPPED_BITS_MAX + 1)), replace=False)
        for bit in flips.tolist():
            data[bit // 8] ^= 1 << bit % 8
        return [due._replace(frame=replace(due.frame, data=bytes(data)))]


class _Duplication(FrameFault):
    done = "frames duplicated"

    def _struck(self, due: Due, grown: float) -> list[Due]:
        return [due, due] if self._happens(grown) else [due]


class _Reordering(FrameFault):
    done = "frames held back"

    def _struck(self, due: Due, grown: float) -> list[Due]:
        return [due.arriving(due.at_s + self._fault.values["held_s"])] if self._happens(grown) else [due]


class _Delay(FrameFault):
    """Frames keep their order, whatever the jitter: to overtake is "reordering". Those that come after the end of the
    fault are not late, and overtake what still is."""

    done = "frames delayed"

    def __init__(self, fault: Fault, seed: list[int], counts: Counter[str]) -> None:
        super().__init__(fault, seed, counts)
        self._newest_s = dict.fromkeys(Towards, -inf)

    def _struck(self, due: Due, grown: float) -> list[Due]:
        values = self._fault.values
        late_s = values["delay_s"] + values["jitter_s"] * float(self._random.random())
        arrival_s = max(due.at_s + late_s * grown, self._newest_s[due.towards])
        self._newest_s[due.towards] = arrival_s
        return [due.arriving(arrival_s)]


class _WrongDlc(FrameFault):
    """Cut, or filled up with zeros: to any other length that a DLC can tell, one as likely as the other."""

    done = "frames of a wrong length"

    def _struck(self, due: Due, grown: float) -> list[Due]:
        if not self._happens(grown):
            return [due]
        data = due.frame.data
        lengths = FD_LENGTHS if due.frame.fd else CLASSIC_LENGTHS
        others = [length for length in lengths if length != lengths[bisect_left(lengths, len(data))]]
        length = others[int(self._random.integers(len(others)))]
        return [due._replace(frame=replace(due.frame, data=data[:length].ljust(length, b"\0")))]


FRAME_FAULTS: Mapping[str, type[FrameFault]] = MappingProxyType(
    {
        "loss": _Loss,
        "corruption": _Corruption,
        "duplication": _Duplication,
        "reordering": _Reordering,
        "delay": _Delay,
        "wrong_dlc": _WrongDlc,
    }
)
