"""A detector that goes on in another run, by a clock that may be ahead, or behind: what it learnt holds."""

import copy
from functools import cache

import numpy as np
import pytest

from detectors.thruster import ThrusterConfig, ThrusterDetector, ThrusterSample
from detectors.verdict import Level

PERIOD_S = 0.02
SHIFTS_S = [-3.0e7, 60.0]


def samples(start_s: float, count: int, share: float = 1.0, seed: int = 3) -> list[ThrusterSample]:
    chance = np.random.default_rng(seed)
    commands = 0.55 + 0.3 * np.sin(np.arange(count) / 15.0)
    return [
        ThrusterSample(start_s + PERIOD_S * n, u, share * 3000.0 * u + chance.normal(0.0, 5.0))
        for n, u in enumerate(commands)
    ]


@cache
def learnt(dynamics: bool) -> ThrusterDetector:
    detector = ThrusterDetector(ThrusterConfig(dynamics=dynamics))
    for sample in samples(1.7e9, 900):
        detector.update(sample)
    return detector


def resumed(shift_s: float, dynamics: bool = True) -> tuple[ThrusterDetector, float]:
    """A detector that has learnt, in another run; and the time that it is there."""
    again = copy.deepcopy(learnt(dynamics))
    again.resume()
    return again, 1.7e9 + 900 * PERIOD_S + shift_s


@pytest.mark.parametrize("dynamics", [True, False])
@pytest.mark.parametrize("shift_s", SHIFTS_S)
def test_healthy_goes_on_healthy_and_is_judged_from_the_first_moments_on(dynamics, shift_s):
    detector, start_s = resumed(shift_s, dynamics)
    verdicts = [detector.update(sample) for sample in samples(start_s, 600)]
    assert not detector.refused
    assert all(verdict.level <= Level.SUSPECT for verdict in verdicts)
    assert verdicts[100].level is Level.NORMAL and verdicts[-1].level is Level.NORMAL


@pytest.mark.parametrize("shift_s", SHIFTS_S)
def test_a_fault_of_the_new_run_is_found_at_once(shift_s):
    detector, start_s = resumed(shift_s)
    verdicts = [detector.update(sample) for sample in samples(start_s, 300, share=0.7)]
    assert any(verdict.level is Level.FAULT for verdict in verdicts[:100])


@pytest.mark.parametrize("shift_s", SHIFTS_S)
def test_a_block_is_the_same_as_one_by_one(shift_s):
    one, start_s = resumed(shift_s)
    block = copy.deepcopy(one)
    new = samples(start_s, 200)
    columns = np.array([(s.time_s, s.command, s.speed_rpm) for s in new]).T
    verdicts = block.run(*columns)
    assert [repr(verdicts.row(n)) for n in range(len(new))] == [repr(one.update(sample)) for sample in new]


def test_without_that_a_clock_that_is_behind_would_be_refused():
    detector = ThrusterDetector(ThrusterConfig())
    for sample in samples(1.7e9, 10):
        detector.update(sample)
    detector.update(samples(1.6e9, 1)[0])
    assert detector.refused == {"late or repeated": 1}
