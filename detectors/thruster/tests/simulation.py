"""A simulated thruster, for tests: command in, speed, voltage and current out, healthy or with faults scripted."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from detectors.thruster import ThrusterSample

FloatArray = NDArray[np.float64]

RATE_HZ = 50.0
TOP_RPM = 3000.0
FULL_A, IDLE_A = 18.0, 0.4
NOMINAL_V = 16.0


@dataclass(frozen=True, slots=True, eq=False)
class Series:
    """Samples of one thruster, (N,) each; voltage and current None where not measured."""

    time_s: FloatArray
    command: FloatArray
    speed_rpm: FloatArray
    voltage_v: FloatArray | None = None
    current_a: FloatArray | None = None

    def __len__(self) -> int:
        return len(self.time_s)

    def __getitem__(self, where: slice | NDArray[np.bool_]) -> Series:
        columns = (getattr(self, name) for name in self.__slots__)
        return Series(*(None if column is None else column[where] for column in columns))

    def samples(self) -> Iterator[ThrusterSample]:
        absent = [None] * len(self)
        voltage = absent if self.voltage_v is None else self.voltage_v.tolist()
        current = absent if self.current_a is None else self.current_a.tolist()
        rows = zip(
            self.time_s.tolist(), self.command.tolist(), self.speed_rpm.tolist(), voltage, current, strict=True
        )
        return (ThrusterSample(*row) for row in rows)

    @property
    def arguments(self) -> tuple[FloatArray | None, ...]:
        """What `ThrusterDetector.run` takes."""
        return tuple(getattr(self, name) for name in self.__slots__)

    def spoiled(self, where: slice | list[int], **values: float) -> Series:
        """The same with these columns set to these values there."""
        columns = {name: getattr(self, name).copy() for name in values}
        for name, value in values.items():
            columns[name][where] = value
        return replace(self, **columns)


@dataclass(frozen=True, slots=True, kw_only=True)
class Thruster:
    """A first-order motor behind a static curve and a delay.

    Attributes:
        delay, lag: samples.
        bend: exponent of speed over command; 1.0 is proportional.
        astern: speed at full command astern over that ahead.
        dead_band: of the full command, at either side of neutral.
        noise: of the speed's measurement, in top speeds.
        signed: whether the sensor gives the direction.
    """

    delay: int = 3
    lag: float = 2.5
    bend: float = 0.9
    astern: float = 0.85
    dead_band: float = 0.0
    noise: float = 0.003
    signed: bool = True

    def simulate(
        self,
        command: FloatArray,
        *,
        gain: FloatArray | float = 1.0,
        load: FloatArray | float = 1.0,
        voltage_v: FloatArray | None = None,
        current: bool = False,
        seed: int = 0,
        start_s: float = 0.0,
    ) -> Series:
        """The series that this command (fractions -1..1) gives.

        Args:
            gain: (N,) factor on the steady speed: below 1 entangled, above 1 propeller lost, 0 at a standstill.
            load: (N,) factor on the propeller's torque.
            voltage_v: (N,) supply; the speed goes with its 0.8th power.
            current: whether the current is measured.
        """
        rng = np.random.default_rng(seed)
        steady = self._steady(self._delayed(command)) * gain
        if voltage_v is not None:
            steady = steady * (voltage_v / NOMINAL_V) ** 0.8
        speed = _lagged(steady, self.lag)
        measured = speed + rng.normal(0.0, self.noise, len(command)) * (np.abs(speed) > 1e-3)
        amperes = None
        if current:
            amperes = IDLE_A * (np.abs(speed) > 1e-3) + FULL_A * np.abs(speed) ** 3 * load
            amperes = amperes + rng.normal(0.0, 0.05, len(command))
        return Series(
            start_s + np.arange(len(command)) / RATE_HZ,
            command.copy(),
            TOP_RPM * (measured if self.signed else np.abs(measured)),
            voltage_v,
            amperes,
        )

    def _delayed(self, command: FloatArray) -> FloatArray:
        return np.concatenate([np.full(self.delay, command[0]), command[: len(command) - self.delay]])

    def _steady(self, command: FloatArray) -> FloatArray:
        beyond = np.maximum(np.abs(command) - self.dead_band, 0.0) / (1.0 - self.dead_band)
        return np.where(command < 0.0, -self.astern, 1.0) * beyond**self.bend


def _lagged(steady: FloatArray, lag: float) -> FloatArray:
    follow = 1.0 - np.exp(-1.0 / lag) if lag > 0.0 else 1.0
    speed, out = float(steady[0]), []
    for target in steady.tolist():
        speed += follow * (target - speed)
        out.append(speed)
    return np.array(out)


def cruising(samples: int, seed: int = 0, low: float = 0.15, high: float = 1.0) -> FloatArray:
    """(N,) commands in one direction that hold, ramp and swing between `low` and `high`."""
    rng = np.random.default_rng(seed)
    pieces: list[FloatArray] = []
    last, total = float(rng.uniform(low, high)), 0
    while total < samples:
        length, goal = int(rng.integers(25, 120)), float(rng.uniform(low, high))
        piece = _piece(int(rng.integers(3)), length, last, goal, low, high)
        last, total = float(piece[-1]), total + length
        pieces.append(piece)
    return np.concatenate(pieces)[:samples]


def _piece(shape: int, length: int, last: float, goal: float, low: float, high: float) -> FloatArray:
    if shape == 0:
        return np.full(length, goal)
    if shape == 1:
        return np.linspace(last, goal, length)
    swing = min(goal - low, high - goal)
    return goal + swing * np.sin(np.arange(length) * 2.0 * np.pi / 30.0)


def working(samples: int, seed: int = 0) -> FloatArray:
    """(N,) commands both ways: swings through zero, holds either way, rests at neutral."""
    rng = np.random.default_rng(seed)
    pieces: list[FloatArray] = []
    total = 0
    while total < samples:
        length = int(rng.integers(40, 160))
        size, period = float(rng.uniform(0.4, 1.0)), float(rng.uniform(60.0, 150.0))
        hold = float(rng.choice([-1.0, 1.0]) * rng.uniform(0.3, 1.0))
        swing = size * np.sin(np.arange(length) * 2.0 * np.pi / period + rng.uniform(0.0, 6.28))
        pieces.append([swing, swing, np.full(length, hold), np.zeros(length // 4)][int(rng.integers(4))])
        total += len(pieces[-1])
    return np.concatenate(pieces)[:samples]


def lasting(samples: int, start: int, value: float, stop: int | None = None) -> FloatArray:
    """(N,) ones, but `value` from sample `start` to before `stop`."""
    out = np.ones(samples)
    out[start:stop] = value
    return out
