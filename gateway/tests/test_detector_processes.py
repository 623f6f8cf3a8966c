"""Detectors in other processes say what they say in this one; what goes wrong there is told here."""

from __future__ import annotations

import math
import os
import signal

import numpy as np
import pytest

from detectors.thruster import ThrusterConfig, ThrusterDetector, ThrusterSample
from gateway.replay.detector_processes import detector_processes


def columns(seed: int, samples: int = 3000) -> tuple[np.ndarray, ...]:
    chance = np.random.default_rng(seed)
    command = np.repeat(chance.uniform(-0.8, 0.8, samples // 50), 50)
    speed_rpm = 3000.0 * command + chance.normal(0.0, 3.0, samples)
    unknown = np.full(samples, np.nan)
    return np.arange(samples) / 50.0, command, speed_rpm, unknown, unknown


@pytest.fixture(scope="module")
def make():
    with detector_processes(2) as make:
        yield make


def test_blocks_are_judged_as_in_this_process(make):
    detectors = [make(ThrusterConfig(), None) for _ in range(3)]
    blocks = [(number, part) for part in range(3) for number in range(3)]
    rows = [slice(1000 * part, 1000 * part + 1000) for part in range(3)]
    data = [columns(seed) for seed in range(3)]
    # all of them handed over before the first answer is looked at
    answers = [detectors[n].run(*(column[rows[part]] for column in data[n])) for n, part in blocks]
    local = [ThrusterDetector(ThrusterConfig()) for _ in range(3)]
    for (number, part), answer in zip(blocks, answers, strict=True):
        wanted = local[number].run(*(column[rows[part]] for column in data[number]))
        assert answer.level.tolist() == wanted.level.tolist()
        assert repr(answer.row(999)) == repr(wanted.row(999))


def test_single_samples_acceptance_and_the_commissioned_curve_reach_it(make):
    there, here = make(ThrusterConfig(), None), ThrusterDetector(ThrusterConfig())
    data = columns(1)
    there.run(*data)
    here.run(*data)
    sample = ThrusterSample(60.0, 0.5, 1500.0, None, 3.0)
    assert repr(there.update(sample)) == repr(here.update(sample))
    there.accept()
    here.accept()
    assert repr(there.commissioned) == repr(here.commissioned) != "None"
    assert there.learnt.speed_rpm.tolist() == here.learnt.speed_rpm.tolist() != []


def test_an_error_in_the_process_is_raised_here(make):
    with pytest.raises((TypeError, ValueError)):
        _ = make(ThrusterConfig(), None).run("no", "numbers", "at all").level
    assert math.isnan(make(ThrusterConfig(), None).update(ThrusterSample(0.0, 0.5, 1500.0)).predicted_rpm)


def test_a_process_that_is_killed_is_told():
    with detector_processes(1) as make:
        detector = make(ThrusterConfig(), None)
        detector.update(ThrusterSample(0.0, 0.5, 1500.0))
        os.kill(detector._worker._process.pid, signal.SIGKILL)
        with pytest.raises(ChildProcessError, match="a process of detectors has ended"):
            detector.update(ThrusterSample(0.1, 0.5, 1500.0))
