"""How the body moves just now: its turn rate and the change of its velocity, which lever arms and delays act upon."""

from __future__ import annotations

from math import dist, exp, hypot

from detectors.navigation.rotation import cross, rotate_back
from detectors.navigation.sample import Vector
from detectors.navigation.strapdown import Strapdown

# Thrusters shake the IMU. Of the turn rate little is smoothed away: late by as much as a hull's wobble lasts, it
# would tell of a lever arm that is shorter than it is.
SMOOTHING_S, RATE_SMOOTHING_S = 0.15, 0.02
# What lasts shorter than an unknown delay cannot be told from what comes later.
LASTING_S = 1.0
# More than what a hull wobbles on a straight course.
TURNS_RADPS, CHANGES_MPS2 = 0.04, 0.06
MORE = 2.0  # what lasts, than what changes within a second
_STILL: Vector = (0.0, 0.0, 0.0)


class BodyMotion:
    """Smoothed turn rate and acceleration in the frame of the body.

    Attributes:
        rate_radps: (3,) turn rate.
        acceleration_mps2: (3,) change per second of the velocity as the body sees it (not the specific force).
        newest_acceleration_mps2: (3,) the same, of the newest sample alone.
        lasting_rate_radps, lasting_acceleration_mps2: (3,) the same, smoothed over a second.
    """

    __slots__ = (
        "acceleration_mps2",
        "lasting_acceleration_mps2",
        "lasting_rate_radps",
        "newest_acceleration_mps2",
        "rate_radps",
    )

    def __init__(self) -> None:
        self.rate_radps: Vector = _STILL
        self.acceleration_mps2: Vector = _STILL
        self.newest_acceleration_mps2: Vector = _STILL
        self.lasting_rate_radps: Vector = _STILL
        self.lasting_acceleration_mps2: Vector = _STILL

    def follow(self, strapdown: Strapdown, angular_rate_radps: Vector, interval_s: float) -> None:
        """After `strapdown` has advanced by a sample: (3,) angular rate as measured, `interval_s` since the last."""
        keep = exp(-interval_s / SMOOTHING_S)
        rate = _less(angular_rate_radps, strapdown.gyroscope_bias_radps)
        self.rate_radps = _mixed(self.rate_radps, rate, exp(-interval_s / RATE_SMOOTHING_S))
        north, east, down = strapdown.specific_force_mps2
        earth = strapdown.earth
        gravity = earth.surface_gravity_mps2 + earth.gravity_gradient_ps2 * strapdown.depth_m
        change = rotate_back(strapdown.attitude, (north, east, down + gravity))
        change = _less(change, cross(rate, strapdown.body_velocity()))
        self.acceleration_mps2 = _mixed(self.acceleration_mps2, change, keep)
        self.newest_acceleration_mps2 = change
        keep = exp(-interval_s / LASTING_S)
        self.lasting_rate_radps = _mixed(self.lasting_rate_radps, rate, keep)
        self.lasting_acceleration_mps2 = _mixed(self.lasting_acceleration_mps2, change, keep)

    def lasts(self, later: BodyMotion) -> bool:
        """Whether the vehicle turns or accelerates, and did so a second ago and will: then an unknown delay matters
        less than what is to be learnt from it."""
        rate, change = self.unsteady(later)
        turns = hypot(*self.lasting_rate_radps) > max(TURNS_RADPS, MORE * rate)
        return turns or hypot(*self.lasting_acceleration_mps2) > max(CHANGES_MPS2, MORE * change)

    @property
    def lasting_share(self) -> float:
        """How much of the turn rate and acceleration lasts, by their squares; a hull that wobbles has little."""
        now = hypot(*self.rate_radps, *self.acceleration_mps2)
        lasting = hypot(*self.lasting_rate_radps, *self.lasting_acceleration_mps2)
        return min(1.0, (lasting / now) ** 2) if now > 0.0 else 0.0

    def unsteady(self, later: BodyMotion) -> tuple[float, float]:
        """How much turn rate (rad/s) and acceleration (m/s2) differ from those of the second before, and of later."""
        return (
            max(dist(self.rate_radps, self.lasting_rate_radps), dist(self.rate_radps, later.rate_radps)),
            max(
                dist(self.acceleration_mps2, self.lasting_acceleration_mps2),
                dist(self.acceleration_mps2, later.acceleration_mps2),
            ),
        )


def _less(one: Vector, other: Vector) -> Vector:
    return one[0] - other[0], one[1] - other[1], one[2] - other[2]


def _mixed(old: Vector, new: Vector, keep: float) -> Vector:
    share = 1.0 - keep
    return keep * old[0] + share * new[0], keep * old[1] + share * new[1], keep * old[2] + share * new[2]
