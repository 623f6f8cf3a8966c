"""What a pilot's hand does with one stick: hold it, or steer by it. Told the time since the start and the motion."""

from __future__ import annotations

from collections.abc import Callable

from hil_tests.rig.vehicle import Motion

Hand = Callable[[float, Motion], float]

# A pilot who watches the depth: calm, and at most half of the stick.
DESCENT_PER_S = 0.5
DESCENT_MPS = 0.4
STICK_PER_MPS = 0.5
DOWN_LIMIT = 0.6
# ... and one who watches the log: brings the speed up within some seconds, and takes what it takes.
STICK_PER_MPS_AHEAD = 0.3
STICK_PER_M_AHEAD = 0.15


class Held:
    """Moves the stick to a place within a time, and holds it there."""

    def __init__(self, begins_at: float, leads_to: float, at_s: float, over_s: float) -> None:
        self._begins_at, self._leads_to, self._at_s, self._over_s = begins_at, leads_to, at_s, over_s

    def __call__(self, since_s: float, motion: Motion) -> float:
        """Where it is."""
        passed_s = since_s - self._at_s
        if passed_s >= self._over_s:
            return self._leads_to
        return self._begins_at + (self._leads_to - self._begins_at) * passed_s / self._over_s


class Depth:
    """The down stick that goes to, and keeps, a depth; what it takes to stay there is found out."""

    def __init__(self, wanted_m: float, begins_at: float = 0.0) -> None:
        self._wanted_m = wanted_m
        self._steady = _within(DOWN_LIMIT, begins_at)
        self._last_s: float | None = None

    def __call__(self, since_s: float, motion: Motion) -> float:
        """Where the stick is."""
        wanted_mps = _within(DESCENT_MPS, DESCENT_PER_S * (self._wanted_m - motion.down_m))
        off_mps = wanted_mps - motion.over_ground_mps()[2]
        self._steady = _within(DOWN_LIMIT, self._steady + 0.5 * STICK_PER_MPS * off_mps * self._passed_s(since_s))
        return _within(1.0, self._steady + STICK_PER_MPS * off_mps)

    def _passed_s(self, since_s: float) -> float:
        before_s, self._last_s = self._last_s, since_s
        return 0.0 if before_s is None else since_s - before_s


class SpeedAhead:
    """The forward stick that brings about a speed through the water."""

    def __init__(self, wanted_mps: float, begins_at: float = 0.0) -> None:
        self._wanted_mps = wanted_mps
        self._steady = begins_at
        self._last_s: float | None = None

    def __call__(self, since_s: float, motion: Motion) -> float:
        """Where the stick is."""
        off_mps = self._wanted_mps - motion.forward_mps
        self._steady = _within(1.0, self._steady + STICK_PER_M_AHEAD * off_mps * self._passed_s(since_s))
        return _within(1.0, self._steady + STICK_PER_MPS_AHEAD * off_mps)

    def _passed_s(self, since_s: float) -> float:
        before_s, self._last_s = self._last_s, since_s
        return 0.0 if before_s is None else since_s - before_s


def _within(limit: float, value: float) -> float:
    return max(-limit, min(limit, value))
