import numpy as np
import pytest

from detectors.thruster.candidates import WindowCandidates
from detectors.thruster.config import ThrusterConfig
from detectors.thruster.curve import CommandBasis
from detectors.thruster.polynomial import SPEED_FLOOR
from detectors.thruster.search import ExactSearch
from detectors.thruster.tests.simulation import working

COUNT, NOISE = 700, 0.01
CONFIG = ThrusterConfig(window_min=100, window_max=600, warmup=200)


def problem(seed=0):
    rng = np.random.default_rng(seed)
    basis = CommandBasis(1.0, CONFIG.order_max, astern=True)
    command = working(COUNT, seed)
    speed = np.sign(command) * np.abs(command) ** 0.8 + rng.normal(0.0, NOISE, COUNT)
    usable = rng.uniform(size=COUNT) > 0.1
    return basis.columns(command), speed, usable, basis


def brute_force(columns, speed, usable, basis, order, window):
    kept = basis.up_to(order)
    rows = np.flatnonzero(usable & (np.arange(COUNT) >= COUNT - window))
    design = np.vstack([columns[kept][:, rows].T / NOISE, np.diag(1.0 / basis.prior_deviation[kept])])
    wanted = np.concatenate([speed[rows] / NOISE, np.zeros(int(kept.sum()))])
    coefficients = np.zeros(basis.size)
    coefficients[kept] = np.linalg.lstsq(design, wanted, rcond=None)[0]
    error = np.abs(speed - coefficients @ columns) / np.maximum(np.abs(speed), SPEED_FLOOR)
    return max(error[rows].mean(), error[usable].mean()), coefficients


@pytest.mark.parametrize("seed", range(2))
def test_grid_equals_brute_force(seed):
    columns, speed, usable, basis = problem(seed)
    candidates = WindowCandidates(columns, speed, usable, basis, CONFIG, noise=NOISE)
    expected = [
        [brute_force(columns, speed, usable, basis, order, window)[0] for window in candidates.windows]
        for order in candidates.orders
    ]
    np.testing.assert_allclose(candidates.grid(), expected, rtol=1e-8)


def test_a_window_between_those_of_the_grid_is_one_as_well():
    columns, speed, usable, basis = problem()
    candidates = WindowCandidates(columns, speed, usable, basis, CONFIG, noise=NOISE)
    assert 333 not in candidates.windows
    assert candidates.fitness(3, 333) == pytest.approx(brute_force(columns, speed, usable, basis, 3, 333)[0])


def test_coefficients_of_the_choice():
    columns, speed, usable, basis = problem()
    candidates = WindowCandidates(columns, speed, usable, basis, CONFIG, noise=NOISE)
    choice = ExactSearch()(candidates)
    _, expected = brute_force(columns, speed, usable, basis, choice.order, choice.window)
    np.testing.assert_allclose(candidates.coefficients(choice), expected, rtol=1e-7, atol=1e-10)


def test_a_window_without_a_usable_sample_is_never_chosen():
    columns, speed, usable, basis = problem()
    usable[-100:] = False
    candidates = WindowCandidates(columns, speed, usable, basis, CONFIG, noise=NOISE)
    assert np.isinf(candidates.grid()[:, 0]).all()
    assert ExactSearch()(candidates).window > 100
