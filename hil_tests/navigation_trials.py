"""What the navigation detector makes of a dive: recorded or simulated, healthy or with faulty sensors."""

from __future__ import annotations

import heapq
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from math import cos, pi
from operator import attrgetter
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from detectors.navigation import (
    AttitudeSample,
    DepthSample,
    DvlSample,
    FaultKind,
    FixSample,
    NavigationSample,
    NavigationVerdict,
    Sensor,
)
from detectors.verdict import Level
from gateway.navigation_data import NavigationData
from hil_tests.navigation_aids import EARTH_RADIUS_M, reference_of
from hil_tests.sensor_faults import SensorFault

FloatArray = NDArray[np.float64]
SENSORS = tuple(Sensor)

# The columns of `NavigationData` that a sensor's values are in.
_ARRAYS: dict[Sensor, tuple[str, slice]] = {
    Sensor.DVL: ("dvl", slice(1, 4)),
    Sensor.DEPTH: ("depth", slice(1, 2)),
    Sensor.ACCELEROMETER: ("imu", slice(1, 4)),
    Sensor.GYROSCOPE: ("imu", slice(4, 7)),
}


class Watch(Protocol):
    """What is tried: judges samples one by one."""

    def update(self, sample: NavigationSample) -> NavigationVerdict: ...


@dataclass(frozen=True, slots=True)
class Event:
    """A FAULT that begins.

    Attributes:
        time_s: of the sample with which it begins, of whatever kind that is.
        sensor: which is named; None: one of several, or not known. kind: what is said of it.
    """

    time_s: float
    sensor: Sensor | None
    kind: FaultKind | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Record:
    """What a detector said, at each of the E samples of DVL and depth.

    Attributes:
        time_s: (E,)
        level: (E,) of the verdict. levels: (E, 4) of each sensor, in the order of `SENSORS`.
        isolated: (E, 4) whether its measurements were not used.
        innovation: (E, 4)
        statistics: (E,) by the method's name, as shares of its threshold; NaN where it said none.
        position: (E, 3) latitude and longitude in rad, depth in m.
        deviation_m: (E,) of the position, as the detector saw it.
        reasons: (E,) in words.
        events: FAULTs that began, at any sample.
    """

    time_s: FloatArray
    level: NDArray[np.int8]
    levels: NDArray[np.int8]
    isolated: NDArray[np.bool_]
    innovation: FloatArray
    statistics: dict[str, FloatArray]
    position: FloatArray
    deviation_m: FloatArray
    reasons: tuple[str, ...]
    events: tuple[Event, ...]

    @property
    def fault(self) -> NDArray[np.bool_]:
        """(E,) whether the verdict was a FAULT."""
        return np.asarray(self.level == Level.FAULT)


@dataclass(frozen=True, slots=True, eq=False)
class Way:
    """What came of one variant on one dive.

    Attributes:
        variant, dive: names.
        time_s: (E,) from the beginning of the dive.
        error_m: (E,) distance from the true position; NaN where that is unknown.
        isolated: (E,) the DVL's measurements were not used.
        believed_m, true_m: (E, 2) and (R, 2) north and east of where the dive began.
    """

    variant: str
    dive: str
    time_s: FloatArray
    error_m: FloatArray
    isolated: NDArray[np.bool_]
    believed_m: FloatArray
    true_m: FloatArray

    @property
    def last_m(self) -> float:
        """Error at the end."""
        return float(self.error_m[np.isfinite(self.error_m)][-1])

    @property
    def greatest_m(self) -> float:
        """Error where it was worst."""
        return float(np.nanmax(self.error_m))


def faulty(data: NavigationData, faults: Iterable[SensorFault]) -> NavigationData:
    """A dive with faults put into what its sensors say; a sample that is not said is left out.

    Raises:
        ValueError: a sensor that says nothing from the beginning on.
    """
    arrays = {name: getattr(data, name).copy() for name in ("imu", "dvl", "depth")}
    for fault in faults:
        name, columns = _ARRAYS[fault.sensor]
        rows = arrays[name]
        values = rows[:, columns]
        shaped = values[:, 0] if fault.sensor is Sensor.DEPTH else values
        rows[:, columns] = fault.apply(rows[:, 0], shaped).reshape(values.shape)
    return replace(data, **{name: rows[np.isfinite(rows).all(axis=1)] for name, rows in arrays.items()})


