"""What the method of paper 002 says of a trial, to the letter and with its law integrated exactly."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from math import inf, nan

import numpy as np
from numpy.typing import NDArray

from detectors.speed.adaptive import AdaptiveEstimator
from detectors.speed.anomaly import Flag, FlowComparison, ForeseenFlow, flag
from detectors.speed.estimate import Step
from detectors.speed.learnt_flow import FixedBasisFlow, LearntFlow
from detectors.speed.published import PublishedMethod
from detectors.speed.sample import direction_of, position_of
from hil_tests.speed_trials import SpeedTrial

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class SpeedTrace:
    """What was learnt and said at every sample of a trial.

    Attributes:
        time_s: (N,)
        flag: (N,) of Algorithm 2.
        flow_error: (N,) p_E.
        speed_mps: (N,) V_L.
        flow_mps: (N, 2) F_L.
        localisation_error_m: (N, 2) e = x - z.
        parameters: (N, 2, M) xi.
    """

    time_s: FloatArray
    flag: NDArray[np.int_]
    flow_error: FloatArray
    speed_mps: FloatArray
    flow_mps: FloatArray
    localisation_error_m: FloatArray
    parameters: FloatArray


def judge_to_the_letter(trial: SpeedTrial) -> SpeedTrace:
    """Algorithms 1 and 2, with the explicit step."""
    method = PublishedMethod(trial.config, trial.start_flow, trial.start_mps)
    rows = []
    for sample in trial.samples:
        said = method.judge(sample)
        law = method.law
        error = position_of(sample, 2) - law.estimated_position_m if law else np.full(2, nan)
        learnt = parameters_of(law.flow) if law else trial.start_flow.parameters
        rows.append((said.time_s, said.flag, said.flow_error, said.speed_mps, said.flow_mps, error, learnt))
    return SpeedTrace(*(np.array(column) for column in zip(*rows, strict=True)))


def judge_exactly(trial: SpeedTrial) -> SpeedTrace:
    """The law integrated exactly, and Algorithm 2."""
    config = trial.config
    estimator = AdaptiveEstimator(
        trial.start_flow.frozen(),
        learning_rate=config.learning_rate,
        gain=config.gain,
        speed_mps=trial.start_mps,
        speed_limit_mps=config.speed_limit_mps,
    )
    comparison, foreseen = FlowComparison(), ForeseenFlow(config.flow_model)
    low_mps, high_mps = config.speed_min_mps or 0.0, config.speed_max_mps or inf
    first = trial.samples[0]
    estimator.begin(position_of(first, 2), first.time_s)
    start = trial.start_flow.velocity_mps(first.time_s, position_of(first, 2))
    rows = [(first.time_s, Flag.FALSE_ALARM, nan, trial.start_mps, start, np.zeros(2), trial.start_flow.parameters)]
    for before, sample in pairwise(trial.samples):
        interval_s, position = sample.time_s - before.time_s, position_of(sample, 2)
        ahead_s = 0.5 * interval_s * (direction_of(before, 2) + direction_of(sample, 2))
        estimate = estimator.update(Step(sample.time_s, interval_s, position, ahead_s, np.zeros(2), np.zeros(2)))
        normal = low_mps <= estimate.speed_mps <= high_mps
        foreseen_mps = foreseen.velocity_mps(estimator.flow, normal, sample.time_s, position)
        flow_error = comparison.error(estimate.flow_mps, foreseen_mps)
        said = flag(flow_error, config.flow_error_max, normal)
        error, learnt = estimator.localisation_error_m, parameters_of(estimator.flow)
        rows.append((sample.time_s, said, flow_error, estimate.speed_mps, estimate.flow_mps, error, learnt))
    return SpeedTrace(*(np.array(column) for column in zip(*rows, strict=True)))


def parameters_of(flow: LearntFlow) -> FloatArray:
    """(2, M) xi of a trial's flow.

    Raises:
        TypeError: a flow whose basis moves, and whose parameters are not those of the same functions all the time.
    """
    if not isinstance(flow, FixedBasisFlow):
        raise TypeError(f"flow of the type {type(flow).__name__}: want a FixedBasisFlow")
    return flow.parameters


def unsettled_until_s(trace: SpeedTrace, fault_s: float) -> float:
    """First instant from which on the flag is 0 until the fault; NaN where there is none."""
    before = trace.flag[trace.time_s < fault_s]
    flagged = np.flatnonzero(before)
    settled = flagged[-1] + 1 if len(flagged) else 0
    return float(trace.time_s[settled]) if settled < len(before) else nan


def found_s(trace: SpeedTrace, fault_s: float) -> float:
    """First instant of flag 1 after the fault, NaN where there is none."""
    found = np.flatnonzero((trace.flag == Flag.ANOMALY) & (trace.time_s >= fault_s))
    return float(trace.time_s[found[0]]) if len(found) else nan


def false_alarms(trace: SpeedTrace, fault_s: float) -> int:
    """Samples of flag 1 before the fault."""
    return int(np.count_nonzero((trace.flag == Flag.ANOMALY) & (trace.time_s < fault_s)))


def kept_share(trace: SpeedTrace, fault_s: float) -> float:
    """Of the samples after flag 1 was first raised, those that have it."""
    after = trace.flag[trace.time_s >= found_s(trace, fault_s)]
    return float(np.mean(after == Flag.ANOMALY)) if len(after) else 0.0
