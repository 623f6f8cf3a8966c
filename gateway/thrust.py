"""What the thrusters are told to do together: the thrust ahead and to the right, as a share of the most they have."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import copysign, sqrt
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from gateway.align import HeldCommand

# a command is kept for as long as somebody may ask for it: the time of one sample, and of the attitude it waits for
KEPT_S = 1.0


@dataclass(frozen=True, slots=True)
class Shares:
    """How much of one thruster's thrust goes ahead and to the right when it turns ahead; negative: astern, left.

    Raises:
        ValueError: not in -1 to 1.
    """

    ahead: float = 0.0
    right: float = 0.0

    def __post_init__(self) -> None:
        for name in self.__slots__:
            if not -1.0 <= getattr(self, name) <= 1.0:
                raise ValueError(f"{name} = {getattr(self, name)!r}: want a share from -1 to 1")


FractionT = TypeVar("FractionT", float, NDArray[np.float64])


def thrust(fraction: FractionT) -> FractionT:
    """Share of the full thrust that a command makes, -1 to 1."""
    return fraction * abs(fraction)


class ThrustDemand:
    """Commands of single thrusters in, demand of thrust along the vehicle's axes out.

    Thrust goes about with the square of the command, so the demand along an axis is the mean of `c |c|`, weighted by
    the shares; its signed square root is the one command that would make the same thrust with all of them.

    Args:
        shares: by thruster number; those without any share are left out.
        stale_s: a command holds for this long.
    """

    def __init__(self, shares: Mapping[int, Shares], stale_s: float) -> None:
        self._ahead = {number: share.ahead for number, share in shares.items() if share.ahead}
        self._right = {number: share.right for number, share in shares.items() if share.right}
        numbers = sorted({*self._ahead, *self._right})
        self._thrusts = {number: HeldCommand(stale_s, keep_s=KEPT_S + stale_s) for number in numbers}

    @property
    def thrusters(self) -> frozenset[int]:
        """Numbers of the thrusters that matter here."""
        return frozenset(self._thrusts)

    def command(self, time_s: float, thruster: int, fraction: float) -> None:
        """Takes a command, -1 to 1, that holds from `time_s` on; one that is older than the last is ignored."""
        self._thrusts[thruster].append(time_s, thrust(fraction))

    def held(self, thruster: int) -> HeldCommand:
        """The thrusts of one thruster, see `thrust`: who has many commands at once gives them to it."""
        return self._thrusts[thruster]

    def over(self, start_s: float, end_s: float) -> tuple[float | None, float]:
        """Commands ahead and to the right over the time from `start_s` to `end_s`, which is later by up to `KEPT_S`.

        Returns:
            -1 to 1 each. Ahead is None where it is not known: no thruster has a share in it, or one of them has no
            fresh command. To the right, that is 0.
        """
        return self._along(self._ahead, start_s, end_s), self._along(self._right, start_s, end_s) or 0.0

    def _along(self, shares: Mapping[int, float], start_s: float, end_s: float) -> float | None:
        if not shares:
            return None
        total = 0.0
        for number, share in shares.items():
            thrust = self._thrusts[number].mean(start_s, end_s)
            if thrust is None:
                return None
            total += share * thrust
        demand = total / sum(map(abs, shares.values()))
        return copysign(sqrt(abs(demand)), demand)
