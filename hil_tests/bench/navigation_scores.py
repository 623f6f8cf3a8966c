"""False alarms, faults found and sensors named, from the traces of many dives."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import inf

import numpy as np
from numpy.typing import NDArray

from detectors.navigation import Sensor
from hil_tests.bench.navigation_cases import Case
from hil_tests.bench.navigation_trace import Trace

FloatArray = NDArray[np.float64]
Bools = NDArray[np.bool_]

DEFAULT = "ratio"  # judged by its verdict; every other method by its statistic
APART_S = 5.0  # alarms with a shorter pause between them are one
SCALES = np.geomspace(0.02, 1e4, 400)  # thresholds that are tried, as multiples of the method's own


@dataclass(frozen=True, slots=True)
class Alarms:
    """False alarms of one method on healthy dives.

    Attributes:
        method: its name. scale: median multiple of its own threshold; 1.0: as it stands.
        dives, alarmed: number of dives, and of those with an alarm.
        events, hours: alarms that began, and the length of all dives.
        share: of the samples, in alarm.
    """

    method: str
    scale: float
    dives: int
    alarmed: int
    events: int
    hours: float
    share: float

    @property
    def per_hour(self) -> float:
        """Alarms that began."""
        return self.events / self.hours


@dataclass(frozen=True, slots=True)
class Found:
    """One method on all trials of one case.

    Attributes:
        method, case: names. where: "straight", "turn" or "" for both.
        trials: number. early: those with an alarm already before the onset. found: those with one after it.
        median_s, late_s: median and 90 % quantile of the time to find; None: for ever, like what is not found.
        covered: share of the samples during the fault that were in alarm.
    """

    method: str
    case: str
    where: str
    trials: int
    early: int
    found: int
    median_s: float | None
    late_s: float | None
    covered: float


def alarm(trace: Trace, method: str, scale: float = 1.0) -> Bools:
    """(E,) whether a method is in alarm."""
    if method == DEFAULT and scale == 1.0:
        return trace.fault
    statistic = trace.statistics.get(method, np.zeros(len(trace.time_s)))
    return np.nan_to_num(statistic, nan=0.0) >= scale


def begun(time_s: FloatArray, alarmed: Bools) -> FloatArray:
    """Instants at which alarms began that are apart from those before them."""
    instants = time_s[alarmed]
    return instants[np.diff(instants, prepend=-np.inf) > APART_S]


def alarms(method: str, traces: Iterable[Trace], scales: dict[str, float] | None = None) -> Alarms:
    """False alarms on healthy dives.

    Args:
        scales: multiple of the threshold by the dive's name; None: its own.
    """
    every = [(trace, 1.0 if scales is None else scales[trace.name]) for trace in traces]
    alarmed = [alarm(trace, method, scale) for trace, scale in every]
    events = [len(begun(trace.time_s, one)) for (trace, _), one in zip(every, alarmed, strict=True)]
    return Alarms(
        method=method,
        scale=float(np.median([scale for _, scale in every])),
        dives=len(every),
        alarmed=sum(count > 0 for count in events),
        events=sum(events),
        hours=sum(trace.data_s for trace, _ in every) / 3600.0,
        share=float(np.mean(np.concatenate(alarmed))),
    )


def scales_for(method: str, healthy: Sequence[Trace], events_per_hour: float) -> dict[str, float]:
    """For each dive, the smallest threshold with no more false alarms than wanted on all *other* dives.

    Smallest: with no greater one more, either; below it, alarms grow together into one.
    """
    counts = {trace.name: _counts(trace, method) for trace in healthy}
    hours = {trace.name: trace.data_s / 3600.0 for trace in healthy}
    scales = {}
    for name in counts:
        others = [other for other in counts if other != name] or [name]
        events = sum(counts[other] for other in others)
        too_many = np.flatnonzero(events > events_per_hour * sum(hours[other] for other in others) + 1e-9)
        scales[name] = float(SCALES[min(too_many[-1] + 1, len(SCALES) - 1)]) if len(too_many) else float(SCALES[0])
    return scales


def found(method: str, traces: Iterable[Trace], scales: dict[str, float] | None = None, where: str = "") -> Found:
    """What a method found of one case."""
    every = [(trace, 1.0 if scales is None else scales[trace.name]) for trace in traces]
    delays_s = [delay_s(trace, method, scale) for trace, scale in every]
    known_s = [inf if one is None else one for one in delays_s]
    during = [alarm(trace, method, scale)[trace.time_s >= trace.onset_s] for trace, scale in every]
    return Found(
        method=method,
        case=_name(every[0][0].case),
        where=where,
        trials=len(every),
        early=sum(_early(trace, method, scale) for trace, scale in every),
        found=sum(one is not None for one in delays_s),
        median_s=_quantile(known_s, 0.5),
        late_s=_quantile(known_s, 0.9),
        covered=float(np.mean(np.concatenate(during))),
    )


def delay_s(trace: Trace, method: str, scale: float = 1.0) -> float | None:
    """From the onset to the alarm; None where there is none, or has been one before."""
    if _early(trace, method, scale):
        return None
    after = trace.time_s[alarm(trace, method, scale) & (trace.time_s >= trace.onset_s)]
    instants = [*after[:1].tolist()]
    if method == DEFAULT and scale == 1.0 and trace.first_s is not None:  # an IMU's sample can be the first
        instants.append(trace.first_s)
    return min(instants) - trace.onset_s if instants else None


def named(traces: Iterable[Trace]) -> dict[Sensor, Counter[str]]:
    """How often which sensor was named first, by the one that was faulty; "open": a fault was found, but not whose;
    "none": none was."""
    table: dict[Sensor, Counter[str]] = {sensor: Counter() for sensor in Sensor}
    for trace in traces:
        if trace.case is not None:
            missed = delay_s(trace, DEFAULT) is None
            table[trace.case.sensor]["none" if missed else str(trace.sensor or "open")] += 1
    return table


def by_case(traces: Iterable[Trace]) -> dict[str, list[Trace]]:
    """Those with a fault, by the case's name."""
    cases: dict[str, list[Trace]] = {}
    for trace in traces:
        if trace.case is not None:
            cases.setdefault(trace.case.name, []).append(trace)
    return cases


def _early(trace: Trace, method: str, scale: float) -> bool:
    before = alarm(trace, method, scale)[trace.time_s < trace.onset_s]
    return bool(before[-1:].any())


def _counts(trace: Trace, method: str) -> NDArray[np.int64]:
    """Alarms that begin, for each of `SCALES`."""
    statistic = np.nan_to_num(trace.statistics.get(method, np.zeros(len(trace.time_s))), nan=0.0)
    return np.array([len(begun(trace.time_s, statistic >= scale)) for scale in SCALES])


def _quantile(values: Sequence[float], share: float) -> float | None:
    """The least value that this share of them does not exceed; None for infinite or none."""
    if not values:
        return None
    quantile = float(np.quantile(values, share, method="inverted_cdf"))
    return quantile if np.isfinite(quantile) else None


def _name(case: Case | None) -> str:
    return case.name if case is not None else ""
