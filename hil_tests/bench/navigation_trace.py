"""What the navigation detector makes of one dive, healthy and with each fault, as far as the tables need it."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from time import perf_counter
from zlib import crc32

import numpy as np
from numpy.typing import NDArray

from detectors.navigation import FaultKind, NavigationConfig, NavigationState, Sensor
from gateway.navigation_data import NavigationData
from hil_tests.bench.navigation_cases import FAULT_S, Case, Simulated, Source, onsets
from hil_tests.navigation_aids import guessed
from hil_tests.navigation_trials import Record, Watch, faulty, play, samples

FloatArray = NDArray[np.float64]
MakeWatch = Callable[[NavigationConfig, NavigationState], Watch]

PLAIN = "plain "  # before the name of a method: on the paper's filter
BEFORE_S = 3.0  # of a fault are played, too: who has been in alarm then does not find it


@dataclass(frozen=True, slots=True, eq=False)
class Trace:
    """One detector on one dive, or on the part of it with a fault.

    Attributes:
        group, name: of the dive.
        isolate: whether the detector stops using what it finds faulty.
        case: the fault; None: healthy. where: "straight", "turn" or "".
        onset_s: of the fault.
        time_s: (E,) of samples of DVL and depth. fault: (E,) the verdict is FAULT.
        statistics: (E,) shares of their thresholds, by the method's name.
        first_s: when the first FAULT began at or after the onset; None: it did not.
        sensor, kind: the first that was named; None: no sensor was.
        data_s, seconds: length of what was played, and the time that it took.
    """

    group: str
    name: str
    isolate: bool
    case: Case | None
    where: str
    onset_s: float
    time_s: FloatArray
    fault: NDArray[np.bool_]
    statistics: dict[str, FloatArray]
    first_s: float | None
    sensor: Sensor | None
    kind: FaultKind | None
    data_s: float
    seconds: float


@dataclass(frozen=True, slots=True)
class Job:
    """One dive and what is to be done with it.

    Attributes:
        source: the dive.
        cases: faults. both: each on a straight leg and in a turn; else, in turns, the one or the other.
        number: of the dive, so that not every dive has the same fault in a turn.
        config: of the detector. isolate: it is played with and without isolation; with faults, without.
        make: makes the detector.
        plain: the statistics on the paper's filter, too.
    """

    source: Source
    cases: tuple[Case, ...]
    config: NavigationConfig
    make: MakeWatch
    both: bool = False
    number: int = 0
    plain: bool = False


def traces(job: Job) -> list[Trace]:
    """The dive healthy, with and without isolation, and with each fault without it.

    Until the first FAULT, isolation makes no difference; without it, the statistics of all methods go on from there.
    """
    data = job.source.load()
    found = _traces(job, data)
    if not job.plain:
        return found
    plain = _traces(replace(job, config=plain_config(job.config)), data)
    return [with_plain(one, other) for one, other in zip(found, plain, strict=True)]


def plain_config(config: NavigationConfig) -> NavigationConfig:
    """With the filter of paper 003, section 3: its sixteen states know nothing of how the sensors are mounted."""
    return replace(config, estimate_installation=False, compare=False)


def with_plain(trace: Trace, plain: Trace) -> Trace:
    """A trace with the statistics of another, of the paper's filter, under names of their own."""
    others = {f"{PLAIN}{name}": values for name, values in plain.statistics.items()}
    return replace(trace, statistics={**trace.statistics, **others})


def _traces(job: Job, data: NavigationData) -> list[Trace]:
    initial = initial_of(job.source, data)
    watch = job.make(replace(job.config, isolate=False), initial)
    begins = onsets(data, np.random.default_rng(seed_of(job.source)))
    using_all, kept = _with_snapshots(job, data, watch, begins)
    isolating = replace(using_all, isolate=True)
    if using_all.first_s is not None:
        isolating = _isolating(job, data, job.make(replace(job.config, isolate=True), initial))
    found = [
        _with_fault(job, data, kept[where], case, where, begins[where])
        for index, case in enumerate(job.cases)
        for where in _places(job, index, begins)
    ]
    return [isolating, using_all, *found]


