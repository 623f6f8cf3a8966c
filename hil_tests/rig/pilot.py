"""A pilot's hands on the sticks: holds, ramps and swings on all four axes, the same for the same seed."""

from __future__ import annotations

from dataclasses import astuple, dataclass
from enum import Enum, auto
from math import cos, pi

import numpy as np

SHORTEST_GESTURE_S = 0.8
LONGEST_GESTURE_S = 2.6
STICK_TRAVEL_S = 0.25  # a hand needs this long from one position to the next


@dataclass(frozen=True, slots=True)
class Sticks:
    """Pilot input, each -1 to 1: forward, right, down, clockwise seen from above."""

    forward: float = 0.0
    right: float = 0.0
    down: float = 0.0
    yaw: float = 0.0


class Gesture(Enum):
    """What a hand does for a second or two."""

    HOLD = auto()
    RAMP = auto()
    SWING = auto()


@dataclass(frozen=True, slots=True)
class _Movement:
    """One gesture on one stick, from `start_s` on."""

    gesture: Gesture
    start_s: float
    end_s: float
    begins_at: float
    leads_to: float

    def position(self, time_s: float) -> float:
        return self.begins_at + (self.leads_to - self.begins_at) * self._way(time_s - self.start_s)

    def _way(self, since_s: float) -> float:
        """How much of the way is made: a swing goes there and back."""
        length_s = self.end_s - self.start_s
        if self.gesture is Gesture.SWING:
            return 0.5 - 0.5 * cos(2.0 * pi * since_s / length_s)
        return min(since_s / (STICK_TRAVEL_S if self.gesture is Gesture.HOLD else length_s), 1.0)


class StickHand:
    """One stick: gesture follows gesture, without a jump.

    Args:
        seed: what the hand does.
        centre: what it plays around.
        gain: how far from there it moves the stick at most.
        start_s: when it begins, from rest.
    """

    def __init__(self, seed: np.random.SeedSequence, centre: float, gain: float, start_s: float = 0.0) -> None:
        self._random = np.random.default_rng(seed)
        self._centre = centre
        self._gain = gain
        self._movement = self._next(start_s, 0.0)

    def position(self, time_s: float) -> float:
        """Where the stick is; `time_s` must not go back."""
        while time_s >= self._movement.end_s:
            end_s = self._movement.end_s
            self._movement = self._next(end_s, self._movement.position(end_s))
        return self._movement.position(time_s)

    def _next(self, start_s: float, begins_at: float) -> _Movement:
        gesture = Gesture(int(self._random.integers(1, len(Gesture) + 1)))
        length_s = float(self._random.uniform(SHORTEST_GESTURE_S, LONGEST_GESTURE_S))
        leads_to = self._centre + self._gain * float(self._random.uniform(-1.0, 1.0))
        return _Movement(gesture, start_s, start_s + length_s, begins_at, leads_to)


@dataclass(frozen=True, slots=True)
class DrivingStyle:
    """How a pilot drives: where the sticks are on average, and how far they are moved from there at most.

    Raises:
        ValueError: together they would move a stick beyond its end.
    """

    centre: Sticks
    gain: Sticks

    def __post_init__(self) -> None:
        for name, centre, gain in zip(AXES, astuple(self.centre), astuple(self.gain), strict=True):
            if gain < 0.0 or abs(centre) + gain > 1.0:
                raise ValueError(f"{name}: centre {centre} with gain {gain}: want a stick within -1 to 1")


AXES = ("forward", "right", "down", "yaw")
# Back and forth on all axes: every thruster turns both ways, through its dead band, all the time.
WORKING = DrivingStyle(Sticks(), Sticks(0.5, 0.5, 0.5, 0.5))
# Under way: mostly ahead, holding a light vehicle down, correcting with the rest.
CRUISING = DrivingStyle(Sticks(forward=0.45, down=0.3), Sticks(0.2, 0.1, 0.2, 0.1))
# On a course that a helmsman steers: the same ahead and down, hardly aside.
SURVEYING = DrivingStyle(Sticks(forward=0.45, down=0.3), Sticks(0.2, 0.02, 0.2, 0.0))


class Pilot:
    """All four sticks, lively enough that every thruster sees much of its range within some seconds.

    Args:
        seed: what the pilot does.
        style: how.
    """

    def __init__(self, seed: int, style: DrivingStyle = WORKING) -> None:
        seeds = np.random.SeedSequence(seed).spawn(len(AXES))
        settings = zip(seeds, astuple(style.centre), astuple(style.gain), strict=True)
        self._hands = [StickHand(*setting) for setting in settings]

    def sticks(self, time_s: float) -> Sticks:
        """Where the sticks are; `time_s` must not go back."""
        return Sticks(*(hand.position(time_s) for hand in self._hands))
