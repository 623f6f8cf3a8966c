"""A helmsman: steers one heading after another, as a survey or an inspection wants them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isfinite, pi, radians

from hil_tests.rig.pilot import Sticks
from hil_tests.rig.vehicle import Motion

TURN_RATE_RADPS = 0.35
# Yaw stick for each rad/s that the vehicle turns too slowly: brisk, and calm with the thrusters' delay and lag.
STICK_PER_RADPS = 0.04
RATE_PER_RAD = 1.0


@dataclass(frozen=True, slots=True)
class Course:
    """Headings that are steered in turn, over and over, each for the same time.

    Raises:
        ValueError: there is no heading, or no time for it.
    """

    headings_rad: tuple[float, ...]
    leg_s: float

    def __post_init__(self) -> None:
        if not self.headings_rad:
            raise ValueError("headings_rad = (): want at least one heading")
        if not (isfinite(self.leg_s) and self.leg_s > 0.0):
            raise ValueError(f"leg_s = {self.leg_s}: want seconds above 0")

    def heading_rad(self, time_s: float) -> float:
        """The one to steer, in seconds since the start."""
        return self.headings_rad[int(time_s // self.leg_s) % len(self.headings_rad)]


def box(leg_s: float) -> Course:
    """Round a square, clockwise, from north."""
    return Course(tuple(radians(heading_deg) for heading_deg in (0.0, 90.0, 180.0, 270.0)), leg_s)


def zigzag(centre_rad: float, swing_rad: float, leg_s: float) -> Course:
    """To both sides of a heading."""
    return Course((centre_rad + swing_rad, centre_rad - swing_rad), leg_s)


def steer(course: Course, time_s: float, sticks: Sticks, motion: Motion) -> Sticks:
    """The pilot's sticks with the yaw stick as it must be to come to, and to keep, the heading of the moment."""
    off_rad = (course.heading_rad(time_s) - motion.yaw_rad + pi) % (2.0 * pi) - pi
    wanted_radps = max(-TURN_RATE_RADPS, min(TURN_RATE_RADPS, RATE_PER_RAD * off_rad))
    return replace(sticks, yaw=STICK_PER_RADPS * (wanted_radps - motion.yaw_rate_radps))
