"""The search for delay and lag against brute force: every delay, at lags half a sample apart, solved exactly."""

import numpy as np
import pytest

from detectors.thruster.tests.simulation import Series, Thruster, cruising, working
from detectors.thruster.timing import TimingGrid
from detectors.thruster.window import RUN_IN, Prepared, Window, prepare

DELAY_MAX, LAG_MAX = 12, 12.0
NOISE = 0.003
COUNT = 1200


def window(series: Series, untrusted: slice | None = None) -> Prepared:
    count = len(series) - DELAY_MAX
    trusted, unmeasured = np.ones(count, dtype=bool), np.full(count, np.nan)
    if untrusted is not None:
        trusted[untrusted] = False
    data = prepare(
        Window(series.command, series.speed_rpm[DELAY_MAX:], trusted, unmeasured, unmeasured), 5, usable_min=100
    )
    assert data is not None
    return data


def misfit(data: Prepared, delay: int, lag: float) -> float:
    """By plain least squares, with the prior as further equations."""
    usable = data.usable.copy()
    usable[:RUN_IN] = False
    for longest in range(1, data.lead + 1):  # samples that every delay can use
        usable[: len(usable) - longest] &= data.usable[longest:]
    rows = np.flatnonzero(usable[: len(usable) - data.lead]) + delay
    design = np.vstack([data.lagged(delay, lag)[:, rows].T / NOISE, np.diag(1.0 / data.basis.prior_deviation)])
    speed = np.concatenate([data.speed[rows] / NOISE, np.zeros(data.basis.size)])
    left = speed - design @ np.linalg.lstsq(design, speed, rcond=None)[0]
    return float(left @ left)


def brute_force(data: Prepared) -> float:
    lags = np.arange(0.0, LAG_MAX, 0.5)
    return min(misfit(data, delay, float(lag)) for delay in range(DELAY_MAX + 1) for lag in lags)


def search(data: Prepared, lag: float | None = None):
    return TimingGrid(data, LAG_MAX, lag).search(np.ones_like(data.speed), NOISE)


CASES = {
    "no lag": (Thruster(delay=0, lag=0.0), cruising(COUNT, 1)),
    "short lag": (Thruster(delay=3, lag=0.6), cruising(COUNT, 2)),
    "long lag": (Thruster(delay=7, lag=6.0), cruising(COUNT, 3)),
    "both ways": (Thruster(delay=2, lag=2.5, dead_band=0.05), working(COUNT, 4)),
    "no sign": (Thruster(delay=4, lag=1.5, signed=False), working(COUNT, 5)),
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("expected_lag", [None, 0.0, 11.0])
def test_finds_the_least_misfit_wherever_it_begins(case, expected_lag):
    thruster, command = CASES[case]
    data = window(thruster.simulate(command, seed=1))
    found = search(data, expected_lag)
    assert found.delay + found.lag == pytest.approx(thruster.delay + thruster.lag, abs=0.2)
    assert misfit(data, found.delay, found.lag) <= brute_force(data) + 0.5


def test_leaves_out_what_is_not_trusted():
    series = Thruster(delay=3, lag=2.5).simulate(cruising(COUNT, 6), seed=6)
    wild = series.spoiled(slice(500, 560), speed_rpm=123.0)
    found, clean = search(window(wild, slice(488, 548))), search(window(series))
    assert (found.delay, clean.delay) == (3, 3)
    assert found.lag == pytest.approx(clean.lag, abs=0.1)


def test_where_timing_shows_nothing_else_is_plausible():
    assert search(window(Thruster().simulate(cruising(COUNT, 7)))).plausible(9.0) == ()


def test_where_timing_hardly_shows_the_plausible_ones_reach_far():
    """A command that creeps along: each sample of delay is as good as one of lag."""
    creeping = 0.5 + 0.3 * np.sin(np.arange(COUNT) / 150.0)
    data = window(Thruster(delay=3, lag=2.5).simulate(creeping, seed=2))
    found = search(data)
    others = found.plausible(9.0)
    assert {0, DELAY_MAX} & {other.delay for other in others}
    best = misfit(data, found.delay, found.lag)
    for other in others:
        assert misfit(data, other.delay, other.lag) <= best + 12.0
        speed = other.coefficients @ data.lagged(other.delay, other.lag)
        assert np.std((speed - data.speed)[RUN_IN:]) < 2.0 * NOISE
