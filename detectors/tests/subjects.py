"""The detectors that the battery of contracts runs over, each with data of its own kind."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cached_property
from math import pi
from typing import Any

import numpy as np

from detectors.navigation import (
    AttitudeSample,
    DepthSample,
    DvlSample,
    FixSample,
    ImuSample,
    NavigationConfig,
    NavigationDetector,
)
from detectors.navigation.tests import dives as navigation_dives
from detectors.speed import FlowBasis, PoseSample, SpeedConfig, SpeedDetector
from detectors.speed.observed import START_S
from detectors.speed.tests.dives import Dive, every, step_at, zig_zag
from detectors.thruster import ThrusterConfig, ThrusterDetector, ThrusterSample, ThrusterVerdict
from detectors.thruster.tests.simulation import Thruster, cruising, lasting


def _one_by_one(detector: Any, samples: Sequence[Any]) -> list[Any]:
    return [detector.update(sample) for sample in samples]


@dataclass(frozen=True, kw_only=True)
class Subject:
    """A detector under test.

    Attributes:
        make: a new detector.
        healthy, faulty: samples; the fault begins after the warm-up, is found, and lasts to the end.
        still_faulty: samples that go on from `faulty` in the same state.
        interval_s: between two samples.
        warmup: first samples of any data that are not judged, whatever they hold.
        measured: fields of a sample, where it has them, that must be finite.
        exactly: by name, a change of each sample that leaves the scores as they are, to the last bit.
        nearly: by name, one that leaves them as they are but for rounding, and the levels as they are.
        garbage: a sample of this time and these arbitrary floats.
        judge: verdicts of these samples, in the quickest way that equals the loop over `update`.
    """

    name: str
    make: Callable[[], Any]
    healthy: tuple[Any, ...]
    faulty: tuple[Any, ...]
    still_faulty: tuple[Any, ...]
    interval_s: float
    warmup: int
    measured: tuple[str, ...]
    exactly: dict[str, Callable[[Any], Any]]
    nearly: dict[str, Callable[[Any], Any]]
    garbage: Callable[[float, np.ndarray], Any]
    judge: Callable[[Any, Sequence[Any]], list[Any]] = _one_by_one

    @cached_property
    def verdicts(self) -> list[Any]:
        """What a detector says of `faulty`, one by one, left to itself."""
        return _one_by_one(self.make(), self.faulty)


def bits(verdict: Any) -> tuple[object, ...]:
    """The fields of a verdict so that only what is identical is equal: NaN equals NaN, 0.0 is not -0.0."""
    return tuple(_bits(getattr(verdict, field.name)) for field in fields(verdict))


def _bits(value: object) -> object:
    if isinstance(value, tuple):
        return tuple(map(_bits, value))
    if isinstance(value, Mapping):
        return {key: _bits(one) for key, one in value.items()}
    if is_dataclass(value):
        return bits(value)
    return value.hex() if isinstance(value, float) else value


def all_bits(verdicts: Iterable[Any]) -> list[tuple[object, ...]]:
    return [bits(verdict) for verdict in verdicts]


def _run(detector: ThrusterDetector, samples: Sequence[ThrusterSample]) -> list[ThrusterVerdict]:
    rows = [(s.time_s, s.command, s.speed_rpm, s.voltage_v, s.current_a) for s in samples]
    verdicts = detector.run(*np.array(rows, dtype=float).T)
    return [verdicts.row(number) for number in range(len(verdicts))]


def _command_in(unit: float) -> Callable[[ThrusterSample], ThrusterSample]:
    return lambda sample: replace(sample, command=sample.command * unit)


def _speed_in(unit: float) -> Callable[[ThrusterSample], ThrusterSample]:
    return lambda sample: replace(sample, speed_rpm=sample.speed_rpm * unit)


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
        interval_s=0.02,
        warmup=config.spans[2] - 1,
        measured=("time_s", "command", "speed_rpm"),
        exactly={"unit of the command": _command_in(2.0**17), "unit of the speed": _speed_in(2.0**17)},
        nearly={"unit of the command": _command_in(0.0007), "unit of the speed": _speed_in(0.0007)},
        garbage=lambda time_s, values: ThrusterSample(time_s, *values[:4].tolist()),
        judge=_run,
    )


SPEED_INTERVAL_S = 0.25  # a binary fraction: times can be shifted without rounding
ONSET_S, FOUND_S, END_S = 115.0, 140.0, 190.0
_START = round(START_S / SPEED_INTERVAL_S)


def _at_depth(sample: PoseSample) -> PoseSample:
    return replace(sample, down_m=77.7)


def _later(sample: PoseSample) -> PoseSample:
    return replace(sample, time_s=sample.time_s + 2.0**31)


def _far_away(sample: PoseSample) -> PoseSample:
    return replace(sample, north_m=sample.north_m + 2.0**20, east_m=sample.east_m - 2.0**19)


def _whole_turns_added(sample: PoseSample) -> PoseSample:
    return replace(sample, heading_rad=sample.heading_rad - 100.0 * pi)


def _mirrored(sample: PoseSample) -> PoseSample:
    return replace(sample, east_m=-sample.east_m, heading_rad=-sample.heading_rad, sideways=-sample.sideways)


def _quarter_turned(sample: PoseSample) -> PoseSample:
    turned_rad = sample.heading_rad + 0.5 * pi
    return replace(sample, north_m=-sample.east_m, east_m=sample.north_m, heading_rad=turned_rad)


def _speed(name: str, config: SpeedConfig, *, unjudged: int = _START, **dive: Any) -> Subject:
    times = every(SPEED_INTERVAL_S, END_S)
    end = times.index(FOUND_S)
    healthy = Dive(heading=zig_zag(), **dive)
    faulty = replace(healthy, power=step_at(ONSET_S, 1.0, 0.6)).poses(times, seed=5)
    unseen = {"depth": _at_depth} if config.dimensions == 2 else {}
    return Subject(
        name=name,
        make=lambda: SpeedDetector(config),
        healthy=tuple(healthy.poses(times[:end], seed=5)),
        faulty=tuple(faulty[:end]),
        still_faulty=tuple(faulty[end:]),
        interval_s=SPEED_INTERVAL_S,
        warmup=unjudged,
        measured=("time_s", "north_m", "east_m", "heading_rad", "down_m", "pitch_rad"),
        exactly={"epoch": _later, **unseen},
        nearly={
            "origin": _far_away,
            "axes": _quarter_turned,
            "left for right": _mirrored,
            "whole turns": _whole_turns_added,
        },
        garbage=lambda time_s, values: PoseSample(time_s, *values[:7].tolist()),
    )


def _changing(time_s: float) -> float:
    return 0.75 if time_s % 24.0 < 12.0 else 0.95


_RANGE = {"speed_min_mps": 0.75, "speed_max_mps": 1.3}
# the paper's law takes some of a fault for flow, until it has settled: with the usual bound it soon doubts itself
_LOOSE = _RANGE | {"flow_error_max": 0.3}
_UNIFORM = FlowBasis(((0.0, 0.0),), (1e9,))

GARBAGE = {3: DvlSample, 5: DepthSample, 7: FixSample, 11: AttitudeSample}  # of thirteen; the others are the IMU
NAVIGATION_INTERVAL_S = 0.125


def _navigation_garbage(time_s: float, values: np.ndarray) -> Any:
    numbers = values.tolist()
    match GARBAGE.get(round(time_s / NAVIGATION_INTERVAL_S) % 13):
        case None:
            return ImuSample(time_s, tuple(numbers[:3]), tuple(numbers[3:6]))
        case kind if kind in (DvlSample, AttitudeSample):
            return kind(time_s, tuple(numbers[:3]))
        case kind:
            return kind(time_s, *numbers[: 1 if kind is DepthSample else 2])


def _rolled(sample: Any) -> Any:
    """Of another system's attitude only the heading counts."""
    if not isinstance(sample, AttitudeSample):
        return sample
    return AttitudeSample(sample.time_s, (1.0, -1.0, sample.attitude_rad[2]))


