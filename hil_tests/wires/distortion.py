"""What a fault makes of a measured or commanded value, sample by sample: CAN and MAVLink wires share it.

A value is a vector of one component or several, in the unit of the failure table's quantities: rpm, shares of full
thrust, m/s, m, degrees. The time is passed in, as seconds since the start. The same seed does the same.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from math import floor
from typing import Protocol, TypeAlias

import numpy as np

from hil_tests.scenario.fault import Fault

Vector: TypeAlias = tuple[float, ...]


class Distortion:
    """All faults of one signal, one upon the other in their order.

    Of the whole table of sensors it knows each failure, and those of one target alone that change the value:
    "dropped_pulses", "reset" (of north and east, the first two components) and "no_lock" (zeros; that the sensor
    says so itself is its message's affair). A ramp lets sizes grow, a delay too; what is wrong or garbage glides
    there from the true value; "off", "stuck", "slow", "intermittent" and "reverse" are there at once.

    Args:
        faults: of the same signal.
        seed: of all chance in them.

    Raises:
        ValueError: a failure that is not of a value, such as a frame's.
    """

    def __init__(self, faults: Sequence[Fault], seed: int = 0) -> None:
        self._effects = [(fault, _effect(fault, seed, place)) for place, fault in enumerate(faults)]

    def active(self, since_s: float) -> bool:
        """Whether any of the faults is there."""
        return any(fault.active(since_s) for fault, _ in self._effects)

    def value(self, since_s: float, vector: Vector) -> Vector | None:
        """What is said instead of the true value: the very same object where no fault is active; None: nothing.

        To be asked of every sample, those before the onset as well: what is stuck or late repeats them.

        Args:
            since_s: not earlier than that of the sample before.
            vector: (N,) as it was measured.
        """
        said: Vector | None = vector
        for fault, effect in self._effects:
            if said is None:
                return None
            if fault.active(since_s):
                said = _on_axis(fault, said, effect.said(since_s, said))
            else:
                effect.healthy(since_s, said)
        return said


class _Effect(Protocol):
    """One fault at work."""

    def healthy(self, since_s: float, vector: Vector) -> None:
        """A sample outside of the fault's time."""
        ...

    def said(self, since_s: float, vector: Vector) -> Vector | None:
        """What all components would be within it."""
        ...


def _effect(fault: Fault, seed: int, place: int) -> _Effect:
    if fault.failure in _REMEMBERING:
        return _REMEMBERING[fault.failure](fault)
    if fault.failure not in _SHAPES:
        known = ", ".join(sorted({*_REMEMBERING, *_SHAPES}))
        raise ValueError(f"failure {fault.failure!r} of {fault.subject.name} changes no value: want one of {known}")
    return _Shaped(fault, np.random.default_rng([seed, place]))


def _on_axis(fault: Fault, true: Vector, changed: Vector | None) -> Vector | None:
    """The change on the fault's axis only; a sample that does not come does so as a whole."""
    if changed is None or fault.axis is None:
        return changed
    return (*true[: fault.axis], changed[fault.axis], *true[fault.axis + 1 :])


class _Stuck:
    """The newest value from before the onset; where there was none, the first one after it."""

    def __init__(self, _fault: Fault) -> None:
        self._held: Vector | None = None

    def healthy(self, _since_s: float, vector: Vector) -> None:
        self._held = vector

    def said(self, _since_s: float, vector: Vector) -> Vector | None:
        self._held = vector if self._held is None else self._held
        return self._held


class _Slow:
    """One sample an interval, the first that comes in it."""

    def __init__(self, fault: Fault) -> None:
        self._onset_s = fault.at_s
        self._interval_s = fault.values["interval_s"]
        self._newest = -1

    def healthy(self, _since_s: float, _vector: Vector) -> None:
        self._newest = -1

    def said(self, since_s: float, vector: Vector) -> Vector | None:
        interval = floor((since_s - self._onset_s) / self._interval_s)
        if interval == self._newest:
            return None
        self._newest = interval
        return vector


class _Delayed:
    """The value of some time ago. At the onset it stands still until it is late enough: time never runs back."""

    def __init__(self, fault: Fault) -> None:
        self._fault = fault
        self._history: deque[tuple[float, Vector]] = deque()
        self._told_s = fault.at_s  # of this instant is what was said last

    def healthy(self, since_s: float, vector: Vector) -> None:
        self._history.clear()
        self._history.append((since_s, vector))

    def said(self, since_s: float, vector: Vector) -> Vector | None:
        self._history.append((since_s, vector))
        delay_s = self._fault.values["delay_s"] * self._fault.grown(since_s)
        self._told_s = max(self._told_s, since_s - delay_s)
        while len(self._history) > 1 and self._history[1][0] <= self._told_s:
            self._history.popleft()
        return self._history[0][1]


_REMEMBERING: dict[str, Callable[[Fault], _Effect]] = {"stuck": _Stuck, "slow": _Slow, "delayed": _Delayed}


class _Shaped:
    """A failure whose value follows from the true one and the time alone."""

    def __init__(self, fault: Fault, random: np.random.Generator) -> None:
        self._fault = fault
        self._random = random
        self._shape = _SHAPES[fault.failure]

    def healthy(self, _since_s: float, _vector: Vector) -> None:
        """Nothing of it is needed."""

    def said(self, since_s: float, vector: Vector) -> Vector | None:
        return self._shape(self._fault, since_s, vector, self._random)


def _off(_fault: Fault, _since_s: float, _vector: Vector, _random: np.random.Generator) -> None:
    return None


def _intermittent(fault: Fault, since_s: float, vector: Vector, _random: np.random.Generator) -> Vector | None:
    period_s = fault.values["period_s"]
    return vector if (since_s - fault.at_s) % period_s < 0.5 * period_s else None


def _garbage(fault: Fault, since_s: float, vector: Vector, random: np.random.Generator) -> Vector:
    said = random.normal(0.0, _size(fault, "spread_"), len(vector)).tolist()
    return _glided(vector, said, fault.grown(since_s))


def _wrong(fault: Fault, since_s: float, vector: Vector, _random: np.random.Generator) -> Vector:
    return _glided(vector, [_size(fault, "value_")] * len(vector), fault.grown(since_s))


def _scale(fault: Fault, since_s: float, vector: Vector, _random: np.random.Generator) -> Vector:
    return _multiplied(vector, 1.0 + fault.grown(since_s) * (fault.values["factor"] - 1.0))


def _dropped_pulses(fault: Fault, since_s: float, vector: Vector, _random: np.random.Generator) -> Vector:
    return _multiplied(vector, 1.0 - fault.grown(since_s) * fault.values["share"])


def _reverse(_fault: Fault, _since_s: float, vector: Vector, _random: np.random.Generator) -> Vector:
    return _multiplied(vector, -1.0)


def _no_lock(_fault: Fault, _since_s: float, vector: Vector, _random: np.random.Generator) -> Vector:
    return (0.0,) * len(vector)


def _bias(fault: Fault, since_s: float, vector: Vector, _random: np.random.Generator) -> Vector:
    return _added(vector, [_size(fault, "bias_") * fault.grown(since_s)] * len(vector))


def _drift(fault: Fault, since_s: float, vector: Vector, _random: np.random.Generator) -> Vector:
    return _added(vector, [_size(fault, "drift_") * _grown_time_s(fault, since_s)] * len(vector))


def _noise(fault: Fault, since_s: float, vector: Vector, random: np.random.Generator) -> Vector:
    deviation = _size(fault, "noise_") * fault.grown(since_s)
    return _added(vector, random.normal(0.0, deviation, len(vector)).tolist())


def _reset(fault: Fault, since_s: float, vector: Vector, _random: np.random.Generator) -> Vector:
    jump = (fault.values["north_m"], fault.values["east_m"], *([0.0] * len(vector)))
    return _added(vector, [fault.grown(since_s) * part for part in jump[: len(vector)]])


_Shape = Callable[[Fault, float, Vector, np.random.Generator], Vector | None]
_SHAPES: dict[str, _Shape] = {
    "off": _off,
    "intermittent": _intermittent,
    "garbage": _garbage,
    "wrong": _wrong,
    "scale": _scale,
    "dropped_pulses": _dropped_pulses,
    "reverse": _reverse,
    "no_lock": _no_lock,
    "bias": _bias,
    "drift": _drift,
    "noise": _noise,
    "reset": _reset,
}


def _size(fault: Fault, prefix: str) -> float:
    """The quantity of that name, whatever its unit."""
    return next(value for name, value in fault.values.items() if name.startswith(prefix))


def _grown_time_s(fault: Fault, since_s: float) -> float:
    """The integral of `Fault.grown` over the time since the onset."""
    passed_s = since_s - fault.at_s
    if passed_s >= fault.ramp_s:
        return passed_s - 0.5 * fault.ramp_s
    return 0.5 * passed_s * passed_s / fault.ramp_s


def _added(vector: Vector, errors: Sequence[float]) -> Vector:
    return tuple(value + error for value, error in zip(vector, errors, strict=True))


def _multiplied(vector: Vector, factor: float) -> Vector:
    return tuple(value * factor for value in vector)


def _glided(vector: Vector, target: Sequence[float], grown: float) -> Vector:
    return tuple((1.0 - grown) * value + grown * said for value, said in zip(vector, target, strict=True))
