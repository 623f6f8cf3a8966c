"""The method of paper 002 to the letter: Algorithm 1 with its explicit step, and Algorithm 2."""

from __future__ import annotations

from math import nan

import numpy as np
from numpy.typing import NDArray

from detectors.speed.anomaly import LEVELS, Flag, FlowComparison, ForeseenFlow, flag
from detectors.speed.config import SpeedConfig
from detectors.speed.learnt_flow import FixedBasisFlow, LearntFlow
from detectors.speed.moving_basis import MovingBasisFlow
from detectors.speed.sample import PoseSample, SpeedVerdict, direction_of, position_of
from detectors.verdict import Level

FloatArray = NDArray[np.float64]

DIVERGED = 1e3  # times the greatest normal speed, in m/s and m: no vehicle, no water and no estimate of them
DOUBT_SAMPLES = 200  # for which nothing is believed after the estimate has diverged: what was learnt is gone


def flow_to_learn(config: SpeedConfig) -> LearntFlow:
    """The flow that the config's basis can learn, all parameters 0; without a basis, over one that moves."""
    if config.basis is None:
        return MovingBasisFlow(config.dimensions)
    return FixedBasisFlow(config.basis, config.dimensions)


class ExplicitLaw:
    """Algorithm 1 of paper 002, line by line; under a limit with the error of equations 25-28. Picklable.

    Args:
        flow: xi phi, with xi(0).
        learning_rate, gain: gamma and K.
        speed_mps: V_L(0).
        position_m: (D,) x(0), and z(0).
        speed_limit_mps: u_0; None: no limit.
    """

    def __init__(
        self,
        flow: LearntFlow,
        *,
        learning_rate: float,
        gain: float,
        speed_mps: float,
        position_m: FloatArray,
        speed_limit_mps: float | None = None,
    ) -> None:
        self._learning_rate, self._gain, self._limit_mps = learning_rate, gain, speed_limit_mps
        self.flow = flow
        self.speed_mps = speed_mps
        self.estimated_position_m = position_m
        self._error_by_limit = np.zeros_like(position_m)

    @property
    def through_water_mps(self) -> float:
        """u of equation 3, by V_L."""
        return self.speed_mps if self._limit_mps is None else min(self.speed_mps, self._limit_mps)

    def diverged(self, position_m: FloatArray, time_s: float, bound: float) -> bool:
        """Whether the explicit step, too long for its gains, has left every bound.

        Args:
            position_m: (D,) x(t).
            time_s: t.
            bound: of errors in m and of velocities in m/s.
        """
        apart = (*(position_m - self.estimated_position_m), *self._error_by_limit, self.speed_mps)
        if not all(abs(value) < bound for value in apart):
            return True  # and maybe too far away to ask for the flow there
        return not bool((np.abs(self.velocity_mps(time_s)) < bound).all())

    def velocity_mps(self, time_s: float) -> FloatArray:
        """(D,) F_L = xi phi(z, t)."""
        return self.flow.velocity_mps(time_s, self.estimated_position_m)

    def step(self, position_m: FloatArray, ahead: FloatArray, time_s: float, interval_s: float) -> None:
        """From t to t + 1.

        Args:
            position_m: (D,) x(t).
            ahead: (D,) Psi_c(t).
            time_s: t.
            interval_s: T_s, from t to t + 1.
        """
        self.flow.move(position_m, time_s)
        error = position_m - self.estimated_position_m  # line 2
        of_law = error - self._error_by_limit  # (26); e itself without a limit
        flow_here = self.velocity_mps(time_s)
        injection = self.flow.velocity_mps(time_s, position_m) - flow_here + self._gain * error  # line 3, beta
        values = self.flow.values(position_m, time_s)
        self.flow.learn(values, self._learning_rate * interval_s * of_law)  # line 4
        moved = flow_here + self.speed_mps * ahead + injection
        self.estimated_position_m = self.estimated_position_m + moved * interval_s  # line 5
        beyond = (self.through_water_mps - self.speed_mps) * ahead
        self._error_by_limit = (
            self._error_by_limit + (beyond - self._gain * self._error_by_limit) * interval_s
        )  # (25)
        self.speed_mps += self._learning_rate * float(of_law @ ahead) * interval_s  # line 6


