import pickle
from math import exp, inf, nan

import numpy as np
import pytest

from detectors.thruster.swarm import Dimension, MultiCentreSwarm, choose_centres, improved_tent_sequence, tent

SQUARE = (Dimension(-5.0, 5.0), Dimension(-5.0, 5.0))


def bowl(position):
    x, y = position
    return (x - 1.5) ** 2 + (y + 2.0) ** 2 + 0.01


def narrow_and_wide(position):
    """A wide valley of depth 0.8 at (2, 2), a narrow one of depth 1.0 far from it."""
    x, y = position
    wide = 0.8 * exp(-((x - 2) ** 2 + (y - 2) ** 2) / 2)
    return 1.05 - wide - exp(-((x + 3) ** 2 + (y + 3) ** 2) / 0.3)


def occupied_cells(points, cells=6):
    return len({tuple(cell) for cell in np.minimum((points * cells).astype(int), cells - 1)})


def test_tent_map_equation_8():
    np.testing.assert_allclose(tent(np.array([0.0, 0.2, 0.5, 0.7, 1.0])), [0.0, 0.4, 1.0, 0.6, 0.0])


def test_improved_tent_map_spreads_where_the_plain_one_is_stuck():
    """Figure 2: 60 points from (0.833333, 0.666667), both coordinates next to the fixed point 2/3."""
    start = np.array([0.833333, 0.666667])
    plain = [start]
    for _ in range(60):
        plain.append(tent(plain[-1]))
    for seed in range(20):
        ours = improved_tent_sequence(start, 60, np.random.default_rng(seed))
        assert ours.shape == (60, 2)
        assert ((ours >= 0.0) & (ours <= 1.0)).all()
        assert occupied_cells(ours) > occupied_cells(np.array(plain[1:]))


@pytest.mark.parametrize("start", [0.0, 0.5, 2 / 3, 1.0, 0.4, 2 / 7])  # fixed points, and periods of 2 and 3
def test_improved_tent_map_leaves_fixed_points_and_short_periods(start):
    points = improved_tent_sequence(np.array([start]), 400, np.random.default_rng(1))[:, 0]
    counts, _ = np.histogram(points, bins=10, range=(0.0, 1.0))
    assert counts.min() > 10
    assert np.mean(np.abs(np.diff(points)) <= 0.02) < 0.02  # equation 9, but for draws that are small themselves


def test_centres_are_the_best_and_the_far_ones_of_the_better_half():
    best = np.array(
        [[0.5, 0.5], [0.52, 0.5], [0.9, 0.9], [0.1, 0.5], [0.5, 0.55], [0.5, 0.51], [0.0, 0.0], [1.0, 0.0]]
    )
    fitness = np.array([1.0, 1.1, 2.0, 1.5, 1.05, 5.0, 6.0, 7.0])  # the better half: 0, 4, 1, 3
    # d / f: 3 -> 0.4 / 1.5, 4 -> 0.05 / 1.05, 1 -> 0.02 / 1.1
    np.testing.assert_array_equal(choose_centres(best, fitness, 2), [0, 3, 4])


@pytest.mark.parametrize("factors", [{}, {"inertia": 0.6, "attraction": 2.0}])  # the second: paper 003, section 5.2
def test_finds_the_optimum_of_a_bowl(factors):
    optimum = MultiCentreSwarm(seed=1, **factors).minimise(bowl, SQUARE)
    np.testing.assert_allclose(optimum.position, [1.5, -2.0], atol=0.05)
    assert optimum.fitness == bowl(optimum.position)


def test_more_centres_find_a_narrow_optimum_far_from_a_wide_one_more_often():
    def hits(centres):
        swarms = (MultiCentreSwarm(iterations=15, auxiliary_centres=centres, seed=seed) for seed in range(200))
        return sum(swarm.minimise(narrow_and_wide, SQUARE).fitness < 0.2 for swarm in swarms)

    assert hits(2) > 1.25 * hits(0)


