"""The detectors that the battery of contracts runs over, each with data of its own kind."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import numpy as np

from detectors.thruster import ThrusterConfig, ThrusterDetector, ThrusterSample, ThrusterVerdict
from detectors.thruster.tests.simulation import Thruster, cruising, lasting


@dataclass(frozen=True)
class Subject:
    """A detector under test.

    Attributes:
        make: a new detector.
        healthy, faulty: samples; the fault begins after the warm-up, is found, and lasts to the end.
        still_faulty: samples that go on from `faulty` in the same state.
        warmup: first samples of any data that are not judged, whatever they hold.
        measured: fields of a sample that must be finite.
        rescaled: by name, a change of unit of one of the inputs: sample and factor to sample.
        garbage: a sample of this time and these arbitrary floats.
        judge: verdicts of these samples, in the quickest way that equals the loop over `update`.
    """

    name: str
    make: Callable[[], Any]
    healthy: tuple[Any, ...]
    faulty: tuple[Any, ...]
    still_faulty: tuple[Any, ...]
    warmup: int
    measured: tuple[str, ...]
    rescaled: dict[str, Callable[[Any, float], Any]]
    garbage: Callable[[float, np.ndarray], Any]
    judge: Callable[[Any, Sequence[Any]], list[Any]]

    @cached_property
    def verdicts(self) -> list[Any]:
        """What a detector says of `faulty`, one by one, left to itself."""
        detector = self.make()
        return [detector.update(sample) for sample in self.faulty]


def bits(verdict: Any) -> tuple[object, ...]:
    """The fields of a verdict so that only what is identical is equal: NaN equals NaN, 0.0 is not -0.0."""
    values = (getattr(verdict, field.name) for field in fields(verdict))
    return tuple(value.hex() if isinstance(value, float) else value for value in values)


def all_bits(verdicts: Iterable[Any]) -> list[tuple[object, ...]]:
    return [bits(verdict) for verdict in verdicts]


def _run(detector: ThrusterDetector, samples: Sequence[ThrusterSample]) -> list[ThrusterVerdict]:
    rows = [(s.time_s, s.command, s.speed_rpm, s.voltage_v, s.current_a) for s in samples]
    verdicts = detector.run(*np.array(rows, dtype=float).T)
    return [verdicts.row(number) for number in range(len(verdicts))]


def _thruster(name: str, config: ThrusterConfig, *, lag: float, found_within: int) -> Subject:
    onset = config.spans[2] + 250
    end = onset + found_within
    count = end + 200
    simulated = Thruster(lag=lag)
    command = cruising(count, seed=5)
    healthy = simulated.simulate(command, seed=5)[:end]
    faulty = tuple(simulated.simulate(command, gain=lasting(count, onset, 0.7), seed=5).samples())
    return Subject(
        name=name,
        make=lambda: ThrusterDetector(config),
        healthy=tuple(healthy.samples()),
        faulty=faulty[:end],
        still_faulty=faulty[end:],
        warmup=config.spans[2] - 1,
        measured=("time_s", "command", "speed_rpm"),
        rescaled={
            "command": lambda sample, factor: replace(sample, command=sample.command * factor),
            "speed": lambda sample, factor: replace(sample, speed_rpm=sample.speed_rpm * factor),
        },
        garbage=lambda time_s, values: ThrusterSample(time_s, *values[:4].tolist()),
        judge=_run,
    )


_SHORT = {"window_min": 30, "window_max": 150, "warmup": 200, "order_max": 3}

SUBJECTS = (
    _thruster("thruster exact", ThrusterConfig(), lag=2.5, found_within=120),
    _thruster("thruster swarm", ThrusterConfig(search="swarm", seed=3), lag=2.5, found_within=120),
    # the paper's method learns a fault within window_min, so that its series end while the fault is new
    _thruster("paper exact", ThrusterConfig(dynamics=False, **_SHORT), lag=0.0, found_within=12),
    _thruster("paper swarm", ThrusterConfig(dynamics=False, search="swarm", **_SHORT), lag=0.0, found_within=12),
)