def _turned_whole(sample: Any) -> Any:
    if isinstance(sample, FixSample):
        return replace(sample, longitude_rad=sample.longitude_rad + 2.0 * pi)
    if not isinstance(sample, AttitudeSample):
        return sample
    roll, pitch, yaw = sample.attitude_rad
    return AttitudeSample(sample.time_s, (roll, pitch, yaw - 6.0 * pi))


def _navigation(name: str, config: NavigationConfig, dive: navigation_dives.Dive, onset_s: float) -> Subject:
    samples = dive.samples()
    faulty = navigation_dives.changed_depth(samples, lambda _, depth_m: depth_m + 3.0, since_s=onset_s)
    end = next(number for number, sample in enumerate(samples) if sample.time_s > onset_s + 5.0)
    return Subject(
        name=name,
        make=lambda: NavigationDetector(config, dive.initial),
        healthy=tuple(samples[:end]),
        faulty=tuple(faulty[:end]),
        still_faulty=tuple(faulty[end:]),
        interval_s=NAVIGATION_INTERVAL_S,
        warmup=150,
        measured=(
            "time_s",
            "specific_force_mps2",
            "angular_rate_radps",
            "velocity_mps",
            "depth_m",
            "latitude_rad",
            "longitude_rad",
            "attitude_rad",
        ),
        exactly={"another system's roll and pitch": _rolled},
        nearly={"whole turns": _turned_whole},
        garbage=_navigation_garbage,
    )


_NAVIGATED = navigation_dives.Dive(
    motion=navigation_dives.legs, duration_s=80.0, imu_hz=8.0, fix_hz=0.25, attitude_hz=1.0
)

_SHORT = {"window_min": 30, "window_max": 150, "warmup": 200, "order_max": 3}

SUBJECTS = (
    _thruster("thruster exact", ThrusterConfig(), lag=2.5, found_within=120),
    _thruster("thruster swarm", ThrusterConfig(search="swarm", seed=3), lag=2.5, found_within=120),
    # the paper's method learns a fault within window_min, so that its series end while the fault is new
    _thruster("paper exact", ThrusterConfig(dynamics=False, **_SHORT), lag=0.0, found_within=12),
    _thruster("paper swarm", ThrusterConfig(dynamics=False, search="swarm", **_SHORT), lag=0.0, found_within=12),
    _speed("speed", SpeedConfig()),
    _speed("speed in space, by commands", SpeedConfig(dimensions=3), command=_changing, pitch_rad=-0.2),
    _speed("speed kalman", SpeedConfig(estimator="kalman", **_RANGE)),
    _speed("speed adaptive", SpeedConfig(estimator="adaptive", **_LOOSE)),
    _speed("speed published", SpeedConfig(estimator="published", basis=_UNIFORM, **_LOOSE), unjudged=1),
    _navigation("navigation, mounting unknown", NavigationConfig(), _NAVIGATED, 50.0),
    _navigation(
        "navigation, methods compared", NavigationConfig(estimate_installation=False, compare=True), _NAVIGATED, 40.0
    ),
)
