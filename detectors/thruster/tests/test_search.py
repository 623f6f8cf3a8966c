import numpy as np
import pytest

from detectors.thruster.fitness import Candidates
from detectors.thruster.polynomial import mape, speed_floor_rpm
from detectors.thruster.search import ExactSearch, SwarmSearch, search_named

WINDOWS = {"order_max": 4, "window_min": 30, "window_max": 120}


def thruster(seed: int, n: int = 150):
    """Commands that ramp and hold, a curve that changes at a random instant, noise."""
    rng = np.random.default_rng(seed)
    command = np.interp(np.arange(n), np.arange(0, n + 15, 15), rng.uniform(-5.0, 5.0, n // 15 + 1))
    gain = np.where(np.arange(n) < rng.integers(20, n - 20), 1.0, 0.9)
    return command, gain * (140.0 * command - 0.8 * command**3) + rng.normal(0.0, 3.0, n)


def brute_force(command, speed, order, window):
    floor = speed_floor_rpm(speed[-120:])
    curve = np.polyfit(command[-window:], speed[-window:], order)

    def error(newest):
        return mape(speed[-newest:], np.polyval(curve, command[-newest:]), floor)

    return max(error(window), error(30))


@pytest.mark.parametrize("seed", range(3))
def test_grid_equals_brute_force_with_polyfit(seed):
    command, speed = thruster(seed)
    grid = Candidates(command, speed, **WINDOWS).grid()
    expected = [[brute_force(command, speed, order, window) for window in range(30, 121)] for order in range(1, 5)]
    np.testing.assert_allclose(grid, expected, rtol=1e-8)


def test_one_candidate_equals_its_place_in_the_grid():
    candidates = Candidates(*thruster(5), **WINDOWS)
    grid = candidates.grid()
    single = [
        [candidates.fitness(order, int(window)) for window in candidates.windows] for order in candidates.orders
    ]
    np.testing.assert_allclose(single, grid, rtol=1e-10)


@pytest.mark.parametrize("seed", range(10))
def test_swarm_is_never_better_than_exact(seed):
    candidates = Candidates(*thruster(seed), **WINDOWS)
    exact = ExactSearch()(candidates)
    swarm = SwarmSearch(seed=seed)(candidates)
    assert exact.fitness <= swarm.fitness * (1 + 1e-12)
    assert swarm.fitness <= 1.5 * exact.fitness


def test_choice_is_the_least_of_the_grid():
    candidates = Candidates(*thruster(3), **WINDOWS)
    choice = ExactSearch()(candidates)
    assert choice.fitness == candidates.grid().min()
    assert candidates.fitness(choice.order, choice.window) == pytest.approx(choice.fitness, rel=1e-10)
    curve = candidates.model(choice.order, choice.window)
    assert (curve.order, curve.window) == (choice.order, choice.window)


def test_orders_that_are_not_excited_are_not_chosen():
    command = np.repeat([1.0, 2.0, 1.0, 2.0, 1.0], 30)
    speed = 100.0 * command + np.random.default_rng(0).normal(0.0, 1.0, 150)
    candidates = Candidates(command, speed, **WINDOWS)
    grid = candidates.grid()
    np.testing.assert_array_equal(grid[1:], np.broadcast_to(grid[0], (3, len(candidates.windows))))
    assert ExactSearch()(candidates).order == 1


def test_a_standstill_is_fitted_without_dividing_by_zero():
    candidates = Candidates(np.zeros(100), np.zeros(100), **WINDOWS)
    assert not candidates.grid().any()
    assert ExactSearch()(candidates).fitness == 0.0
    assert SwarmSearch()(candidates).fitness == 0.0


def test_the_swarm_remembers_its_optima():
    search = search_named("swarm", seed=0, **WINDOWS)
    choice = search(Candidates(*thruster(1), **WINDOWS))
    assert search.memory[-1] == (choice.order, choice.window)
    assert (3.0, 120.0) in search.memory  # prior knowledge


@pytest.mark.parametrize(
    ("arguments", "names"),
    [
        ({"order_max": 0}, "order_max = 0"),
        ({"window_min": 1}, "window_min = 1"),
        ({"window_max": 20}, "window_max = 20"),
        ({"window_min": 100, "window_max": 300}, "at least window_min = 100"),
    ],
)
def test_refuses(arguments, names):
    command, speed = thruster(0, 90)
    with pytest.raises(ValueError, match=names):
        Candidates(command, speed, **(WINDOWS | arguments))


def test_refuses_an_unknown_search():
    with pytest.raises(ValueError, match="'exact' or 'swarm'"):
        search_named("best", **WINDOWS)
