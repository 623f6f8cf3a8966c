"""What faults make of the speeds and commands of thrusters, whatever messages carry them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from math import inf

from hil_tests.scenario.failures import Target
from hil_tests.scenario.fault import Fault
from hil_tests.wires.distortion import Distortion

# In a message with those of others a value cannot be left out: the last one stays for so long, as an ESC goes on
# without commands, and then there is none.
KEPT_S = 0.5
NONE = 0.0


class ThrusterValue:
    """One speed (rpm, positive ahead) or one command (share of full thrust, -1 to 1).

    Args:
        faults: of it, at least one.
        seed: of their chance.
        counts: what is done is counted here.
    """

    def __init__(self, faults: Sequence[Fault], seed: int, counts: Counter[str]) -> None:
        self._distortion = Distortion(faults, seed)
        self._counts = counts
        self._name = f"{faults[0].subject.target} of thruster {faults[0].subject.thruster}"
        self._kept, self._kept_s = NONE, -inf

    def active(self, since_s: float) -> bool:
        """Whether any of its faults is there."""
        return self._distortion.active(since_s)

    def said(self, since_s: float, value: float) -> float | None:
        """What is said instead of the true value; None: the message does not come."""
        said = self._distortion.value(since_s, (value,))
        if said is None:
            self._counts[f"{self._name} withheld"] += 1
            return None
        if said[0] != value:
            self._counts[f"{self._name} changed"] += 1
        self._kept, self._kept_s = said[0], since_s
        return said[0]

    def said_among_others(self, since_s: float, value: float) -> float:
        """What is said in a message that comes in any case."""
        said = self.said(since_s, value)
        if said is not None:
            return said
        return self._kept if since_s - self._kept_s < KEPT_S else NONE


def values_of(faults: Sequence[Fault], target: Target, seed: int, counts: Counter[str]) -> dict[int, ThrusterValue]:
    """By thruster, those of a target that have faults."""
    of_target = [one for one in faults if one.subject.target is target]
    numbers = sorted({one.subject.thruster for one in of_target if one.subject.thruster is not None})
    return {
        number: ThrusterValue(
            [one for one in of_target if one.subject.thruster == number], _seed(seed, target, number), counts
        )
        for number in numbers
    }


def _seed(seed: int, target: Target, number: int) -> int:
    """Each signal has its own chance."""
    return seed * 1000 + number + (500 if target is Target.COMMAND else 0)
