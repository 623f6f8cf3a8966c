"""The speed detector on ways of which the truth is known: false alarms, losses found, errors of speed and flow."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from math import inf
from time import perf_counter
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from detectors.speed import PoseSample, SpeedConfig, SpeedDetector, SpeedVerdict
from detectors.speed.config import EstimatorName
from detectors.verdict import Level
from hil_tests.bench.ideal import ideal_delay_s
from hil_tests.missions import Passage

FloatArray = NDArray[np.float64]

LEARNT_S = 120.0  # errors count from here on


class Watch(Protocol):
    """What is measured: judges samples one by one."""

    def update(self, sample: PoseSample) -> SpeedVerdict: ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """What one estimator made of one way.

    Attributes:
        estimator: its name.
        group: "missions", "10 Hz, 0.1 m" or a set of recordings.
        kind, water: pattern of the course or recording; kind of water.
        seed, loss, noise_m, rate_hz: of the way.
        ideal_s: from the onset until an ideal observer finds the loss; None for never, and in healthy ways.
        healthy_s: time before the onset, or all of a healthy way.
        alarms: how often a FAULT began in that time.
        delay_s: from the onset to the first FAULT that began after it; None for none.
        unknown: share of UNKNOWN after the learning, while healthy.
        speed_mps: mean true speed through the water while healthy, to compare the errors with.
        speed_error_mps, flow_error_mps: RMS after the learning, while healthy; NaN where there was no estimate.
        updates, seconds: samples, and the time that they took.
    """

    estimator: str
    group: str
    kind: str
    water: str
    seed: int
    loss: float
    noise_m: float
    rate_hz: float
    ideal_s: float | None
    healthy_s: float
    alarms: int
    delay_s: float | None
    unknown: float
    speed_mps: float
    speed_error_mps: float
    flow_error_mps: float
    updates: int
    seconds: float


@dataclass(frozen=True, slots=True)
class Score:
    """Findings, summed up.

    Attributes:
        name: of the estimator, or of a kind of ways.
        healthy, alarmed: healthy ways, and those of them with a FAULT.
        alarms_per_hour: FAULTs that began while nothing was wrong, before onsets as well.
        lost: ways with a loss. early: those with an earlier FAULT. found: those with one after it and none before.
        median_s, late_s: median and 90 % quantile of the time to find; ways where it was not found take for ever, and
            then it is None.
        ideal_s: median time that an ideal observer takes.
        speed_error_mps, flow_error_mps: median over the ways, of the RMS errors.
        speed_error, flow_error: likewise, relative to the vehicle's speed.
        unknown: mean share of UNKNOWN.
        update_us: mean time of an update.
    """

    name: str
    healthy: int
    alarmed: int
    alarms_per_hour: float
    lost: int
    early: int
    found: int
    median_s: float | None
    late_s: float | None
    ideal_s: float | None
    speed_error_mps: float
    flow_error_mps: float
    speed_error: float
    flow_error: float
    unknown: float
    update_us: float


def detector_for(estimator: EstimatorName, way: Passage) -> SpeedDetector:
    """A detector that knows the normal speed beforehand.

    The paper's law, too, has a basis that moves with the vehicle: of its flows over a grid of the area, known
    beforehand, it learnt less.
    """
    return SpeedDetector(
        SpeedConfig(speed_min_mps=way.speed_min_mps, speed_max_mps=way.speed_max_mps, estimator=estimator)
    )


def samples(way: Passage) -> list[PoseSample]:
    """What a detector sees of a way."""
    columns = (way.time_s, way.north_m, way.east_m, way.heading_rad, way.down_m, way.pitch_rad)
    return list(map(PoseSample, *(column.tolist() for column in columns)))


def judge(way: Passage, watch: Watch, *, estimator: str, group: str, water: str, seed: int) -> Finding:
    """What a detector, new, makes of a way."""
    seen = samples(way)
    begin = perf_counter()
    verdicts = [watch.update(sample) for sample in seen]
    seconds = perf_counter() - begin
    healthy = ~(way.time_s >= way.onset_s)  # NaN: all
    fault = np.array([verdict.level == Level.FAULT for verdict in verdicts])
    begun = fault & ~np.append(False, fault[:-1])
    found_s = way.time_s[begun & ~healthy]
    judged = healthy & (way.time_s >= LEARNT_S)
    speed_error_mps, flow_error_mps = _errors(way, verdicts, judged)
    unknown = np.array([verdict.level == Level.UNKNOWN for verdict in verdicts])
    return Finding(
        estimator=estimator,
        group=group,
        kind=way.kind,
        water=water,
        seed=seed,
        loss=way.loss,
        noise_m=way.noise_m,
        rate_hz=way.rate_hz,
        ideal_s=ideal_delay_s(way) if way.loss else None,
        healthy_s=float(np.ptp(way.time_s[healthy])),
        alarms=int(np.count_nonzero(begun & healthy)),
        delay_s=float(found_s[0] - way.onset_s) if len(found_s) else None,
        unknown=float(unknown[judged].mean()),
        speed_mps=float(way.true_speed_mps[healthy].mean()),
        speed_error_mps=speed_error_mps,
        flow_error_mps=flow_error_mps,
        updates=len(seen),
        seconds=seconds,
    )


def score(name: str, findings: Iterable[Finding]) -> Score:
    """Sum the findings up."""
    every = list(findings)
    healthy, lost = ([one for one in every if bool(one.loss) is sick] for sick in (False, True))
    hours = sum(one.healthy_s for one in every) / 3600.0
    delays_s = [inf if one.alarms or one.delay_s is None else one.delay_s for one in lost]
    return Score(
        name=name,
        healthy=len(healthy),
        alarmed=sum(one.alarms > 0 for one in healthy),
        alarms_per_hour=sum(one.alarms for one in every) / hours,
        lost=len(lost),
        early=sum(one.alarms > 0 for one in lost),
        found=int(np.isfinite(delays_s).sum()),
        median_s=_quantile(delays_s, 0.5),
        late_s=_quantile(delays_s, 0.9),
        ideal_s=_quantile([inf if one.ideal_s is None else one.ideal_s for one in lost], 0.5),
        speed_error_mps=_median(every, lambda one: one.speed_error_mps),
        flow_error_mps=_median(every, lambda one: one.flow_error_mps),
        speed_error=_median(every, lambda one: one.speed_error_mps / one.speed_mps),
        flow_error=_median(every, lambda one: one.flow_error_mps / one.speed_mps),
        unknown=float(np.mean([one.unknown for one in every])),
        update_us=1e6 * sum(one.seconds for one in every) / sum(one.updates for one in every),
    )


def _errors(way: Passage, verdicts: Sequence[SpeedVerdict], judged: NDArray[np.bool_]) -> tuple[float, float]:
    """RMS of speed and flow, where there is an estimate."""
    speed_mps = np.array([verdict.speed_mps for verdict in verdicts])
    flow_mps = np.array([verdict.flow_mps[:2] for verdict in verdicts])
    unbounded = np.isinf([verdict.speed_error_mps for verdict in verdicts])
    known = judged & np.isfinite(speed_mps) & np.isfinite(flow_mps).all(axis=1) & ~unbounded
    if not known.any():
        return float("nan"), float("nan")
    speed_off, flow_off = speed_mps - way.true_speed_mps, np.hypot(*(flow_mps - way.true_flow_mps).T)
    return _rms(speed_off[known]), _rms(flow_off[known])


def _rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _median(findings: Sequence[Finding], value: Callable[[Finding], float]) -> float:
    known = [value(one) for one in findings if np.isfinite(value(one))]
    return float(np.median(known)) if known else float("nan")


def _quantile(values: Sequence[float], share: float) -> float | None:
    """The least value that this share of them does not exceed; None for infinite or none."""
    if not values:
        return None
    quantile = float(np.quantile(values, share, method="inverted_cdf"))
    return quantile if np.isfinite(quantile) else None
