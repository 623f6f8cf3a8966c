"""What faults of a link do to the packets on it, one by one: which are lost, late, twice there, damaged, cut off.

A line does the first ones (`hil_tests.rig.link_conditions`), which has one set of conditions at a time: that of all
faults together. Packets that are under way when a fault ends arrive as they would have, and what is sent then may
overtake them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import prod

import numpy as np

from hil_tests.rig.link_conditions import IDEAL, LinkConditions
from hil_tests.scenario.fault import Fault

GARBAGE_MAX = 64  # bytes that come at once


@dataclass(frozen=True, slots=True)
class Trouble:
    """What a link is like at one instant.

    Attributes:
        conditions: of the line.
        cut: nothing is let in.
        garbage: share of the packets that are followed by it.
        damage: share of the packets of which a bit flips.
    """

    conditions: LinkConditions = IDEAL
    cut: bool = False
    garbage: float = 0.0
    damage: float = 0.0


NONE = Trouble()


def trouble(faults: Sequence[Fault], since_s: float) -> Trouble:
    """What these faults of a link make of it at an instant, in seconds since the start."""
    active = [fault for fault in faults if fault.active(since_s)]
    if not active:
        return NONE
    held_s = max((fault.values["held_s"] for fault in active if fault.failure == "reordering"), default=0.0)
    conditions = LinkConditions(
        loss=_share(active, "loss", since_s),
        duplication=_share(active, "duplication", since_s),
        reordering=_share(active, "reordering", since_s),
        held_s=held_s,
        latency_s=_sum(active, "delay_s", since_s),
        jitter_s=_sum(active, "jitter_s", since_s),
    )
    return Trouble(
        conditions,
        cut=any(fault.failure == "cut" for fault in active),
        garbage=_share(active, "garbage", since_s),
        damage=_share(active, "bad_checksum", since_s),
    )


def _share(faults: Sequence[Fault], failure: str, since_s: float) -> float:
    """Of packets that at least one of several faults of a kind befalls, each by itself."""
    return 1.0 - prod(
        1.0 - fault.values["share"] * fault.grown(since_s) for fault in faults if fault.failure == failure
    )


def _sum(faults: Sequence[Fault], quantity: str, since_s: float) -> float:
    return sum(fault.values[quantity] * fault.grown(since_s) for fault in faults if fault.failure == "latency")


class Noise:
    """The randomness of garbage and of flipped bits.

    Args:
        seed: the same does the same.
    """

    def __init__(self, seed: int) -> None:
        self._random = np.random.default_rng((seed, 1))

    def happens(self, share: float) -> bool:
        """True in that share of the cases."""
        return share > 0.0 and float(self._random.random()) < share

    def garbage(self) -> bytes:
        """1 to `GARBAGE_MAX` bytes, any of them: MAVLink's magic ones as well."""
        return self._random.bytes(int(self._random.integers(1, GARBAGE_MAX, endpoint=True)))

    def damaged(self, packet: bytes) -> bytes:
        """The packet with one bit flipped, which every checksum sees."""
        place = int(self._random.integers(8 * len(packet)))
        flipped = bytearray(packet)
        flipped[place // 8] ^= 1 << place % 8
        return bytes(flipped)
