"""A helmsman: steers one heading after another, as a survey or an inspection wants them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import copysign, isfinite, pi, radians

from hil_tests.rig.pilot import Sticks
from hil_tests.rig.vehicle import Motion

# Within this share of the greatest turn rate a pilot lets a vehicle at rest be.
CALM_SHARE = 0.05
# ... and else it takes so much more stick: thrust grows with the square of the command.
IDLE_GAIN = 4.0


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


@dataclass(frozen=True, slots=True)
class Steering:
    """How a pilot steers by the yaw stick. The defaults suit a BlueROV2 Heavy: brisk, and calm with the thrusters'
    delay and lag.

    Attributes:
        turn_rate_radps: at most.
        rate_per_s: turn rate that is wanted for each radian off the heading.
        stick_per_radps: yaw stick for each rad/s that it turns too slowly.
        dead_band: yaw stick below which nothing turns, where the thrusters have nothing else to do.

    Raises:
        ValueError: a number that is not above 0.
    """

    turn_rate_radps: float = 0.35
    rate_per_s: float = 1.0
    stick_per_radps: float = 0.04
    dead_band: float = 0.065

    def __post_init__(self) -> None:
        for name in self.__slots__:
            value = getattr(self, name)
            if not (isfinite(value) and value > 0.0):
                raise ValueError(f"{name} = {value!r}: want a number above 0")

    def stick(self, heading_rad: float, motion: Motion, idle: bool = False) -> float:
        """Where the yaw stick must be to come to a heading, and to keep it.

        Args:
            heading_rad: that is wanted.
            motion: of the vehicle.
            idle: the thrusters have nothing else to do, and are within their dead band.
        """
        off_rad = (heading_rad - motion.yaw_rad + pi) % (2.0 * pi) - pi
        wanted_radps = max(-self.turn_rate_radps, min(self.turn_rate_radps, self.rate_per_s * off_rad))
        off_radps = wanted_radps - motion.yaw_rate_radps
        stick = self.stick_per_radps * off_radps
        if idle and abs(off_radps) > CALM_SHARE * self.turn_rate_radps:
            stick = IDLE_GAIN * stick + copysign(self.dead_band, off_radps)
        return max(-1.0, min(1.0, stick))


BLUEROV2 = Steering()


def steer(course: Course, time_s: float, sticks: Sticks, motion: Motion) -> Sticks:
    """The pilot's sticks with the yaw stick as it must be to come to, and to keep, the heading of the moment."""
    return replace(sticks, yaw=BLUEROV2.stick(course.heading_rad(time_s), motion))
