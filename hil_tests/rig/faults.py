"""Scripted faults of a simulated thruster: what breaks, when, how fast and how badly."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from math import inf, isfinite


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
        if not isfinite(self.onset_s):
            raise ValueError(f"onset_s = {self.onset_s}: want a finite time")
        if not (isfinite(self.ramp_s) and self.ramp_s >= 0.0):
            raise ValueError(f"ramp_s = {self.ramp_s}: want 0 or more seconds")
        if not self.end_s > self.onset_s:
            raise ValueError(f"end_s = {self.end_s}: want a time after onset_s = {self.onset_s}")
        worst = WORST_BRAKING if self.type in GRADED else 1.0
        if not 0.0 < self.severity <= worst:
            raise ValueError(f"severity = {self.severity}: want above 0 and at most {worst} for {self.type}")

    def strength(self, time_s: float) -> float:
        """How bad it is at an instant, 0 to `severity`, rising linearly over the ramp."""
        if not self.onset_s <= time_s < self.end_s:
            return 0.0
        if time_s - self.onset_s >= self.ramp_s:
            return self.severity
        return self.severity * (time_s - self.onset_s) / self.ramp_s


def strengths(faults: Iterable[InjectedFault], time_s: float) -> dict[FaultType, float]:
    """The faults that act at an instant, the worst of each type."""
    acting: dict[FaultType, float] = {}
    for fault in faults:
        strength = fault.strength(time_s)
        if strength > 0.0:
            acting[fault.type] = max(strength, acting.get(fault.type, 0.0))
    return acting
