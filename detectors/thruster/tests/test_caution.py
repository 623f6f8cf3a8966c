"""Caution scales the automatic threshold, and nothing else."""

import numpy as np
import pytest

from detectors.thruster import ThrusterConfig, ThrusterDetector
from detectors.thruster.tests.simulation import Thruster, cruising, lasting
from detectors.verdict import Level

COUNT = 1200


def judged(caution, gain=1.0):
    series = Thruster().simulate(cruising(COUNT, 5), gain=gain, seed=5)
    return ThrusterDetector(ThrusterConfig(caution=caution)).run(*series.arguments)


def test_a_healthy_score_is_as_many_times_smaller():
    once, twice = judged(1.0), judged(2.0)
    assert once.score.max() > 0.1
    np.testing.assert_allclose(2.0 * twice.score, once.score, rtol=1e-9)
    np.testing.assert_array_equal(once.predicted_rpm, twice.predicted_rpm)


@pytest.mark.parametrize(("caution", "found"), [(1.0, True), (4.0, False)])
def test_a_small_loss_is_a_fault_for_those_who_are_not_cautious(caution, found):
    verdicts = judged(caution, lasting(COUNT, 900, 0.92, COUNT))
    assert (Level.FAULT in verdicts.level[900:]) == found
    assert Level.FAULT not in verdicts.level[:900]


def test_a_fixed_threshold_is_what_it_is():
    series = Thruster().simulate(cruising(COUNT, 5), seed=5)
    some, other = (
        ThrusterDetector(ThrusterConfig(threshold_rpm=150.0, caution=caution)).run(*series.arguments)
        for caution in (1.0, 3.0)
    )
    np.testing.assert_array_equal(some.score, other.score)


@pytest.mark.parametrize("caution", [0.4, 11.0, float("nan")])
def test_caution_has_a_range(caution):
    with pytest.raises(ValueError, match=r"caution = .*: want 0\.5 to 10"):
        ThrusterConfig(caution=caution)
