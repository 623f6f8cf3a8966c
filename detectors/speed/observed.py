"""Judges the speed that an estimator learns: the method of every estimator but the published one."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from math import hypot, isfinite, nan

import numpy as np
from numpy.typing import NDArray

from detectors.speed.adaptive import AdaptiveEstimator
from detectors.speed.anomaly import Flag
from detectors.speed.config import SpeedConfig
from detectors.speed.curve import SpeedCurve
from detectors.speed.estimate import Estimate, Step
from detectors.speed.estimators import new_estimator
from detectors.speed.evidence import Evidence, weigh
from detectors.speed.excitation import Excitation
from detectors.speed.following import Beginning, Follower
from detectors.speed.normal import NormalSpeed
from detectors.speed.sample import PoseSample, SpeedVerdict, position_of
from detectors.speed.sideways import Sideways
from detectors.verdict import Level

FloatArray = NDArray[np.float64]

START_S = 15.0  # what is learnt first is not judged
STALE_S = 10.0  # after so long without a position to believe, nothing is known of the present
OLD_S = 300.0  # a FAULT of so long ago is to be found anew
WELL_KNOWN = 0.06  # a speed with an error up to this share of it is good enough to learn from
ACCEPTABLE = 0.2  # an operator who accepts a speed that is known less well accepts whatever will be learnt next
SURGE_ERROR = 0.3  # of the part of a change of speed that is still to come: hulls follow as a lag only roughly

FLAGS = {
    Level.UNKNOWN: Flag.FALSE_ALARM,
    Level.NORMAL: Flag.NO_ANOMALY,
    Level.SUSPECT: Flag.NO_ANOMALY,
    Level.FAULT: Flag.ANOMALY,
}


class ObservedMethod:
    """From poses to verdicts. Picklable at any sample, and then goes on bit for bit.

    Args:
        config: settings.
        curve: normal speed over the command, from an earlier dive.

    Attributes:
        normal: what is normal.
    """

    def __init__(self, config: SpeedConfig, curve: SpeedCurve | None = None) -> None:
        self._config = config
        self.normal = NormalSpeed(config, curve)
        self._follower = Follower(config)
        self._estimator = new_estimator(config)
        self._excitation = Excitation(config.dimensions)
        self._sideways = Sideways()
        self._evidence = Evidence()
        self._estimate: Estimate | None = None
        self._learnt_s = 0.0
        self._slow = True
        self._healthy = True  # when it was last judged; a vehicle that may have been caught teaches nothing

    @property
    def refused(self) -> Counter[str]:
        """Positions that were not used, by cause."""
        return self._follower.refused

    def judge(self, sample: PoseSample) -> SpeedVerdict:
        """The next sample; finite, and later than the one before."""
        last = self._follower.last
        passed_s = 0.0 if last is None else sample.time_s - last.time_s
        self.normal.follow(sample.command, passed_s)
        self._sideways.take(sample.command, sample.sideways, passed_s)
        match self._follower.take(sample, self.normal.share(), self._estimate):
            case Step() as step if self._sideways.hard:
                self._pass_over(step)
            case Step() as step:
                self._learn(step)
            case Beginning(time_s, position_m, idle_s):
                self._estimator.begin(position_m, time_s)
                self._estimator.idle(idle_s)
                if idle_s > OLD_S:
                    self._evidence.clear()
                elif idle_s > 0.0:
                    self._evidence.nothing()
        if sample.time_s - self._follower.believed_s > STALE_S:
            self._evidence.nothing()
        return self._verdict(sample)

    def resume(self) -> None:
        """Goes on at another time: only what was learnt is kept."""
        self._follower.forget_time()
        self._evidence.clear()
        self._healthy = True

    def accept(self) -> None:
        """The present speed is normal from now on; where it is not known, the one that is learnt next."""
        estimate = self._estimate
        known = estimate is not None and self.normal.curve is not None and self._error(estimate) < ACCEPTABLE
        if known and estimate is not None and estimate.speed_mps > 0.0:
            ratio = estimate.speed_mps / self.normal.reference_mps
            self.normal.accept(ratio)
            self._rescale(1.0 / ratio, estimate)
        else:
            self.normal.forget()
        self._evidence.clear()

    def _pass_over(self, step: Step) -> None:
        """Goes on from the end of a step that says nothing."""
        self._estimator.begin(step.position_m, step.time_s)
        self._estimator.idle(step.interval_s)
        self._evidence.nothing()

    def _learn(self, step: Step) -> None:
        self._excitation.take(step.ahead_s, step.interval_s)
        estimate = self._estimator.update(step)
        if not isfinite(estimate.speed_error_mps):  # an estimator that does not know how well it knows
            error_mps = self._excitation.error * abs(estimate.speed_mps)
            estimate = replace(estimate, speed_error_mps=error_mps, flow_error_mps=error_mps)
        self._estimate = estimate
        self._learnt_s += step.interval_s
        if self._learnt_s >= START_S:
            self._weigh(step.interval_s, estimate)

    def _weigh(self, interval_s: float, estimate: Estimate) -> None:
        """Holds a new estimate against what is normal, or learns what is normal from it."""
        surging = SURGE_ERROR * abs(self.normal.share() - self._follower.way.share)
        ratio, error = estimate.speed_mps / self.normal.reference_mps, hypot(self._error(estimate), surging)
        normal = self.normal.range()
        if normal is None or self.normal.stopped:
            self._evidence.nothing()
        else:
            self._evidence.take(weigh(ratio, error, normal.low, normal.high), interval_s)
            if self._evidence.level < Level.FAULT:
                self._slow = ratio < 0.5 * (normal.low + normal.high)
        healthy = self._evidence.level is Level.NORMAL or (normal is None and self._healthy)
        if normal is not None:
            self._healthy = self._evidence.level is Level.NORMAL
        if healthy and error < WELL_KNOWN * abs(ratio):
            factor = self.normal.learn(ratio, interval_s)
            if factor != 1.0:
                self._rescale(factor, estimate)

    def _rescale(self, factor: float, estimate: Estimate) -> None:
        """The normal speed is another: the vehicle's is the same, in other shares."""
        self._estimator.rescale(factor)
        self._follower.way.rescale(1.0 / factor)
        self._estimate = replace(
            estimate, speed_mps=factor * estimate.speed_mps, speed_error_mps=factor * estimate.speed_error_mps
        )

    def _error(self, estimate: Estimate) -> float:
        """Standard deviation of the speed, as a share of the reference."""
        return estimate.speed_error_mps / self.normal.reference_mps

    def _verdict(self, sample: PoseSample) -> SpeedVerdict:
        level, normal, reason = self._evidence.level, self.normal.range(), ""
        low_mps, high_mps = (nan, nan) if normal is None else normal.limits_mps
        speed_mps = error_mps = flow_error = nan
        flow_mps: tuple[float, ...] = (nan,) * self._config.dimensions
        if self._estimate is not None:
            share = self._follower.way.share
            speed_mps, error_mps = self._estimate.speed_mps * share, self._estimate.speed_error_mps
            error_mps = error_mps * abs(share) if isfinite(error_mps) else error_mps
            learnt_mps, flow_error, contradicted = self._flow(sample, self._estimate)
            flow_mps = tuple(learnt_mps.tolist())
            if contradicted and level > Level.NORMAL:
                level, reason = Level.UNKNOWN, "flow is not as foreseen"
        return SpeedVerdict(
            time_s=sample.time_s,
            level=level,
            score=self._evidence.score,
            speed_mps=speed_mps,
            flow_mps=flow_mps,
            flag=int(FLAGS[level]),
            speed_error_mps=error_mps,
            flow_error=flow_error,
            speed_min_mps=low_mps,
            speed_max_mps=high_mps,
            reason=reason or self._reason(level),
        )

    def _flow(self, sample: PoseSample, estimate: Estimate) -> tuple[FloatArray, float, bool]:
        """(D,) F_L, p_E, and whether what is foreseen contradicts what was learnt (Algorithm 2, line 4)."""
        outside, position_m = self._follower.outside, position_of(sample, self._config.dimensions)
        normal = self._evidence.level <= Level.NORMAL
        if isinstance(self._estimator, AdaptiveEstimator):  # has no uncertainty of its own, only this to go by
            flow_error = outside.error_of_field(self._estimator.flow, normal, sample.time_s, position_m)
            return estimate.flow_mps, flow_error, flow_error > self._config.flow_error_max
        learnt_mps = estimate.flow_mps + outside.taken_off_mps(sample.time_s, position_m, sample.down_m)
        said_mps = outside.said_mps(sample.time_s, position_m, sample.down_m)
        return learnt_mps, outside.error(learnt_mps, said_mps, normal), outside.contradicted(learnt_mps, said_mps)

    def _reason(self, level: Level) -> str:
        if level is Level.NORMAL:
            return ""
        if level >= Level.SUSPECT and self._estimate is not None:
            return "too slow" if self._slow else "too fast"
        return self._obstacle() or "no turn yet to tell speed from flow"

    def _obstacle(self) -> str:
        """Why the speed cannot be judged, apart from its own doubt; empty where nothing is in the way."""
        obstacles = {
            "learning": self._estimate is None,
            "command not known": self.normal.command_lost,
            "thrusters stopped": self.normal.stopped,
            "driven sideways": self._sideways.hard,
            "learning the normal speed": self.normal.range() is None,
        }
        found = next((reason for reason, there in obstacles.items() if there), "")
        return found or ("learning" if self._learnt_s < START_S else "")
