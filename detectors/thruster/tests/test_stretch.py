"""A stretch of samples shows the thruster that made them."""

import numpy as np
import pytest

from detectors.thruster import ThrusterConfig
from detectors.thruster.stretch import model_of_stretch
from detectors.thruster.tests.simulation import RATE_HZ, Thruster, working


def block(thruster, samples):
    series = thruster.simulate(working(samples, 2), seed=2)
    unmeasured = np.full(samples, np.nan)
    return np.stack([series.time_s, series.command, series.speed_rpm, unmeasured, unmeasured])


def test_delay_lag_and_curve_are_those_of_the_thruster():
    thruster = Thruster(delay=4, lag=3.0)
    model, period_s = model_of_stretch(block(thruster, 1500), ThrusterConfig())
    assert period_s == pytest.approx(1.0 / RATE_HZ)
    assert model.response.delay + model.response.lag == pytest.approx(7.0, abs=0.5)
    half = float(model.speed_rpm(np.array([0.5]))[0])
    steady = thruster.simulate(np.full(400, 0.5), seed=1).speed_rpm[-100:].mean()
    assert half == pytest.approx(steady, rel=0.01)


@pytest.mark.parametrize("samples", [100, 311])
def test_a_stretch_that_is_too_short_shows_nothing(samples):
    assert model_of_stretch(block(Thruster(), samples), ThrusterConfig()) is None


def test_a_thruster_at_rest_shows_nothing():
    still = block(Thruster(), 800)
    still[1:3] = 0.0
    assert model_of_stretch(still, ThrusterConfig()) is None


def test_numbers_that_are_none_show_nothing():
    spoiled = block(Thruster(), 800)
    spoiled[2, 400] = np.nan
    assert model_of_stretch(spoiled, ThrusterConfig()) is None
