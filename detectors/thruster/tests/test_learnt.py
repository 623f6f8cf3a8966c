"""What was learnt can be looked at: a steady curve, and how well it is known."""

import pickle

import numpy as np
import pytest

from detectors.thruster import ThrusterConfig, ThrusterDetector

FULL_RPM = 3000.0
PAPER = ThrusterConfig(dynamics=False, search="exact", window_min=50, window_max=400, warmup=400)


def watched(config: ThrusterConfig, samples: int = 1500, low: float = -0.8) -> ThrusterDetector:
    """A detector that has seen a linear thruster at random commands, with 3 rpm of noise."""
    chance = np.random.default_rng(5)
    command = np.repeat(chance.uniform(low, 0.8, samples // 50), 50)
    speed_rpm = FULL_RPM * command + chance.normal(0.0, 3.0, samples)
    detector = ThrusterDetector(config)
    detector.run(np.arange(samples) / 50.0, command, speed_rpm)
    return detector


def test_there_is_none_before_anything_is_learnt():
    assert ThrusterDetector().learnt is None
    assert ThrusterDetector(PAPER).learnt is None
    assert watched(ThrusterConfig(), samples=100).learnt is None


@pytest.mark.parametrize("config", [ThrusterConfig(), PAPER], ids=["default", "paper"])
def test_the_curve_is_that_of_the_thruster_and_its_error_is_told(config):
    curve = watched(config).learnt
    assert (np.diff(curve.command) > 0.0).all()
    assert -0.81 <= curve.command[0] < -0.4
    assert 0.4 < curve.command[-1] <= 0.81
    # near standstill the sign of the speed is the command's: a kink that no polynomial has to follow
    driven = np.abs(curve.command) > 0.1
    error_rpm = np.abs(curve.speed_rpm - FULL_RPM * curve.command)[driven]
    assert (error_rpm < np.maximum(5.0 * curve.deviation_rpm[driven], 10.0)).all()
    assert (curve.deviation_rpm[driven] > 0.0).all()
    assert (curve.deviation_rpm[driven] < 30.0).all()


def test_only_what_was_driven_is_in_it():
    curve = watched(ThrusterConfig(), low=0.2).learnt
    assert curve.command[0] > 0.15
    assert len(curve.command) == len(curve.speed_rpm) == len(curve.deviation_rpm)


def test_it_is_that_of_the_detector_that_goes_on_elsewhere():
    detector = watched(ThrusterConfig())
    again = pickle.loads(pickle.dumps(detector))  # noqa: S301  our own bytes
    np.testing.assert_array_equal(again.learnt.speed_rpm, detector.learnt.speed_rpm)