def samples(
    data: NavigationData,
    fixes: FloatArray | None = None,
    attitudes: FloatArray | None = None,
    *,
    begin_s: float = -np.inf,
    end_s: float = np.inf,
) -> Iterator[NavigationSample]:
    """Those of a span of time, in order, fixes (F, 3) and attitudes (A, 4) among them."""
    inside = (data.imu[:, 0] >= begin_s) & (data.imu[:, 0] < end_s)
    part = replace(data, imu=data.imu[inside]) if inside.any() else data  # most of the rows need not become samples
    found = (FixSample(*row) for row in ([] if fixes is None else fixes.tolist()))
    known = (
        AttitudeSample(row[0], (row[1], row[2], row[3])) for row in ([] if attitudes is None else attitudes.tolist())
    )
    every = heapq.merge(part.samples(), found, known, key=attrgetter("time_s"))
    return (sample for sample in every if begin_s <= sample.time_s < end_s)


def play(watch: Watch, seen: Iterable[NavigationSample]) -> Record:
    """What a detector says of samples; it goes on from where it is."""
    rows: list[NavigationVerdict] = []
    events: list[Event] = []
    broken: set[Sensor | None] = set()
    for sample in seen:
        verdict = watch.update(sample)
        now: set[Sensor | None] = {one.sensor for one in verdict.sensors if one.level is Level.FAULT}
        if verdict.level is Level.FAULT and not now:
            now = {None}
        events += [_event(verdict, sensor) for sensor in (*SENSORS, None) if sensor in now - broken]
        broken = now
        if isinstance(sample, DvlSample | DepthSample):
            rows.append(verdict)
    return _record(rows, events)


def position_errors_m(record: Record, data: NavigationData) -> FloatArray:
    """(E,) horizontal distance from the reference's position; NaN before it begins and after it has ended.

    Raises:
        ValueError: there is no reference.
    """
    reference = reference_of(data)
    latitude_rad, longitude_rad, _ = record.position.T
    known = (record.time_s >= reference[0, 0]) & (record.time_s <= reference[-1, 0])
    true_rad = [np.interp(record.time_s, reference[:, 0], np.unwrap(reference[:, column])) for column in (1, 2)]
    east_rad = (longitude_rad - true_rad[1] + pi) % (2.0 * pi) - pi
    off_rad = np.hypot(latitude_rad - true_rad[0], east_rad * np.cos(true_rad[0]))
    return np.where(known, EARTH_RADIUS_M * off_rad, np.nan)


def track_m(data: NavigationData, position: FloatArray) -> FloatArray:
    """(E, 2) metres north and east of where the dive began, of (E, 2) or (E, 3) latitudes and longitudes."""
    _, latitude_rad, longitude_rad = reference_of(data)[0, :3].tolist()
    off_rad = position[:, :2] - (latitude_rad, longitude_rad)
    return np.asarray(EARTH_RADIUS_M * off_rad * (1.0, cos(latitude_rad)))


def turning(
    data: NavigationData, rate_radps: float = 0.04, around_s: float = 2.0
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Whether the vehicle turns, each second: (S,) instants, and (S,) True from a little before a turn to a little
    after it. By the gyroscope, so that no reference is needed."""
    time_s = np.arange(data.imu[0, 0], data.imu[-1, 0])
    angle_rad = np.cumsum(np.gradient(data.imu[:, 0]) * data.imu[:, 6])
    rates = np.gradient(np.interp(time_s, data.imu[:, 0], angle_rad), time_s)
    turns = np.abs(rates - np.median(rates)) > rate_radps
    around = np.ones(2 * round(around_s) + 1)
    return time_s, np.convolve(turns, around, mode="same") > 0.0


def _event(verdict: NavigationVerdict, sensor: Sensor | None) -> Event:
    return Event(verdict.time_s, sensor, None if sensor is None else verdict.of(sensor).kind)


def _record(verdicts: Sequence[NavigationVerdict], events: Sequence[Event]) -> Record:
    names = {name: None for verdict in verdicts for name in verdict.statistics}
    states = [verdict.state for verdict in verdicts]
    shape = (len(verdicts), len(SENSORS))
    levels = [[verdict.of(sensor).level for sensor in SENSORS] for verdict in verdicts]
    isolated = [[sensor in verdict.isolated for sensor in SENSORS] for verdict in verdicts]
    return Record(
        time_s=np.array([verdict.time_s for verdict in verdicts], dtype=float),
        level=np.array([verdict.level for verdict in verdicts], dtype=np.int8),
        levels=np.array(levels, dtype=np.int8).reshape(shape),
        isolated=np.array(isolated, dtype=bool).reshape(shape),
        innovation=np.array([verdict.innovation for verdict in verdicts], dtype=float).reshape(-1, 4),
        statistics={name: np.array([verdict.statistics.get(name, np.nan) for verdict in verdicts]) for name in names},
        position=np.array([(one.latitude_rad, one.longitude_rad, one.depth_m) for one in states]).reshape(-1, 3),
        deviation_m=np.array([verdict.position_error_m for verdict in verdicts], dtype=float),
        reasons=tuple(verdict.reason for verdict in verdicts),
        events=tuple(events),
    )
