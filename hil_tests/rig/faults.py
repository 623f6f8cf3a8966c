"""Scripted faults of thrusters, ESCs, battery and hull: what breaks, when, how fast and how badly."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from enum import StrEnum
from math import cos, floor, inf, isfinite, prod, sin

LONGEST_DELAY_S = 60.0


class FaultType(StrEnum):
    """What can happen to a thruster, and what `severity` means for it."""

    ENTANGLED = "entangled"  # weeds or line brake the propeller; severity: share of the full-throttle speed lost
    WORN = "worn"  # weak magnets, windings or ESC; severity: share of the full-throttle speed lost
    PROPELLER_LOST = "propeller lost"  # severity: share of the propeller's torque that is gone
    BLOCKED = "blocked"  # the rotor is held; severity: share of the speed lost
    DEAD = "dead"  # the ESC drives no more; severity: share of the drive voltage lost
    SENSOR_FROZEN = "sensor frozen"  # the last RPM is repeated; severity has no meaning
    SENSOR_DROPPING = "sensor dropping"  # severity: share of the Hall pulses that get lost
    REVERSED = "reversed"  # two phases are swapped: it turns the other way; severity has no meaning
    DELAYED = "delayed"  # severity: seconds by which it obeys later
    SLOW = "slow"  # severity: by how many times its time constants are longer than they were, 1.0 doubles them


# A propeller slowed down further than this is blocked: the torque needed for it grows without bound.
WORST_BRAKING = 0.95
WORST = {
    FaultType.ENTANGLED: WORST_BRAKING,
    FaultType.WORN: WORST_BRAKING,
    FaultType.DELAYED: LONGEST_DELAY_S,
    FaultType.SLOW: inf,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class InjectedFault:
    """One fault on one thruster.

    Attributes:
        type: what happens.
        onset_s: when it begins.
        severity: how bad it gets, 0 to 1, or more where it is no share; its meaning stands beside each `FaultType`.
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
        worst = WORST.get(self.type, 1.0)
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Pull:
    """Something pulls at the hull, level and always in the same direction: the tether, a diver, a net that drifts.

    Attributes:
        newtons: at last.
        towards_rad: true bearing.
        onset_s, ramp_s, end_s: as of a `HullFault`.

    Raises:
        ValueError: a number is not finite or out of its range.
    """

    newtons: float
    towards_rad: float
    onset_s: float
    ramp_s: float = 0.0
    end_s: float = inf

    def __post_init__(self) -> None:
        _check_times(self.onset_s, self.ramp_s, self.end_s)
        if not (isfinite(self.newtons) and self.newtons >= 0.0):
            raise ValueError(f"newtons = {self.newtons}: want a force, 0 or more")
        if not isfinite(self.towards_rad):
            raise ValueError(f"towards_rad = {self.towards_rad}: want a finite bearing")

    def force_n(self, time_s: float, yaw_rad: float) -> tuple[float, float]:
        """Ahead and to the right of a hull that heads `yaw_rad`."""
        newtons = self.newtons * _share(time_s, self.onset_s, self.ramp_s, self.end_s)
        off_rad = self.towards_rad - yaw_rad
        return newtons * cos(off_rad), newtons * sin(off_rad)


@dataclass(frozen=True, slots=True, kw_only=True)
class Sag:
    """The supply falls, whatever the load.

    Attributes:
        drop_v: at last.
        onset_s, ramp_s, end_s: as of a `HullFault`.

    Raises:
        ValueError: a number is not finite or out of its range.
    """

    drop_v: float
    onset_s: float
    ramp_s: float = 0.0
    end_s: float = inf

    def __post_init__(self) -> None:
        _check_times(self.onset_s, self.ramp_s, self.end_s)
        if not (isfinite(self.drop_v) and self.drop_v >= 0.0):
            raise ValueError(f"drop_v = {self.drop_v}: want volts, 0 or more")

    def volts(self, time_s: float) -> float:
        """What is missing at an instant."""
        return self.drop_v * _share(time_s, self.onset_s, self.ramp_s, self.end_s)


@dataclass(frozen=True, slots=True, kw_only=True)
class EscReset:
    """An ESC that restarts, again and again while it lasts: it drives nothing and says nothing until it is up again.

    Attributes:
        onset_s: of the first restart.
        silent_s: until it is up.
        every_s: from restart to restart.
        end_s: after this there is no further one.

    Raises:
        ValueError: a time is out of its range.
    """

    onset_s: float
    silent_s: float
    every_s: float = inf
    end_s: float = inf

    def __post_init__(self) -> None:
        _check_times(self.onset_s, 0.0, self.end_s)
        for name in ("silent_s", "every_s"):
            if not getattr(self, name) > 0.0:
                raise ValueError(f"{name} = {getattr(self, name)}: want seconds above 0")

    def began(self, time_s: float) -> int:
        """How many restarts have begun by then."""
        if time_s < self.onset_s:
            return 0
        last_s = min(time_s, self.end_s)
        return 1 + floor((last_s - self.onset_s) / self.every_s)

    def silent(self, time_s: float) -> bool:
        """Whether it is down."""
        began = self.began(time_s)
        if began == 0:
            return False
        return time_s - (self.onset_s + (0.0 if began == 1 else (began - 1) * self.every_s)) < self.silent_s


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
