"""Decimation for plots: peaks, gaps and ends are kept."""

from __future__ import annotations

import numpy as np
import pytest

from gateway.plotting.decimation import decimated


@pytest.mark.parametrize("count", [1001, 1500, 20_000, 100_003])
def test_no_peak_is_lost(count: int) -> None:
    rng = np.random.default_rng(count)
    value = rng.normal(size=count)
    apart = count // 20
    peaks = np.arange(20) * apart + rng.integers(0, apart // 2, size=20)
    value[peaks] += rng.choice([-50.0, 50.0], size=20)
    kept = decimated(value, 1000)
    assert set(peaks) <= set(kept)
    assert len(kept) <= 1000


def test_wherever_one_looks_the_extremes_are_there() -> None:
    rng = np.random.default_rng(0)
    value = np.cumsum(rng.normal(size=30_000))
    kept = decimated(value, 400)
    reach = 30_000 // 199 + 1  # the length of a piece
    for begin in range(0, 30_000, 97):
        seen = value[begin : begin + reach]
        drawn = value[kept[(kept > begin - reach) & (kept < begin + 2 * reach)]]
        assert drawn.min() <= seen.min() <= seen.max() <= drawn.max()


def test_order_and_ends() -> None:
    kept = decimated(np.arange(5000.0), 100)
    assert (np.diff(kept) > 0).all()
    assert (kept[0], kept[-1]) == (0, 4999)


def test_a_gap_stays_one() -> None:
    value = np.ones(10_000)
    value[5000] = np.nan
    kept = decimated(value, 100)
    assert 5000 in kept
    nothing = decimated(np.full(10_000, np.nan), 100)
    assert len(nothing) <= 103


@pytest.mark.parametrize("count", [0, 1, 99, 100])
def test_few_points_are_all_drawn(count: int) -> None:
    assert decimated(np.arange(float(count)), 100).tolist() == list(range(count))


def test_fewer_than_four_points_are_a_mistake() -> None:
    with pytest.raises(ValueError, match="points_max = 3: want 4 or more"):
        decimated(np.arange(10.0), 3)