def initial_of(source: Source, data: NavigationData) -> NavigationState:
    """That of a recording lags as it is; that of a simulated dive gets the errors of an autopilot's."""
    return guessed(data.initial, source.seed) if isinstance(source, Simulated) else data.initial


def seed_of(source: Source) -> int:
    """For what is drawn: the same for one dive with whatever IMU, in every process."""
    return source.seed if isinstance(source, Simulated) else crc32(source.name.encode())


def _places(job: Job, index: int, begins: dict[str, float]) -> Sequence[str]:
    names = sorted(begins)
    return names if job.both or not names else [names[(index + job.number) % len(names)]]


def _isolating(job: Job, data: NavigationData, watch: Watch) -> Trace:
    begin = perf_counter()
    record = play(watch, samples(data))
    return _trace(job, record, isolate=True, data_s=_length_s(data), seconds=perf_counter() - begin)


def _with_snapshots(
    job: Job, data: NavigationData, watch: Watch, begins: dict[str, float]
) -> tuple[Trace, dict[str, bytes]]:
    """The healthy dive without isolation, and the detector as it was shortly before each onset."""
    begin = perf_counter()
    kept: dict[str, bytes] = {}
    records, now_s = [], -np.inf
    for where, onset_s in sorted(begins.items(), key=lambda item: item[1]):
        records.append(play(watch, samples(data, begin_s=now_s, end_s=onset_s - BEFORE_S)))
        kept[where], now_s = pickle.dumps(watch), onset_s - BEFORE_S
    records.append(play(watch, samples(data, begin_s=now_s)))
    seconds = perf_counter() - begin
    return _trace(job, joined(records), isolate=False, data_s=_length_s(data), seconds=seconds), kept


def _with_fault(job: Job, data: NavigationData, kept: bytes, case: Case, where: str, onset_s: float) -> Trace:
    fault = case.fault(onset_s, np.random.default_rng([seed_of(job.source), crc32(case.name.encode())]))
    watch = pickle.loads(kept)  # noqa: S301 our own, of a moment ago
    seen = samples(faulty(data, [fault]), begin_s=onset_s - BEFORE_S, end_s=onset_s + FAULT_S)
    return _trace(job, play(watch, seen), isolate=False, case=case, where=where, onset_s=onset_s)


def _trace(
    job: Job,
    record: Record,
    *,
    isolate: bool,
    case: Case | None = None,
    where: str = "",
    onset_s: float = -np.inf,
    data_s: float = 0.0,
    seconds: float = 0.0,
) -> Trace:
    since = [event for event in record.events if event.time_s >= onset_s]
    by_name = next((event for event in since if event.sensor is not None), None)
    return Trace(
        group=job.source.group,
        name=job.source.name,
        isolate=isolate,
        case=case,
        where=where,
        onset_s=onset_s,
        time_s=record.time_s,
        fault=record.fault,
        statistics=record.statistics,
        first_s=since[0].time_s if since else None,
        sensor=by_name.sensor if by_name else None,
        kind=by_name.kind if by_name else None,
        data_s=data_s,
        seconds=seconds,
    )


def joined(records: Iterable[Record]) -> Record:
    """One record of what was played in parts."""
    parts = list(records)
    names = {name: None for part in parts for name in part.statistics}
    silent = {
        name: [part.statistics.get(name, np.full(len(part.time_s), np.nan)) for part in parts] for name in names
    }
    return Record(
        **{name: np.concatenate([getattr(part, name) for part in parts]) for name in _ARRAYS},
        statistics={name: np.concatenate(columns) for name, columns in silent.items()},
        reasons=tuple(reason for part in parts for reason in part.reasons),
        events=tuple(event for part in parts for event in part.events),
    )


_ARRAYS = ("time_s", "level", "levels", "isolated", "innovation", "position", "deviation_m")


def _length_s(data: NavigationData) -> float:
    return float(data.imu[-1, 0] - data.imu[0, 0])
