"""Follows a vehicle from position to position: which ones are believed, and the step between two of them."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from math import hypot, inf, sqrt

import numpy as np
from numpy.typing import NDArray

from detectors.speed.averaging import Averaging
from detectors.speed.config import SpeedConfig
from detectors.speed.estimate import Estimate, Step
from detectors.speed.gate import Fate, PositionGate
from detectors.speed.noise import PositionNoise
from detectors.speed.outside import OutsideFlow
from detectors.speed.sample import PoseSample, position_of
from detectors.speed.way import Way

FloatArray = NDArray[np.float64]

GAP_S = 20.0  # after so long without a sample, or without a position to believe, the way in between is not known
FORGET_S = 1e4  # where positions went on contradicting what was learnt, it counts as old as this
SUDDEN = 0.5  # share of the speed scale that speed or flow may change by in a second: no outlier yet


@dataclass(frozen=True, slots=True, eq=False)
class Beginning:
    """A mean position without a step to it.

    Attributes:
        time_s, position_m: of the (D,) position.
        idle_s: so long no step was known; 0 at the very first.
    """

    time_s: float
    position_m: FloatArray
    idle_s: float


class Follower:
    """Takes samples one by one; picklable.

    Args:
        config: settings.

    Attributes:
        way: through the water, since the position that was believed last.
        believed_s: time of that position; minus infinity before the first.
        outside: the flow that is known from elsewhere.
        refused: positions that were not used, by cause.
    """

    def __init__(self, config: SpeedConfig) -> None:
        self._dimensions, self._scale_mps = config.dimensions, config.speed_scale_mps
        self.way = Way(config.dimensions, config.surge_time_s)
        self.outside = OutsideFlow(config)
        self.refused: Counter[str] = Counter()
        self.believed_s = -inf
        self._noise = PositionNoise(config.position_noise_m, config.speed_scale_mps, config.dimensions)
        self._gate = PositionGate()
        self._believed_m = np.zeros(config.dimensions)
        self._averaging = Averaging(config.dimensions)
        self._idle_s = 0.0  # that was not told yet
        self._carried_m = np.zeros(config.dimensions)  # by the flow that is known from elsewhere, since the beginning
        self._last: PoseSample | None = None

    @property
    def last(self) -> PoseSample | None:
        """The newest sample."""
        return self._last

    def forget_time(self) -> None:
        """The next sample is the first one, however late or early."""
        self._last, self.believed_s = None, -inf
        self._idle_s += FORGET_S
        self._noise.interrupt()

    def take(self, sample: PoseSample, share: float, estimate: Estimate | None) -> Step | Beginning | None:
        """Takes the next sample; None where its position is not used.

        Args:
            sample: later than the one before.
            share: of the reference speed, that the thrusters were told to give since the sample before.
            estimate: what is known of speed and flow, with their errors.
        """
        last, self._last = self._last, sample
        position_m = position_of(sample, self._dimensions)
        if last is None or sample.time_s - last.time_s > GAP_S:
            self._begin(sample, share, position_m)
            return None
        self.way.extend(sample, share)
        if np.array_equal(position_m, position_of(last, self._dimensions)):
            self.refused["position repeated"] += 1
            return None
        if sample.time_s - self.believed_s > GAP_S:
            self.refused["no position to go on from"] += 1
            self._noise.interrupt()
            self._begin(sample, share, position_m, FORGET_S)
            return None
        return self._judge(sample, share, position_m, estimate)

    def _judge(
        self, sample: PoseSample, share: float, position_m: FloatArray, estimate: Estimate | None
    ) -> Step | Beginning | None:
        """A new position."""
        interval_s = sample.time_s - self.believed_s
        middle_s, middle_m = 0.5 * (self.believed_s + sample.time_s), 0.5 * (self._believed_m + position_m)
        carried_m = self.outside.taken_off_mps(middle_s, middle_m, sample.down_m) * interval_s
        left_m = position_m - self._believed_m - carried_m - self._foreseen_m(interval_s, estimate)
        if not self._noise.known:
            self._noise.take(left_m)
            self._begin(sample, share, position_m)
            return None
        match self._gate.judge(left_m, self._spread_m(interval_s, estimate)):
            case Fate.TAKEN:
                self._noise.take(left_m)
                return self._believe(sample, position_m, carried_m)
            case Fate.JUMP:
                self.refused["position jumped"] += 1
                self._begin(sample, share, position_m)
            case Fate.OUTLIER:
                self.refused["position outlier"] += 1
        self._noise.interrupt()
        return None

    def _begin(self, sample: PoseSample, share: float, position_m: FloatArray, forget_s: float = 0.0) -> None:
        """The first position, the first after a gap, or the first of another frame."""
        if self.believed_s > -inf:
            self._idle_s += sample.time_s - self.believed_s + forget_s
        self.way.begin(sample, share)
        self.believed_s, self._believed_m = sample.time_s, position_m
        self._carried_m = np.zeros_like(position_m)
        self._averaging.begin(position_m, sample.time_s)

    def _believe(self, sample: PoseSample, position_m: FloatArray, carried_m: FloatArray) -> Step | Beginning | None:
        self._carried_m = self._carried_m + carried_m
        noise_m = self._noise.deviation_m, self._noise.least_m
        step = self._averaging.take(sample.time_s, position_m - self._carried_m, self.way, noise_m)
        self.believed_s, self._believed_m = sample.time_s, position_m
        self.way.restart()
        if step is None or isinstance(step, Step):
            return step
        idle_s, self._idle_s = self._idle_s, 0.0
        return Beginning(sample.time_s, step, idle_s)

    def _foreseen_m(self, interval_s: float, estimate: Estimate | None) -> FloatArray:
        """(D,) the way since the last believed position by what is known; without what is known from elsewhere."""
        if estimate is None:
            return self._scale_mps * self.way.ahead_s
        return estimate.speed_mps * self.way.ahead_s + estimate.flow_mps * interval_s

    def _spread_m(self, interval_s: float, estimate: Estimate | None) -> float:
        """Standard deviation of each coordinate of what is left then."""
        if estimate is None:
            return inf
        by_speed = estimate.speed_error_mps * float(np.linalg.norm(self.way.ahead_s))
        by_flow = estimate.flow_error_mps * interval_s
        by_change = SUDDEN * self._scale_mps * interval_s**1.5
        return hypot(sqrt(2.0) * self._noise.deviation_m, by_speed, by_flow, by_change)
