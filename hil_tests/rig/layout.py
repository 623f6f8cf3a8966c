"""Where thrusters sit on a hull, and how a demand is shared out among them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import isfinite

from hil_tests.rig.pilot import Sticks

Axes = tuple[float, float, float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Mount:
    """How one thruster is built in.

    Attributes:
        ahead, right, down: the part of its thrust that goes there when its command is positive, -1 to 1.
        yaw_arm_m: lever arm of that thrust about the vertical axis; positive turns clockwise, seen from above.
        reversible: False: it only turns ahead.

    Raises:
        ValueError: a part is out of its range.
    """

    ahead: float = 0.0
    right: float = 0.0
    down: float = 0.0
    yaw_arm_m: float = 0.0
    reversible: bool = True

    def __post_init__(self) -> None:
        for name in ("ahead", "right", "down"):
            if not -1.0 <= getattr(self, name) <= 1.0:
                raise ValueError(f"{name} = {getattr(self, name)!r}: want a part of the thrust, -1 to 1")
        if not isfinite(self.yaw_arm_m):
            raise ValueError(f"yaw_arm_m = {self.yaw_arm_m!r}: want metres")

    @property
    def leverage(self) -> Axes:
        """Force ahead, right, down and moment about the vertical axis for each newton of thrust."""
        return self.ahead, self.right, self.down, self.yaw_arm_m


@dataclass(frozen=True)
class Layout:
    """All thrusters of a hull, in their order.

    Raises:
        ValueError: there is none.
    """

    mounts: tuple[Mount, ...]

    def __post_init__(self) -> None:
        if not self.mounts:
            raise ValueError("mounts = (): want at least one thruster")

    def __len__(self) -> int:
        return len(self.mounts)

    @cached_property
    def mixer(self) -> tuple[Axes, ...]:
        """Share of each demand (forward, right, down, yaw) that goes to each thruster: all of it to those that are
        best placed for it, and to none what it cannot do."""
        best = [max(abs(mount.leverage[axis]) for mount in self.mounts) or 1.0 for axis in range(4)]
        rows = []
        for mount in self.mounts:
            forward, right, down, yaw = (part / most for part, most in zip(mount.leverage, best, strict=True))
            rows.append((forward, right, down, yaw))
        return tuple(rows)

    def mix(self, demand: Sticks) -> list[float]:
        """Thruster commands, -1 to 1 each; scaled down together where one would exceed full command."""
        forward, right, down, yaw = demand.forward, demand.right, demand.down, demand.yaw
        raw = [row[0] * forward + row[1] * right + row[2] * down + row[3] * yaw for row in self.mixer]
        largest = max(1.0, *map(abs, raw))
        return [
            command / largest if command > 0.0 or mount.reversible else 0.0
            for command, mount in zip(raw, self.mounts, strict=True)
        ]

    def forces(self, thrusts_n: Sequence[float]) -> Axes:
        """Force ahead, right, down in N and moment about the vertical axis in N m.

        Raises:
            ValueError: not one thrust for each thruster.
        """
        ahead = right = down = yaw = 0.0
        for mount, thrust_n in zip(self.mounts, thrusts_n, strict=True):
            ahead += mount.ahead * thrust_n
            right += mount.right * thrust_n
            down += mount.down * thrust_n
            yaw += mount.yaw_arm_m * thrust_n
        return ahead, right, down, yaw
