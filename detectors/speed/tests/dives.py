"""Simulated dives, as the poses that the speed detector takes: positions that scatter, headings, commands."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import ceil, cos, exp, hypot, pi, sin

import numpy as np

from detectors.speed.sample import PoseSample

PIECE_S = 0.05  # longest piece into which an interval is cut for the true motion
TURN_S = 6.0  # that a helmsman takes from one leg to the next

OfTime = Callable[[float], float]


def turning(*corners: tuple[float, float], first_rad: float = 0.0) -> OfTime:
    """Legs: from each time (seconds) on the vehicle swings to that heading (radians)."""

    def heading_rad(t: float) -> float:
        heading, before = first_rad, first_rad
        for since_s, wanted in corners:
            if t >= since_s:
                heading = before + (wanted - before) * min((t - since_s) / TURN_S, 1.0)
                before = wanted
        return heading

    return heading_rad


def zig_zag(leg_s: float = 15.0, half_rad: float = 0.7, about_rad: float = 0.4) -> OfTime:
    """Legs to both sides of a course."""

    def heading_rad(t: float) -> float:
        leg, gone = divmod(t, leg_s)
        side = 1.0 if leg % 2.0 == 0.0 else -1.0
        share = 1.0 if leg == 0.0 else min(gone / TURN_S, 1.0)
        return about_rad + half_rad * side * (2.0 * share - 1.0)

    return heading_rad


def circling(period_s: float = 60.0) -> OfTime:
    return lambda t: 2.0 * pi * t / period_s


def straight(heading_rad: float = 0.4) -> OfTime:
    return lambda t: heading_rad


def step_at(since_s: float, before: float, after: float) -> OfTime:
    """One value, then another."""
    return lambda t: after if t >= since_s else before


def every(interval_s: float, until_s: float, since_s: float = 0.0) -> list[float]:
    return (since_s + interval_s * np.arange(round((until_s - since_s) / interval_s) + 1)).tolist()


def irregular(until_s: float, seed: int, shortest_s: float = 0.02, longest_s: float = 5.0) -> list[float]:
    """Times with intervals spread evenly over the decades from the shortest to the longest."""
    rng = np.random.default_rng(seed)
    times = [0.0]
    while times[-1] < until_s:
        times.append(times[-1] + float(np.exp(rng.uniform(np.log(shortest_s), np.log(longest_s)))))
    return times[:-1]


@dataclass(frozen=True, kw_only=True)
class Dive:
    """What a vehicle does, and the water it does it in; functions of the time in seconds.

    Attributes:
        heading: radians.
        flow: velocity of the water, north, east, down.
        power: speed through the water, when it has settled, as a share of `speed_mps`; below 1 with a fault.
        command: the thrusters', which the speed goes with in proportion; None: not told, and 1.
        speed_mps: at full command.
        surge_s: time constant with which the speed follows.
        pitch_rad: nose up.
        noise_m: standard deviation of each coordinate of a position.
    """

    heading: OfTime
    flow: Callable[[float], Sequence[float]] = lambda t: (0.3, -0.2, 0.0)
    power: OfTime = lambda t: 1.0
    command: OfTime | None = None
    speed_mps: float = 1.0
    surge_s: float = 1.0
    pitch_rad: float = 0.0
    noise_m: float = 0.1

    def poses(self, times: Sequence[float], seed: int = 0) -> list[PoseSample]:
        """What is measured at these times."""
        rng = np.random.default_rng(seed)
        place = np.zeros(3)
        speed_mps = self._wanted_mps(times[0])
        samples = [self._pose(times[0], place, rng)]
        for before, now in pairwise(times):
            pieces = ceil((now - before) / PIECE_S)
            piece_s = (now - before) / pieces
            for k in range(pieces):
                t = before + (k + 0.5) * piece_s
                speed_mps += (self._wanted_mps(t) - speed_mps) * (1.0 - exp(-piece_s / self.surge_s))
                place = place + piece_s * (np.asarray(self.flow(t)) + speed_mps * self._bow(t))
            samples.append(self._pose(now, place, rng))
        return samples

    def _wanted_mps(self, t: float) -> float:
        return self.speed_mps * self.power(t) * (1.0 if self.command is None else self.command(t))

    def _bow(self, t: float) -> np.ndarray:
        level = cos(self.pitch_rad)
        return np.array((level * cos(self.heading(t)), level * sin(self.heading(t)), -sin(self.pitch_rad)))

    def _pose(self, t: float, place: np.ndarray, rng: np.random.Generator) -> PoseSample:
        seen = place + self.noise_m * rng.normal(size=3)
        return PoseSample(
            time_s=t,
            north_m=float(seen[0]),
            east_m=float(seen[1]),
            down_m=float(seen[2]),
            heading_rad=self.heading(t),
            pitch_rad=self.pitch_rad,
            command=None if self.command is None else self.command(t),
        )


def apart(one: Sequence[float], other: Sequence[float]) -> float:
    """Length of the difference of two vectors."""
    return hypot(*(a - b for a, b in zip(one, other, strict=True)))
