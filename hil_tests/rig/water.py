"""Water that moves: what the current does at a time and a place, for the simulated hull to be carried along.

A hull of the water's own density that is set into moving water keeps its velocity *through* the water, whatever the
water's acceleration: the pressure gradient that accelerates the water accelerates the hull as well. So a current only
adds to the track over ground, and does not show in thrust, RPM or drag.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, isfinite, pi
from typing import Protocol

Velocity = tuple[float, float, float]
Position = tuple[float, float, float]
AT_REST: Velocity = (0.0, 0.0, 0.0)


class Water(Protocol):
    """A body of water with a current in it."""

    def velocity_mps(self, time_s: float, position_m: Position) -> Velocity:
        """Velocity north, east, down at a place (north, east, down), in seconds since the start."""


@dataclass(frozen=True, slots=True)
class Current:
    """The same velocity everywhere and always.

    Raises:
        ValueError: a component is not finite.
    """

    north_mps: float = 0.0
    east_mps: float = 0.0
    down_mps: float = 0.0

    def __post_init__(self) -> None:
        for name, value in (("north_mps", self.north_mps), ("east_mps", self.east_mps), ("down_mps", self.down_mps)):
            _want(name, value, isfinite(value), "a finite velocity")

    def velocity_mps(self, time_s: float, position_m: Position) -> Velocity:
        """The same."""
        return self.north_mps, self.east_mps, self.down_mps


@dataclass(frozen=True, slots=True)
class SettingIn:
    """Water that is at rest, and begins to move as a vehicle leaves the lee of something.

    Attributes:
        water: what it moves like at last.
        onset_s: when it begins.
        ramp_s: how long it takes, rising and ending smoothly; 0.0 = at once.

    Raises:
        ValueError: a time is not finite, or the ramp negative.
    """

    water: Water
    onset_s: float
    ramp_s: float = 0.0

    def __post_init__(self) -> None:
        _want("onset_s", self.onset_s, isfinite(self.onset_s), "a finite time")
        _want("ramp_s", self.ramp_s, isfinite(self.ramp_s) and self.ramp_s >= 0.0, "0 or more seconds")

    def velocity_mps(self, time_s: float, position_m: Position) -> Velocity:
        """The share that has set in, of what it is like at last."""
        return _scaled(self.water.velocity_mps(time_s, position_m), self._share(time_s - self.onset_s))

    def _share(self, since_s: float) -> float:
        if since_s <= 0.0:
            return 0.0
        return 1.0 if since_s >= self.ramp_s else 0.5 - 0.5 * cos(pi * since_s / self.ramp_s)


@dataclass(frozen=True, slots=True)
class Tide:
    """A rotary tidal current: an ellipse of velocity, run through once in a period.

    Attributes:
        north_mps, east_mps: amplitudes.
        period_s: 44714 s for the moon's half-daily tide, M2.
        north_phase_rad, east_phase_rad: at time 0; the same for both: it flows to and fro on one line.

    Raises:
        ValueError: the period is not above zero.
    """

    north_mps: float
    east_mps: float
    period_s: float
    north_phase_rad: float = 0.0
    east_phase_rad: float = 0.0

    def __post_init__(self) -> None:
        _want("period_s", self.period_s, isfinite(self.period_s) and self.period_s > 0.0, "seconds above 0")

    def velocity_mps(self, time_s: float, position_m: Position) -> Velocity:
        """Level, and everywhere the same."""
        turned_rad = 2.0 * pi * time_s / self.period_s
        north_mps = self.north_mps * cos(turned_rad + self.north_phase_rad)
        return north_mps, self.east_mps * cos(turned_rad + self.east_phase_rad), 0.0


@dataclass(frozen=True, slots=True)
class Shear:
    """A velocity that changes linearly with the place: with depth, or across a channel.

    Attributes:
        at_origin: velocity where the vehicle's positions count from.
        per_m: by how much it changes for each metre along `across`.
        across: direction of the change, north, east, down; of any length but zero.

    Raises:
        ValueError: `across` has no length.
    """

    at_origin: Velocity
    per_m: Velocity
    across: Velocity = (0.0, 0.0, 1.0)

    def __post_init__(self) -> None:
        _want("across", self.across, any(self.across), "a direction")

    def velocity_mps(self, time_s: float, position_m: Position) -> Velocity:
        """At a place."""
        length = sum(part**2 for part in self.across) ** 0.5
        way_m = sum(part * place for part, place in zip(self.across, position_m, strict=True)) / length
        return _sum(self.at_origin, _scaled(self.per_m, way_m))


@dataclass(frozen=True, slots=True)
class Together:
    """Several currents, one upon the other."""

    parts: tuple[Water, ...]

    def velocity_mps(self, time_s: float, position_m: Position) -> Velocity:
        """Their sum."""
        total = AT_REST
        for part in self.parts:
            total = _sum(total, part.velocity_mps(time_s, position_m))
        return total


def _sum(one: Velocity, other: Velocity) -> Velocity:
    return one[0] + other[0], one[1] + other[1], one[2] + other[2]


def _scaled(velocity: Velocity, factor: float) -> Velocity:
    return factor * velocity[0], factor * velocity[1], factor * velocity[2]


def _want(name: str, value: object, fulfilled: bool, wanted: str) -> None:
    if not fulfilled:
        raise ValueError(f"{name} = {value!r}: want {wanted}")


STILL = Current()
