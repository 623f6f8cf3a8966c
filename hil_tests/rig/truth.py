"""What a simulated vehicle really did: what a gateway's word is held against."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import hypot

import numpy as np
from numpy.typing import NDArray

from hil_tests.rig.vehicle import Vehicle

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ModeChange:
    """The autopilot's mode from here on, in its own words, and whether it is armed."""

    time_s: float
    mode: str
    armed: bool


@dataclass(frozen=True, slots=True, eq=False)
class Truth:
    """What the simulated vehicle really did: N instants, T thrusters.

    Attributes:
        time_s: (N,) unix seconds.
        command: (N, T) as the autopilot meant it, -1 to 1.
        speed_rpm, healthy_rpm: (N, T) of the propellers, and what they would be without any fault.
        north_m, east_m, down_m, yaw_rad: (N,) place and heading.
        through_water_mps, over_ground_mps: (N,) speeds in the plane.
        current_north_mps, current_east_mps: (N,) of the water.
        supply_v: (N,).
    """

    time_s: FloatArray
    command: FloatArray
    speed_rpm: FloatArray
    healthy_rpm: FloatArray
    north_m: FloatArray
    east_m: FloatArray
    down_m: FloatArray
    yaw_rad: FloatArray
    through_water_mps: FloatArray
    over_ground_mps: FloatArray
    current_north_mps: FloatArray
    current_east_mps: FloatArray
    supply_v: FloatArray


class TruthLog:
    """Keeps the truth, instant by instant.

    Args:
        thrusters: how many there are.
    """

    def __init__(self, thrusters: int) -> None:
        self._thrusters = thrusters
        self._rows: list[tuple[float, ...]] = []

    def note(self, time_s: float, command: Sequence[float], vehicle: Vehicle) -> None:
        """How it all is at an instant; `command` as in `Truth`."""
        motion = vehicle.hull.motion
        forward_mps, right_mps, _ = motion.over_ground_mps()
        north_mps, east_mps, _ = motion.water_mps
        states = [thruster.state for thruster in vehicle.thrusters]
        self._rows.append(
            (
                time_s,
                *command,
                *(state.speed_rpm for state in states),
                *(state.healthy_rpm for state in states),
                motion.north_m,
                motion.east_m,
                motion.down_m,
                motion.yaw_rad,
                hypot(motion.forward_mps, motion.right_mps),
                hypot(forward_mps, right_mps),
                north_mps,
                east_mps,
                vehicle.battery.voltage_v,
            )
        )

    def truth(self) -> Truth:
        """All so far."""
        count = self._thrusters
        rows = np.array(self._rows, dtype=np.float64).reshape(len(self._rows), 10 + 3 * count)
        of_thrusters = (rows[:, 1 + count * block : 1 + count * (block + 1)] for block in range(3))
        return Truth(rows[:, 0], *of_thrusters, *rows[:, 1 + 3 * count :].T)
