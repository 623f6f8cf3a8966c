"""Hours of samples are reduced to what can be seen: no peak is lost, and it does not matter how they came."""

from __future__ import annotations

import numpy as np
import pytest

from gateway.report.thinning import Thinning

NAMES = ("residual", "command", "score")
PEAKS = ("residual", "score")
RATE_HZ = 50.0


def samples(seconds: float, seed: int = 1) -> np.ndarray:
    """(N, 4) time, residual, command, score of a noisy thruster."""
    chance = np.random.default_rng(seed)
    time_s = 1.7e9 + np.arange(int(seconds * RATE_HZ)) / RATE_HZ
    residual = chance.normal(0.0, 10.0, len(time_s))
    return np.column_stack([time_s, residual, np.sin(time_s / 30.0), np.abs(residual) / 100.0])


def thinned(rows: np.ndarray, cuts: list[int], samples_max: int = 2000, gap_s: float = 1.0) -> Thinning:
    thinning = Thinning(NAMES, PEAKS, gap_s, samples_max)
    for part in np.split(rows, cuts):
        thinning.extend(*part.T)
    return thinning


def kept(thinning: Thinning) -> np.ndarray:
    time_s, values = thinning.columns()
    return np.column_stack([time_s, *(values[name] for name in NAMES)])


def test_what_is_little_stays_as_it_is() -> None:
    rows = samples(20.0)
    np.testing.assert_array_equal(kept(thinned(rows, [], samples_max=1000)), rows)


def test_no_peak_is_lost_however_short() -> None:
    rows = samples(2000.0)
    for place, value in ((12_345, 900.0), (67_890, -800.0), (99_999, 700.0)):
        rows[place, 1] = value
    rows[50_001, 3] = 42.0
    found = kept(thinned(rows, list(range(1000, len(rows), 1000))))
    assert len(found) < 3000
    for place in (12_345, 67_890, 99_999, 50_001):
        assert (found == rows[place]).all(axis=1).any()  # the whole sample, not only the peak


def test_kept_samples_are_samples_in_their_order() -> None:
    rows = samples(1000.0)
    found = kept(thinned(rows, []))
    assert (np.diff(found[:, 0]) > 0.0).all()
    assert set(map(tuple, found)) <= set(map(tuple, rows))
    assert (found[0] == rows[0]).all()
    assert (found[-1] == rows[-1]).all()


@pytest.mark.parametrize("seed", range(4))
def test_it_does_not_matter_how_they_are_cut(seed: int) -> None:
    rows = samples(400.0, seed)
    rows[3000:3500, 1] = np.nan
    rows = np.delete(rows, slice(9000, 9500), axis=0)
    cuts = sorted(np.random.default_rng(seed).choice(len(rows), 25, replace=False).tolist())
    np.testing.assert_array_equal(kept(thinned(rows, cuts)), kept(thinned(rows, [])))


def test_samples_that_come_alone_are_as_those_of_a_block() -> None:
    rows = samples(100.0)
    alone = Thinning(NAMES, PEAKS, 1.0, 500)
    for row in rows:
        alone.append(*row)
    np.testing.assert_array_equal(kept(alone), kept(thinned(rows, [], 500)))


def test_ten_hours_stay_small_and_the_shape_stays() -> None:
    rows = samples(36_000.0)
    thinning = thinned(rows, list(range(100_000, len(rows), 100_000)), samples_max=8000)
    found = kept(thinning)
    assert 2000 < len(found) <= 8100
    assert np.diff(found[:, 0]).max() < 60.0
    assert found[:, 1].max() == rows[:, 1].max()
    assert found[:, 1].min() == rows[:, 1].min()


def test_a_line_breaks_where_nothing_came() -> None:
    rows = samples(60.0)
    rows = np.delete(rows, slice(1000, 1100), axis=0)
    for cuts in ([], [1000]):  # inside of a block, and between two
        time_s, values = thinned(rows, cuts, samples_max=5000).columns()
        (gap,) = np.flatnonzero(np.isnan(values["command"]))
        assert rows[999, 0] < time_s[gap] < rows[1000, 0]


def test_a_gap_in_one_value_stays_one_when_it_is_coarse() -> None:
    rows = samples(2000.0)
    rows[30_000:40_000, 1] = np.nan
    found = kept(thinned(rows, [], samples_max=500))
    inside = (found[:, 0] > rows[30_000, 0]) & (found[:, 0] < rows[39_999, 0])
    assert np.isnan(found[inside, 1]).any()
    assert np.isfinite(found[~inside, 1]).any()


def test_what_is_not_later_is_left_out() -> None:
    rows = samples(1.0)
    wrong = np.concatenate([rows, rows[:10], [[np.nan, 1.0, 1.0, 1.0]], rows[-1:]])
    np.testing.assert_array_equal(kept(thinned(wrong, [])), rows)


def test_nothing_gives_nothing() -> None:
    time_s, values = Thinning(NAMES, PEAKS, 1.0).columns()
    assert len(time_s) == len(values["score"]) == 0


def test_a_peak_of_what_is_not_there_is_refused() -> None:
    with pytest.raises(ValueError, match="residuum"):
        Thinning(NAMES, ("residuum",), 1.0)
