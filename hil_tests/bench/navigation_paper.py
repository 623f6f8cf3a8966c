"""Paper 003's protocol: a drift of the DVL for 50 s of every 100 s, with acoustic fixes in between (its table 2).

Its tables are pictures, lost in our text: all that it states in words is that chi-square has 2 points more false
alarms than the amplified CUSUM, and 25 points more missed detections, and not of what the rates are shares: samples
or segments. Both are given here.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from detectors.navigation import NavigationConfig
from gateway.navigation_data import NavigationData
from hil_tests.bench.navigation_cases import FAULT_S, PAPER_CASE, Source
from hil_tests.bench.navigation_scores import APART_S, DEFAULT, alarm, begun
from hil_tests.bench.navigation_trace import MakeWatch, Trace, initial_of, plain_config, seed_of, with_plain
from hil_tests.navigation_aids import acoustic_fixes
from hil_tests.navigation_trials import faulty, play, samples

FloatArray = NDArray[np.float64]

PERIOD_S = 100.0
FIX_NOISE_M = 3.0


@dataclass(frozen=True, slots=True)
class PaperScore:
    """One method in this protocol.

    Attributes:
        method: its name. scale: multiple of its own threshold. isolate: whether it isolates what it finds.
        segments: with a fault, and as many without. missed: of them, without any alarm.
        early: in alarm already when the fault began: from the fault before, or a false one.
        false_segments: without a fault, in which an alarm began, except in the first `APART_S`.
        missed_share, false_share: of the samples with a fault that were not in alarm; of those without that were.
        median_s: time to find, over the segments where it was and no alarm was there before.
    """

    method: str
    scale: float
    isolate: bool
    segments: int
    missed: int
    early: int
    false_segments: int
    missed_share: float
    false_share: float
    median_s: float | None


@dataclass(frozen=True, slots=True)
class _Segment:
    delay_s: float | None
    early: bool
    false: bool


def paper_onsets(data: NavigationData) -> FloatArray:
    """(F,) of the faults."""
    begin_s, end_s = data.imu[0, 0] + PERIOD_S - FAULT_S, data.imu[-1, 0] - FAULT_S + 1.0
    return np.asarray(np.arange(begin_s, end_s, PERIOD_S))


def paper_trace(source: Source, config: NavigationConfig, make: MakeWatch, plain: bool = False) -> Trace:
    """A dive with those faults; `plain`: with the statistics on the paper's filter as well."""
    data = source.load()
    seen = _paper_trace(source, data, config, make)
    return with_plain(seen, _paper_trace(source, data, plain_config(config), make)) if plain else seen


def paper_score(method: str, traces: Iterable[Trace], scales: dict[str, float] | None = None) -> PaperScore:
    """All segments of these dives."""
    every = [(trace, 1.0 if scales is None else scales[trace.name]) for trace in traces]
    isolate = every[0][0].isolate
    # who isolates is judged by the verdict, whichever method it came from
    judged = DEFAULT if isolate else method
    alarmed = [alarm(trace, judged, scale) for trace, scale in every]
    found = [
        one for (trace, _), raised in zip(every, alarmed, strict=True) for one in _segments(trace.time_s, raised)
    ]
    delays_s = [one.delay_s for one in found if one.delay_s is not None and not one.early]
    inside = np.concatenate([trace.time_s % PERIOD_S >= PERIOD_S - FAULT_S for trace, _ in every])
    raised = np.concatenate(alarmed)
    return PaperScore(
        method=method,
        scale=float(np.median([scale for _, scale in every])),
        isolate=isolate,
        segments=len(found),
        missed=sum(one.delay_s is None for one in found),
        early=sum(one.early for one in found),
        false_segments=sum(one.false for one in found),
        missed_share=float(1.0 - raised[inside].mean()),
        false_share=float(raised[~inside].mean()),
        median_s=float(np.median(delays_s)) if delays_s else None,
    )


def _paper_trace(source: Source, data: NavigationData, config: NavigationConfig, make: MakeWatch) -> Trace:
    rng = np.random.default_rng(seed_of(source))
    faults = [replace(PAPER_CASE.fault(float(onset_s), rng), axis=0) for onset_s in paper_onsets(data)]
    fixes = acoustic_fixes(data, seed_of(source), FIX_NOISE_M)
    sound = ~np.any([fault.active(fixes[:, 0]) for fault in faults], axis=0)
    record = play(make(config, initial_of(source, data)), samples(faulty(data, faults), fixes[sound]))
    return Trace(
        group=source.group,
        name=source.name,
        isolate=config.isolate,
        case=PAPER_CASE,
        where="",
        onset_s=PERIOD_S - FAULT_S,
        time_s=record.time_s - data.imu[0, 0],
        fault=record.fault,
        statistics=record.statistics,
        first_s=None,
        sensor=None,
        kind=None,
        data_s=float(np.ptp(data.imu[:, 0])),
        seconds=0.0,
    )


def _segments(time_s: FloatArray, alarmed: NDArray[np.bool_]) -> Iterator[_Segment]:
    """One for each period: its fault, and the sound part before it."""
    begins_s = begun(time_s, alarmed)
    for onset_s in np.arange(PERIOD_S - FAULT_S, time_s[-1], PERIOD_S):
        sound_s = onset_s - FAULT_S + (APART_S if onset_s > FAULT_S else 0.0)
        found_s = time_s[alarmed & (time_s >= onset_s) & (time_s < onset_s + FAULT_S)]
        yield _Segment(
            delay_s=float(found_s[0] - onset_s) if len(found_s) else None,
            early=bool(alarmed[time_s < onset_s][-1:].any()),
            false=bool(((begins_s >= sound_s) & (begins_s < onset_s)).any()),
        )
