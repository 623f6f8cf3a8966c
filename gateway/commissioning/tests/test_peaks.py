"""The tail of peaks foretells how often a threshold will be exceeded, and says how sure that is."""

import numpy as np
import pytest

from gateway.commissioning.peaks import BLOCK_S, Tail, block_maxima, counted, tail

BLOCKS_PER_HOUR = 3600.0 / BLOCK_S


def exponential(blocks, seed):
    """Peaks of which, of all blocks, a share of exp(-(x - 0.5) / 0.1) exceed x > 0.5."""
    return 0.5 + np.random.default_rng(seed).exponential(0.1, blocks)


def truth(threshold):
    return BLOCKS_PER_HOUR * np.exp(-(threshold - 0.5) / 0.1)


def test_none_in_some_hours_is_below_three_an_hour_over_them():
    found = counted(0, 10.0)
    assert found.per_hour == 0.0
    assert found.bound_per_hour == pytest.approx(0.3, rel=0.01)


def test_the_bound_of_a_count_is_that_of_the_poisson_distribution():
    bound = counted(4, 1.0).bound_per_hour
    below = sum(np.exp(-bound) * bound**k / np.prod(range(1, k + 1)) for k in range(5))
    assert below == pytest.approx(0.05, rel=1e-6)
    with pytest.raises(ValueError, match=r"hours = 0\.0: want more than none"):
        counted(1, 0.0)


def test_a_rate_is_foretold_within_its_bound():
    thresholds, bounded = [], 0
    for seed in range(200):
        fitted = tail(exponential(200, seed))
        thresholds.append(fitted.threshold(0.1))
        bounded += fitted.rate(1.2).bound_per_hour > truth(1.2)
    assert np.log(truth(np.median(thresholds))) == pytest.approx(np.log(0.1), abs=0.7)
    assert bounded >= 190


def test_the_threshold_has_the_rate():
    fitted = tail(exponential(300, 4))
    assert fitted.rate(fitted.threshold(0.1)).per_hour == pytest.approx(0.1)
    assert fitted.rate(fitted.sure_threshold(0.1)).bound_per_hour == pytest.approx(0.1)
    assert fitted.sure_threshold(0.1) > fitted.threshold(0.1) > fitted.threshold(1.0)


def test_more_data_makes_surer():
    some, more = tail(exponential(60, 3)), tail(exponential(6000, 3))
    assert some.sure_threshold(0.1) - some.threshold(0.1) > 5.0 * (more.sure_threshold(0.1) - more.threshold(0.1))


def test_a_heavier_tail_is_seen_and_asks_for_more():
    heavy = 0.5 + 0.1 * np.random.default_rng(1).pareto(3.0, 2000)
    fitted = tail(heavy)
    assert fitted.shape > 0.1
    light = Tail(fitted.base, fitted.blocks, fitted.over, fitted.scale)
    assert fitted.threshold(0.1) > 1.5 * light.threshold(0.1)
    assert fitted.rate(fitted.threshold(0.1)).per_hour == pytest.approx(0.1)


def test_an_exponential_tail_is_taken_for_one():
    assert sum(tail(exponential(200, seed)).shape > 0.0 for seed in range(100)) < 10


@pytest.mark.parametrize("peaks", [[], [0.5] * 20, np.full(200, 0.7)])
def test_too_few_peaks_or_equal_ones_have_no_tail(peaks):
    assert tail(peaks) is None


def test_a_rate_is_positive():
    with pytest.raises(ValueError, match=r"per_hour = 0\.0: want a rate above 0"):
        tail(exponential(100, 1)).threshold(0.0)


def test_each_block_of_time_has_its_greatest():
    numbers, greatest = block_maxima(np.array([0.0, 9.9, 10.0, 35.0, 31.0]), np.array([1.0, 3.0, 2.0, 5.0, 4.0]))
    assert numbers.tolist() == [0.0, 1.0, 3.0]
    assert greatest.tolist() == [3.0, 2.0, 5.0]
