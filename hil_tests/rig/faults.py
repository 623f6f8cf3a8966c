"""Scripted faults of simulated thrusters and of the hull: what breaks, when, how fast and how badly."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from math import inf, isfinite, prod


class FaultType(StrEnum):
    """What can happen to a thruster, and what `severity` means for it."""

    ENTANGLED = "entangled"  # weeds or line brake the propeller; severity: share of the full-throttle speed lost
    WORN = "worn"  # weak magnets, windings or ESC; severity: share of the full-throttle speed lost
    PROPELLER_LOST = "propeller lost"  # severity: share of the propeller's torque that is gone
    BLOCKED = "blocked"  # the rotor is held; severity: share of the speed lost
    DEAD = "dead"  # the ESC drives no more; severity: share of the drive voltage lost
    SENSOR_FROZEN = "sensor frozen"  # the last RPM is repeated; severity has no meaning
    SENSOR_DROPPING = "sensor dropping"  # severity: share of the Hall pulses that get lost


# A propeller slowed down further than this is blocked: the torque needed for it grows without bound.
WORST_BRAKING = 0.95
GRADED = frozenset({FaultType.ENTANGLED, FaultType.WORN})


@dataclass(frozen=True, slots=True, kw_only=True)
class InjectedFault:
    """One fault on one thruster.

    Attributes:
        type: what happens.
        onset_s: when it begins.
        severity: how bad it gets, 0 to 1; its meaning stands beside each `FaultType`.
        ramp_s: how long it takes to get that bad; 0.0 = at once.
        end_s: when it is gone again.

    Raises:
        ValueError: a time is not finite or negative, or the severity is out of range.
    """

    type: FaultType
    onset_s: float
    severity: float = 1.0
    ramp_s: float = 0.0
    end_s: float = inf

    def __post_init__(self) -> None:
        _check_times(self.onset_s, self.ramp_s, self.end_s)
        worst = WORST_BRAKING if self.type in GRADED else 1.0
        if not 0.0 < self.severity <= worst:
            raise ValueError(f"severity = {self.severity}: want above 0 and at most {worst} for {self.type}")

    def strength(self, time_s: float) -> float:
        """How bad it is at an instant, 0 to `severity`, rising linearly over the ramp."""
        return self.severity * _share(time_s, self.onset_s, self.ramp_s, self.end_s)


@dataclass(frozen=True, slots=True, kw_only=True)
class HullFault:
    """A net, a line or growth on the hull: all of its drag is multiplied, while the thrusters turn as they did.

    Attributes:
        drag_factor: what the drag is multiplied by at last. Where it grows with the square of the speed, 4 halves the
            speed; a BlueROV2's has a linear part, so that 3.5 does at 1.4 m/s.
        onset_s: when it begins.
        ramp_s: how long it takes to get that bad; 0.0 = at once.
        end_s: when it is gone again.

    Raises:
        ValueError: a time is not finite or negative, or the factor is not above one.
    """

    drag_factor: float
    onset_s: float
    ramp_s: float = 0.0
    end_s: float = inf

    def __post_init__(self) -> None:
        _check_times(self.onset_s, self.ramp_s, self.end_s)
        if not (isfinite(self.drag_factor) and self.drag_factor > 1.0):
            raise ValueError(f"drag_factor = {self.drag_factor}: want a number above 1")

    def factor(self, time_s: float) -> float:
        """What the drag is multiplied by at an instant, rising linearly over the ramp; 1.0: nothing there."""
        return 1.0 + (self.drag_factor - 1.0) * _share(time_s, self.onset_s, self.ramp_s, self.end_s)


def drag_factor(faults: Iterable[HullFault], time_s: float) -> float:
    """What the drag is multiplied by at an instant by all that has caught on the hull, one upon the other."""
    return prod(fault.factor(time_s) for fault in faults)


def strengths(faults: Iterable[InjectedFault], time_s: float) -> dict[FaultType, float]:
    """The faults that act at an instant, the worst of each type."""
    acting: dict[FaultType, float] = {}
    for fault in faults:
        strength = fault.strength(time_s)
        if strength > 0.0:
            acting[fault.type] = max(strength, acting.get(fault.type, 0.0))
    return acting


def _check_times(onset_s: float, ramp_s: float, end_s: float) -> None:
    if not isfinite(onset_s):
        raise ValueError(f"onset_s = {onset_s}: want a finite time")
    if not (isfinite(ramp_s) and ramp_s >= 0.0):
        raise ValueError(f"ramp_s = {ramp_s}: want 0 or more seconds")
    if not end_s > onset_s:
        raise ValueError(f"end_s = {end_s}: want a time after onset_s = {onset_s}")


def _share(time_s: float, onset_s: float, ramp_s: float, end_s: float) -> float:
    """0 before the onset and from the end on, 1 after the ramp, linear in between."""
    if not onset_s <= time_s < end_s:
        return 0.0
    since_s = time_s - onset_s
    return 1.0 if since_s >= ramp_s else since_s / ramp_s
