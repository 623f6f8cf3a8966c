"""Thrusters driven both ways, through the dead band, with sensors that give a direction and such that do not."""

import numpy as np
import pytest

from detectors.thruster import ThrusterDetector
from detectors.thruster.tests.simulation import RATE_HZ, Thruster, working
from detectors.verdict import Level

COUNT, ONSET = 1900, 1400
VISIBLE = 0.3  # command from which a loss can be seen at speed

THRUSTERS = [
    Thruster(delay=0, lag=0.0, dead_band=0.0, signed=True),
    Thruster(delay=3, lag=2.5, dead_band=0.05, signed=False),
    Thruster(delay=8, lag=6.0, dead_band=0.05, signed=True),
    Thruster(delay=5, lag=4.0, dead_band=0.1, signed=False),
]


@pytest.fixture(params=range(len(THRUSTERS)), ids=lambda number: f"lag {THRUSTERS[number].lag}")
def driven(request):
    thruster, seed = THRUSTERS[request.param], 30 + request.param
    return thruster, working(COUNT, seed), seed


def shown(thruster, command):
    """(N,) the command that the motor has at each sample."""
    return np.concatenate([np.full(thruster.delay, command[0]), command[: COUNT - thruster.delay]])


def test_no_finding_while_healthy(driven):
    thruster, command, seed = driven
    verdicts = ThrusterDetector().run(*thruster.simulate(command, seed=seed).arguments)
    assert set(verdicts.level.tolist()) == {Level.UNKNOWN, Level.NORMAL}
    assert np.mean(verdicts.level[600:] == Level.NORMAL) > 0.5


@pytest.mark.parametrize("side", [1.0, -1.0], ids=["ahead", "astern"])
def test_a_loss_of_15_percent_one_way_is_found_within_a_second_of_being_visible(driven, side):
    thruster, command, seed = driven
    acting = side * shown(thruster, command)
    at_fault = np.arange(COUNT) >= ONSET
    gain = np.where(at_fault & (acting > 0.0), 0.85, 1.0)
    verdicts = ThrusterDetector().run(*thruster.simulate(command, gain=gain, seed=seed).arguments)
    assert Level.FAULT not in verdicts.level[:ONSET]
    visible = np.cumsum(at_fault & (acting > VISIBLE))
    a_second_of_it = int(np.searchsorted(visible, RATE_HZ))
    assert a_second_of_it < COUNT
    assert Level.FAULT in verdicts.level[ONSET : a_second_of_it + 1]


def test_the_prediction_has_the_sensors_sign(driven):
    thruster, command, seed = driven
    series = thruster.simulate(command, seed=seed)
    predicted = ThrusterDetector().run(*series.arguments).predicted_rpm[600:]
    assert bool((predicted < -100.0).any()) == thruster.signed
    np.testing.assert_allclose(predicted, series.speed_rpm[600:], atol=450.0)
    assert np.median(np.abs(predicted - series.speed_rpm[600:])) < 30.0
