"""White noise is found by its density, also where the vehicle moves and the unit filters what it says."""

import numpy as np
import pytest

from gateway.commissioning.inertial_noise import WINDOW_S, allan_curve

DENSITY = 1.5e-3


def noise(rate_hz, seconds=200.0, seed=0):
    rng = np.random.default_rng(seed)
    time_s = np.arange(int(seconds * rate_hz)) / rate_hz
    return time_s, DENSITY * np.sqrt(rate_hz) * rng.normal(size=(len(time_s), 3))


@pytest.mark.parametrize("rate_hz", [10.0, 50.0, 200.0])
def test_white_noise_is_found_whatever_the_rate(rate_hz):
    curve = allan_curve(*noise(rate_hz))
    assert curve.white == pytest.approx(DENSITY, rel=0.35)
    assert curve.windows == 10 and curve.level


def test_a_vehicle_that_turns_and_rolls_most_of_the_time_does_not_hide_it():
    time_s, values = noise(50.0)
    moving = (time_s > 60.0)[:, None] * np.sin(1.3 * time_s)[:, None]
    assert allan_curve(time_s, values + moving).white == pytest.approx(DENSITY, rel=0.3)


def test_a_filter_in_the_unit_does_not_make_it_better():
    time_s, values = noise(100.0)
    filtered = np.column_stack([np.convolve(column, np.ones(4) / 4.0, mode="same") for column in values.T])
    assert allan_curve(time_s, filtered).white == pytest.approx(DENSITY, rel=0.5)


def test_gaps_part_windows():
    time_s, values = noise(50.0, 100.0)
    torn = time_s + 5.0 * (np.arange(len(time_s)) > 1500)
    assert allan_curve(torn, values).windows == 4


@pytest.mark.parametrize("seconds", [0.0, 0.5 * WINDOW_S])
def test_too_short_says_nothing(seconds):
    assert allan_curve(*noise(50.0, seconds)) is None


def test_where_the_vehicle_never_holds_still_it_is_a_bound():
    time_s, values = noise(25.0)
    curve = allan_curve(time_s, values + np.sin(3.0 * time_s)[:, None])
    assert not curve.level
    assert (curve.white > DENSITY).all()