def test_memory_of_optima_helps_with_the_next_problem():
    def moved(position):
        return narrow_and_wide((position[0] + 0.1, position[1] - 0.1))

    def hits(prior):
        swarms = (MultiCentreSwarm(prior, iterations=8, seed=seed) for seed in range(40))
        return sum(swarm.minimise(moved, SQUARE).fitness < 0.2 for swarm in swarms)

    assert hits([(-3.0, -3.0)]) >= 38
    assert hits([]) < 25


def test_remembers_the_latest_distinct_optima():
    swarm = MultiCentreSwarm([(9.0, 9.0), (1.0, 1.0)], memory=2)
    swarm.remember((1, 1))
    assert swarm.memory == ((9.0, 9.0), (1.0, 1.0))
    optimum = swarm.minimise(bowl, SQUARE)
    assert swarm.memory == ((1.0, 1.0), optimum.position)


def test_whole_numbers_each_position_once_and_within_bounds():
    seen = []

    def fitness(position):
        seen.append(position)
        return abs(position[0] - 3) + abs(position[1] - 77) / 100 + 0.1

    optimum = MultiCentreSwarm(seed=4).minimise(
        fitness, (Dimension(1, 5, integer=True), Dimension(50, 500, integer=True))
    )
    assert len(seen) == len(set(seen)) == optimum.evaluations
    assert all(q == int(q) and w == int(w) and 1 <= q <= 5 and 50 <= w <= 500 for q, w in seen)
    assert optimum.position == (3.0, 77.0)


def test_a_dimension_of_one_value_and_an_optimum_on_the_border():
    optimum = MultiCentreSwarm(seed=2).minimise(lambda p: p[1], (Dimension(4, 4, integer=True), Dimension(0.0, 1.0)))
    assert optimum.position == (4.0, 0.0)
    assert optimum.fitness == 0.0


@pytest.mark.parametrize("bad", [nan, inf])
def test_positions_that_cannot_be_judged_are_avoided(bad):
    optimum = MultiCentreSwarm(seed=3).minimise(lambda p: bad if p[0] < 0.0 else bowl(p), SQUARE)
    assert optimum.position[0] >= 0.0
    assert optimum.fitness < 0.05


def test_all_positions_impossible():
    assert MultiCentreSwarm(iterations=3).minimise(lambda _: inf, SQUARE).fitness == inf


def test_more_than_two_dimensions():
    def fitness(position):
        return sum((x - 0.3) ** 2 for x in position) + 0.01

    optimum = MultiCentreSwarm(iterations=60, seed=0).minimise(fitness, [Dimension(0.0, 1.0)] * 5)
    np.testing.assert_allclose(optimum.position, 0.3, atol=0.05)


def test_pickled_between_searches_it_goes_on_bit_for_bit():
    swarm = MultiCentreSwarm(seed=8)
    swarm.minimise(bowl, SQUARE)
    copy = pickle.loads(pickle.dumps(swarm))  # noqa: S301
    assert copy.minimise(narrow_and_wide, SQUARE) == swarm.minimise(narrow_and_wide, SQUARE)


@pytest.mark.parametrize(
    ("arguments", "names"),
    [
        ({"auxiliary_centres": 10}, "auxiliary_centres = 10"),
        ({"memory": 20}, "memory = 20"),
        ({"iterations": 0}, "iterations = 0"),
        ({"inertia": 1.0}, r"inertia = 1\.0, attraction"),
        ({"attraction": 0.0}, r"attraction = 0\.0: want"),
    ],
)
def test_refuses_sizes(arguments, names):
    with pytest.raises(ValueError, match=names):
        MultiCentreSwarm(**arguments)


def test_refuses_a_negative_fitness_and_positions_of_another_dimension():
    with pytest.raises(ValueError, match="fitness -1"):
        MultiCentreSwarm().minimise(lambda _: -1.0, SQUARE)
    with pytest.raises(ValueError, match="2 dimensions"):
        MultiCentreSwarm([(1.0,)]).minimise(bowl, SQUARE)
    with pytest.raises(ValueError, match="low <= high"):
        Dimension(2.0, 1.0)
    with pytest.raises(ValueError, match="at least one"):
        MultiCentreSwarm().minimise(bowl, ())
