"""Judges the speed that an estimator learns: the method of every estimator but the published one."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from math import hypot, inf, isfinite, nan, sqrt

import numpy as np
from numpy.typing import NDArray

from detectors.speed.adaptive import AdaptiveEstimator
from detectors.speed.anomaly import Flag, FlowComparison
from detectors.speed.config import SpeedConfig
from detectors.speed.curve import SpeedCurve
from detectors.speed.estimate import Estimate, Estimator, Step
from detectors.speed.evidence import Evidence, weigh
from detectors.speed.excitation import Excitation
from detectors.speed.gate import Fate, PositionGate
from detectors.speed.interacting import InteractingEstimator
from detectors.speed.kalman import KalmanEstimator
from detectors.speed.noise import PositionNoise
from detectors.speed.normal import NormalSpeed
from detectors.speed.published import flow_to_learn, position_of
from detectors.speed.sample import PoseSample, SpeedVerdict
from detectors.speed.way import Way
from detectors.verdict import Level

FloatArray = NDArray[np.float64]

GAP_S = 20.0  # after so long without a sample, or without a position to believe, the way in between is not known
WELL_KNOWN = 0.06  # a speed with an error up to this share of the usual one is good enough to learn from
ACCEPTABLE = 0.2  # an operator who accepts a speed that is known less well accepts whatever will be learnt next
SUDDEN = 0.5  # share of the speed scale that speed or flow may change by in a second: no outlier yet
FORGET_S = 1e4  # where positions went on contradicting what was learnt, it counts as old as this
SURGE_ERROR = 0.3  # of the part of a change of speed that is still to come: hulls follow as a lag only roughly
START_S = 15.0  # what is learnt first is not judged
ADAPTIVE_NOISE = 0.05  # position noise may make the adaptive law's speed waver by this share; it slows down for it
STRAIGHT = 0.02  # a spread of the headings below this is a straight course


def new_estimator(config: SpeedConfig) -> Estimator:
    """The estimator that the settings name."""
    scale_mps = config.speed_scale_mps
    if config.estimator == "adaptive":
        return AdaptiveEstimator(
            flow_to_learn(config),
            learning_rate=config.learning_rate,
            gain=config.gain,
            speed_mps=scale_mps,
            speed_limit_mps=config.speed_limit_mps,
            speed_noise_max_mps=ADAPTIVE_NOISE * scale_mps,
        )
    if config.estimator == "kalman":
        return KalmanEstimator(
            config.dimensions,
            speed_scale_mps=scale_mps,
            speed_mps=scale_mps,
            position_noise_m=config.position_noise_m,
        )
    known = config.flow_model is not None
    return InteractingEstimator(config.dimensions, scale_mps, config.flow_model_error_mps if known else None)


class ObservedMethod:
    """From poses to verdicts. Picklable at any sample, and then goes on bit for bit.

    Args:
        config: settings.
        curve: normal speed over the command, from an earlier dive.

    Attributes:
        normal: what is normal.
        refused: positions that were not believed, by cause.
    """

    def __init__(self, config: SpeedConfig, curve: SpeedCurve | None = None) -> None:
        self._config = config
        self.normal = NormalSpeed(config, curve)
        self.refused: Counter[str] = Counter()
        self._learnt_s = 0.0
        self._estimator = new_estimator(config)
        self._way = Way(config.dimensions, config.surge_time_s)
        self._noise = PositionNoise(config.position_noise_m, config.speed_scale_mps, config.dimensions)
        self._gate = PositionGate()
        self._excitation = Excitation(config.dimensions)
        self._evidence = Evidence()
        self._comparison = FlowComparison()
        self._last: PoseSample | None = None
        self._estimate: Estimate | None = None
        nowhere = np.zeros(config.dimensions)
        self._believed_s, self._believed_m = -inf, nowhere
        self._relative_m = nowhere  # the believed position, from where it began, without the outside model's flow
        self._normal_flow_mps: FloatArray | None = None

    def judge(self, sample: PoseSample) -> SpeedVerdict:
        """The next sample; finite, and later than the one before."""
        last, self._last = self._last, sample
        position_m = position_of(sample, self._config.dimensions)
        if last is None or sample.time_s - last.time_s > GAP_S:
            self.normal.follow(sample.command, 0.0)
            self._begin(sample, position_m)
            self._evidence.nothing()
            return self._verdict(sample, nan, self._evidence.level, "learning")
        self.normal.follow(last.command, sample.time_s - last.time_s)
        self._way.extend(sample, self.normal.share())
        if np.array_equal(position_m, position_of(last, self._config.dimensions)):
            self.refused["position repeated"] += 1
        else:
            self._take(sample, position_m)
        return self._judge(sample)

    def accept(self) -> None:
        """The present speed is normal from now on; where it is not known, the one that is learnt next."""
        estimate = self._estimate
        if estimate is not None and self._error(estimate) < ACCEPTABLE and estimate.speed_mps > 0.0:
            ratio = estimate.speed_mps / self.normal.reference_mps
            self.normal.accept(ratio)
            self._rescale(1.0 / ratio, estimate)
        else:
            self.normal.forget()
        self._evidence.clear()

    def _begin(self, sample: PoseSample, position_m: FloatArray) -> None:
        """The first position, the first after a gap, or the first of another frame."""
        if isfinite(self._believed_s):
            self._estimator.idle(sample.time_s - self._believed_s)
        self._way.begin(sample, self.normal.share())
        self._believed_s, self._believed_m = sample.time_s, position_m
        self._relative_m = position_m
        self._estimator.begin(position_m, sample.time_s)

    def _take(self, sample: PoseSample, position_m: FloatArray) -> None:
        """A new position: believed or not."""
        interval_s = sample.time_s - self._believed_s
        if interval_s > GAP_S:
            self.refused["no position to go on from"] += 1
            self._noise.interrupt()
            self._begin(sample, position_m)
            self._estimator.idle(FORGET_S)
            return
        moved_m = position_m - self._believed_m - self._carried_m(sample.time_s, position_m)
        left_m = moved_m - self._foreseen_m(interval_s)
        if not self._noise.known:
            self._noise.take(left_m)
            self._begin(sample, position_m)
            return
        match self._gate.judge(left_m, self._spread_m(interval_s)):
            case Fate.TAKEN:
                self._noise.take(left_m)
                self._believe(sample, position_m, moved_m)
            case Fate.OUTLIER:
                self.refused["position outlier"] += 1
                self._noise.interrupt()
            case Fate.JUMP:
                self.refused["position jumped"] += 1
                self._noise.interrupt()
                self._begin(sample, position_m)

    def _foreseen_m(self, interval_s: float) -> FloatArray:
        """(D,) the way since the last believed position, by what is known; without what an outside model says."""
        if self._estimate is None:
            return self.normal.reference_mps * self._way.ahead_s
        return self._estimate.speed_mps * self._way.ahead_s + self._estimate.flow_mps * interval_s

    def _spread_m(self, interval_s: float) -> float:
        """Standard deviation of a coordinate of what is left then."""
        if self._estimate is None:
            return inf
        by_speed = self._error(self._estimate) * self.normal.reference_mps * float(np.linalg.norm(self._way.ahead_s))
        by_flow = self._estimate.flow_error_mps * interval_s if isfinite(self._estimate.flow_error_mps) else 0.0
        by_change = SUDDEN * self._config.speed_scale_mps * interval_s**1.5
        return hypot(sqrt(2.0) * self._noise.deviation_m, by_speed, by_flow, by_change)

    def _carried_m(self, time_s: float, position_m: FloatArray) -> FloatArray:
        """(D,) how far the flow of the outside model has carried the vehicle since the last believed position."""
        if self._config.estimator != "interacting":
            return np.zeros_like(position_m)
        middle_s, middle_m = 0.5 * (self._believed_s + time_s), 0.5 * (self._believed_m + position_m)
        return self._model_mps(middle_s, middle_m) * (time_s - self._believed_s)

    def _model_mps(self, time_s: float, position_m: FloatArray) -> FloatArray:
        """(D,) the flow of the outside model; zero where there is none, or it says nothing."""
        model = self._config.flow_model
        flow_mps = np.zeros_like(position_m)
        if model is not None:
            down_m = 0.0 if self._last is None else self._last.down_m
            said = model.velocity_mps(time_s, np.array((position_m[0], position_m[1], down_m)))[: len(flow_mps)]
            if np.isfinite(said).all():
                flow_mps[: len(said)] = said
        return flow_mps

    def _believe(self, sample: PoseSample, position_m: FloatArray, moved_m: FloatArray) -> None:
        interval_s = sample.time_s - self._believed_s
        self._relative_m = self._relative_m + moved_m
        step = Step(
            time_s=sample.time_s,
            interval_s=interval_s,
            position_m=self._relative_m,
            ahead_s=self._way.ahead_s,
            aside_s=self._way.aside_s,
            turned=self._way.turned,
            position_noise_m=self._noise.deviation_m,
        )
        self._excitation.take(step.ahead_s, interval_s)
        self._estimate = self._estimator.update(step)
        self._believed_s, self._believed_m = sample.time_s, position_m
        self._way.restart()
        self._learnt_s += interval_s
        if self._learnt_s >= START_S:
            self._weigh(interval_s, self._estimate)

    def _weigh(self, interval_s: float, estimate: Estimate) -> None:
        """Holds a new estimate against what is normal, or learns what is normal from it."""
        surging = SURGE_ERROR * abs(self.normal.share() - self._way.share)
        ratio, error = estimate.speed_mps / self.normal.reference_mps, hypot(self._error(estimate), surging)
        normal = self.normal.range()
        if normal is not None and not self.normal.stopped:
            self._evidence.take(weigh(ratio, error, normal.low, normal.high), interval_s)
            return
        self._evidence.nothing()
        if error < WELL_KNOWN and self._evidence.level is not Level.FAULT:
            factor = self.normal.learn(ratio, interval_s)
            if factor != 1.0:
                self._rescale(factor, estimate)

    def _rescale(self, factor: float, estimate: Estimate) -> None:
        """The normal speed is another: the vehicle's is the same, in other shares."""
        self._estimator.rescale(factor)
        self._way.rescale(1.0 / factor)
        self._estimate = replace(
            estimate,
            speed_mps=factor * estimate.speed_mps,
            speed_error_mps=factor * estimate.speed_error_mps,
        )

    def _error(self, estimate: Estimate) -> float:
        """Standard deviation of the speed, as a share of the reference."""
        if isfinite(estimate.speed_error_mps):
            return estimate.speed_error_mps / self.normal.reference_mps
        return self._excitation.error * abs(estimate.speed_mps) / self.normal.reference_mps

    def _judge(self, sample: PoseSample) -> SpeedVerdict:
        """The verdict after a sample that was taken."""
        flow_error = self._flow_error(sample)
        level = self._evidence.level
        adaptive = self._config.estimator == "adaptive"
        if adaptive and level > Level.NORMAL and flow_error > self._config.flow_error_max:
            level = Level.UNKNOWN  # Algorithm 2: without an uncertainty of its own the law has only this to go by
        return self._verdict(sample, flow_error, level, self._reason(level))

    def _flow_error(self, sample: PoseSample) -> float:
        """p_E; NaN without an estimate."""
        if self._estimate is None:
            return nan
        model_mps = self._model_mps(sample.time_s, self._believed_m)
        learnt_mps = self._flow_mps(self._estimate, model_mps)
        if self._evidence.level <= Level.NORMAL or self._normal_flow_mps is None:
            self._normal_flow_mps = learnt_mps
        foreseen_mps = model_mps if self._config.flow_model is not None else self._normal_flow_mps
        return self._comparison.error(learnt_mps, foreseen_mps)

    def _flow_mps(self, estimate: Estimate, model_mps: FloatArray) -> FloatArray:
        """(D,) of an estimate."""
        return estimate.flow_mps + model_mps if self._config.estimator == "interacting" else estimate.flow_mps

    def _reason(self, level: Level) -> str:
        estimate = self._estimate
        if level is Level.NORMAL or estimate is None:
            return "" if level is Level.NORMAL else "learning"
        if level >= Level.SUSPECT:
            return "too slow" if estimate.speed_mps < self.normal.reference_mps else "too fast"
        if self.normal.stopped:
            return "thrusters stopped"
        if self.normal.range() is None:
            return "learning the normal speed"
        return "no turn yet to tell speed from flow" if self._excitation.spread < STRAIGHT else "learning"

    def _verdict(self, sample: PoseSample, flow_error: float, level: Level, reason: str) -> SpeedVerdict:
        estimate, normal = self._estimate, self.normal.range()
        low_mps, high_mps = (nan, nan) if normal is None else normal.limits_mps
        flow_mps = (nan,) * self._config.dimensions
        if estimate is not None:
            flow_mps = tuple(self._flow_mps(estimate, self._model_mps(sample.time_s, self._believed_m)).tolist())
        return SpeedVerdict(
            time_s=sample.time_s,
            level=level,
            score=self._evidence.score,
            speed_mps=nan if estimate is None else estimate.speed_mps * self._way.share,
            flow_mps=flow_mps,
            flag=int(_FLAGS[level]),
            speed_error_mps=nan if estimate is None else self._error(estimate) * self.normal.reference_mps,
            flow_error=flow_error,
            speed_min_mps=low_mps,
            speed_max_mps=high_mps,
            reason=reason,
        )


_FLAGS = {
    Level.UNKNOWN: Flag.FALSE_ALARM,
    Level.NORMAL: Flag.NO_ANOMALY,
    Level.SUSPECT: Flag.NO_ANOMALY,
    Level.FAULT: Flag.ANOMALY,
}