class PublishedMethod:
    """Algorithms 1 and 2 of paper 002, sample by sample; picklable at any sample, and then goes on bit for bit.

    T_s is the time between two samples, whatever it is: the paper's is constant. Where the explicit step does not
    bear it and diverges, all that was learnt is thrown away, with flag 2 for some time.

    Args:
        config: with the normal range.
        flow: xi phi with xi(0); None: of the config's basis, and zero.
        speed_mps: V_L(0), which the paper leaves open; None: the middle of the normal range.

    Raises:
        ValueError: a config without a normal range.
    """

    def __init__(self, config: SpeedConfig, flow: LearntFlow | None = None, speed_mps: float | None = None) -> None:
        low, high = config.speed_min_mps, config.speed_max_mps
        if low is None or high is None:
            raise ValueError(f"speed_min_mps = {low}, speed_max_mps = {high}: want both (paper 002, assumption 3)")
        self._config = config
        self._low_mps, self._high_mps = low, high
        self._start = flow_to_learn(config) if flow is None else flow
        self._start_mps = 0.5 * (low + high) if speed_mps is None else speed_mps
        self._last: PoseSample | None = None
        self._law: ExplicitLaw | None = None
        self._doubted = 0  # samples that are still not to be believed
        self._forget_flows()

    @property
    def law(self) -> ExplicitLaw | None:
        """Algorithm 1 as it stands; None before the first sample."""
        return self._law

    def judge(self, sample: PoseSample) -> SpeedVerdict:
        """The next sample; finite, and later than the one before."""
        before, law = self._last, self._law
        self._last = sample
        position = position_of(sample, self._config.dimensions)
        if before is not None and law is not None:
            was, ahead = (of(before, self._config.dimensions) for of in (position_of, direction_of))
            law.step(was, ahead, before.time_s, sample.time_s - before.time_s)
            if not law.diverged(position, sample.time_s, DIVERGED * self._high_mps):
                return self._judge(sample.time_s, law)
            self._doubted = DOUBT_SAMPLES
            self._forget_flows()
        self._law = law = self._law_from(position)
        return self._say(sample.time_s, law, Flag.FALSE_ALARM, nan)

    def accept(self) -> None:
        """Not in the paper: the normal range is about the present speed from now on, where that is ahead at all."""
        if self._law is None or self._law.through_water_mps <= 0.0:
            return
        ratio = self._law.through_water_mps / (0.5 * (self._low_mps + self._high_mps))
        self._low_mps, self._high_mps = ratio * self._low_mps, ratio * self._high_mps
        self._forget_flows()

    def _judge(self, time_s: float, law: ExplicitLaw) -> SpeedVerdict:
        """Algorithm 2."""
        normal = self._low_mps <= law.through_water_mps <= self._high_mps
        foreseen = self._foreseen.velocity_mps(law.flow, normal, time_s, law.estimated_position_m)
        flow_error = self._comparison.error(law.velocity_mps(time_s), foreseen)
        said = flag(flow_error, self._config.flow_error_max, normal)
        if self._doubted > 0:
            self._doubted -= 1
            said = Flag.FALSE_ALARM
        return self._say(time_s, law, said, flow_error)

    def _say(self, time_s: float, law: ExplicitLaw, said: Flag, flow_error: float) -> SpeedVerdict:
        speed_mps = law.through_water_mps
        middle_mps, half_mps = 0.5 * (self._high_mps + self._low_mps), 0.5 * (self._high_mps - self._low_mps)
        return SpeedVerdict(
            time_s=time_s,
            level=LEVELS[said],
            score=abs(speed_mps - middle_mps) / half_mps,
            speed_mps=speed_mps,
            flow_mps=tuple(law.velocity_mps(time_s).tolist()),
            flag=int(said),
            flow_error=flow_error,
            speed_min_mps=self._low_mps,
            speed_max_mps=self._high_mps,
            reason=_reason(said, speed_mps < middle_mps),
        )

    def _law_from(self, position_m: FloatArray) -> ExplicitLaw:
        return ExplicitLaw(
            self._start.frozen(),
            learning_rate=self._config.learning_rate,
            gain=self._config.gain,
            speed_mps=self._start_mps,
            position_m=position_m,
            speed_limit_mps=self._config.speed_limit_mps,
        )

    def _forget_flows(self) -> None:
        self._comparison = FlowComparison()
        self._foreseen = ForeseenFlow(self._config.flow_model)


def _reason(said: Flag, slow: bool) -> str:
    if LEVELS[said] is Level.FAULT:
        return "too slow" if slow else "too fast"
    return "flow is not as foreseen" if said is Flag.FALSE_ALARM else ""
