"""Keeping place and depth, well enough that a mode moves the simulated vehicle the way its name says."""

from __future__ import annotations

from dataclasses import replace
from math import cos, sin

from hil_tests.rig.pilot import Sticks
from hil_tests.rig.vehicle import Motion

STICK_CENTRED = 0.05


class StationKeeper:
    """Holds the place at which it was first asked to, until it is released."""

    def __init__(self) -> None:
        self._target: Motion | None = None

    def release(self) -> None:
        """Forget the place."""
        self._target = None

    def hold_depth(self, sticks: Sticks, motion: Motion) -> Sticks:
        """The pilot's sticks, but for the depth."""
        return replace(sticks, down=self.hold(sticks, motion).down)

    def hold(self, sticks: Sticks, motion: Motion) -> Sticks:
        """Keep the place, except along the axes on which the pilot has a hand; there the place moves along."""
        target = self._target or motion
        forward, right = _in_body(target.north_m - motion.north_m, target.east_m - motion.east_m, motion.yaw_rad)
        hands_on = max(abs(sticks.forward), abs(sticks.right)) > STICK_CENTRED
        down_on = abs(sticks.down) > STICK_CENTRED
        forward_mps, right_mps, down_mps = motion.over_ground_mps()
        self._target = replace(
            target,
            north_m=motion.north_m if hands_on else target.north_m,
            east_m=motion.east_m if hands_on else target.east_m,
            down_m=motion.down_m if down_on else target.down_m,
        )
        return Sticks(
            forward=sticks.forward if hands_on else _towards(forward, forward_mps),
            right=sticks.right if hands_on else _towards(right, right_mps),
            down=sticks.down if down_on else _towards(target.down_m - motion.down_m, down_mps),
            yaw=sticks.yaw,
        )


def _towards(distance_m: float, velocity_mps: float) -> float:
    """Proportional and damping, limited to half of the stick."""
    return max(-0.5, min(0.5, 0.6 * distance_m - 0.5 * velocity_mps))


def _in_body(north_m: float, east_m: float, yaw_rad: float) -> tuple[float, float]:
    cosine, sine = cos(yaw_rad), sin(yaw_rad)
    return cosine * north_m + sine * east_m, -sine * north_m + cosine * east_m
