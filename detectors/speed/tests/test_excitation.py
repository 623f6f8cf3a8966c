from math import cos, inf, sin

import numpy as np
import pytest

from detectors.speed.excitation import MEMORY_S, Excitation


def driven(headings, *, interval_s=0.2, dimensions=2, share=lambda t: 1.0):
    excitation = Excitation(dimensions)
    for number, heading in enumerate(headings):
        way = np.zeros(dimensions)
        way[:2] = cos(heading), sin(heading)
        excitation.take(interval_s * share(interval_s * number) * way, interval_s)
    return excitation


def legs(half_rad, *, count=1500, leg=50):
    return [half_rad if number // leg % 2 else -half_rad for number in range(count)]


def test_a_straight_course_has_none():
    straight = driven([0.7] * 1500)
    assert straight.spread == pytest.approx(0.0, abs=1e-9)
    assert straight.error == inf


def test_nothing_driven_has_none():
    assert Excitation(2).spread == 0.0
    assert Excitation(2).error == inf
    assert driven([0.3] * 50, share=lambda t: 0.0).spread == 0.0


def test_in_circles_it_is_one():
    circles = driven(np.arange(3000) * 2.0 * np.pi / 30.0)
    assert circles.spread == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("half_rad", [0.05, 0.2, 0.7, 1.5])
def test_legs_to_both_sides_have_the_square_of_the_sine(half_rad):
    assert driven(legs(half_rad)).spread == pytest.approx(sin(half_rad) ** 2, rel=0.1)


def test_the_wider_the_turns_the_smaller_the_error():
    errors = [driven(legs(half_rad)).error for half_rad in (0.05, 0.2, 0.7, 1.5)]
    assert errors == sorted(errors, reverse=True)


@pytest.mark.parametrize("interval_s", [0.02, 0.2, 2.0])
def test_the_rate_of_positions_does_not_matter(interval_s):
    count = round(200.0 / interval_s)
    often = driven(legs(0.6, count=count, leg=round(10.0 / interval_s)), interval_s=interval_s)
    assert often.spread == pytest.approx(sin(0.6) ** 2, rel=0.15)


def test_a_turn_is_forgotten_on_a_long_leg():
    excitation, spreads = driven(legs(0.7)), []
    for _ in range(round(5.0 * MEMORY_S / 0.2)):
        excitation.take(np.array([0.2, 0.0]), 0.2)
        spreads.append(excitation.spread)
    assert spreads == sorted(spreads, reverse=True)
    assert spreads[-1] < 0.02


def test_ways_ahead_and_astern_tell_speed_from_flow_too():
    changing = driven([0.7] * 1500, share=lambda t: 1.0 if t % 20.0 < 10.0 else -1.0)
    assert changing.spread > 0.9


def test_a_glider_that_dives_and_climbs_is_excited_in_three_dimensions():
    excitation = Excitation(3)
    for number in range(1500):
        down = 0.5 if number // 50 % 2 else -0.5
        excitation.take(0.2 * np.array([cos(down), 0.0, sin(down)]), 0.2)
    assert excitation.spread == pytest.approx(sin(0.5) ** 2, rel=0.1)
