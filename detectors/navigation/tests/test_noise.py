import numpy as np
import pytest

from detectors.navigation.noise import LEAST, MOST, NoiseLevel

EXPECTED = np.array([0.02, 0.02, 0.02])


def learnt(deviation, count=1000, *, seed=0, added=lambda number: 0.0):
    level = NoiseLevel(EXPECTED)
    rng = np.random.default_rng(seed)
    for number in range(count):
        level.learn(deviation * rng.normal(size=3) + added(number))
    return level


def test_begins_with_the_first_guess():
    np.testing.assert_array_equal(NoiseLevel(EXPECTED).deviation, EXPECTED)


def test_learns_what_each_component_scatters_by():
    truth = np.array([0.01, 0.02, 0.05])
    mean = np.mean([learnt(truth, seed=seed).deviation ** 2 for seed in range(20)], axis=0)
    np.testing.assert_allclose(np.sqrt(mean), truth, rtol=0.05)


def test_an_offset_and_a_slow_wave_are_no_noise():
    plain = learnt(0.02)
    np.testing.assert_allclose(learnt(0.02, added=lambda number: 5.0).deviation, plain.deviation, rtol=1e-9)
    waved = learnt(0.02, added=lambda number: 0.1 * np.sin(0.01 * number))
    np.testing.assert_allclose(waved.deviation, plain.deviation, rtol=0.02)


def test_is_deaf_to_outliers():
    spoilt = learnt(0.02, added=lambda number: 10.0 if number % 50 == 49 else 0.0)
    assert (spoilt.deviation < 1.25 * learnt(0.02).deviation).all()


@pytest.mark.parametrize(("deviation", "share"), [(1e-6, LEAST), (10.0, MOST)])
def test_stays_within_some_times_the_guess(deviation, share):
    np.testing.assert_allclose(learnt(deviation, 3000).deviation, share * EXPECTED)


def test_what_came_before_a_break_does_not_count():
    rng = np.random.default_rng(1)
    innovations = 0.02 * rng.normal(size=(400, 3)) + np.repeat([[0.0], [3.0]], 200, axis=0)
    broken, whole = NoiseLevel(EXPECTED), NoiseLevel(EXPECTED)
    for number, innovation in enumerate(innovations):
        if number == 200:
            broken.forget_last()
        for level in (broken, whole):
            level.learn(innovation)
        if number == 200:
            assert (whole.deviation > 1.01 * broken.deviation).all()
