from dataclasses import replace
from itertools import pairwise
from math import cos, pi, sin, tau

import numpy as np
import pytest

from detectors.speed.sample import PoseSample
from detectors.speed.way import Way


def pose(time_s, heading_rad, **others):
    return PoseSample(time_s, 0.0, 0.0, heading_rad, **others)


def followed(samples, share=lambda t: 1.0, *, dimensions=2, surge_time_s=1.0):
    """The way from the first sample to the last."""
    way = Way(dimensions, surge_time_s)
    way.begin(samples[0], share(samples[0].time_s))
    for before, sample in pairwise(samples):
        way.extend(sample, share(before.time_s))
    return way


def integral(of, seconds, pieces=20000):
    """Midpoint rule."""
    h = seconds / pieces
    return sum(np.array(of((k + 0.5) * h)) for k in range(pieces)) * h


@pytest.mark.parametrize("rate", [0.0, 1e-9, 0.3, -1.2, 3.0])
@pytest.mark.parametrize("interval_s", [0.02, 1.0])
def test_a_steady_turn_is_an_arc_however_seldom_it_is_sampled(rate, interval_s):
    way = followed([pose(interval_s * k, 0.4 + rate * interval_s * k) for k in range(3)])
    bow = integral(lambda t: (cos(0.4 + rate * t), sin(0.4 + rate * t)), 2.0 * interval_s)
    np.testing.assert_allclose(way.ahead_s, bow, atol=1e-7)
    slip = integral(lambda t: (-rate * sin(0.4 + rate * t), rate * cos(0.4 + rate * t)), 2.0 * interval_s)
    np.testing.assert_allclose(way.turned, slip, atol=1e-7)


def test_across_north_it_turns_the_shorter_way_and_whole_turns_do_not_matter():
    across = followed([pose(0.0, np.radians(350.0)), pose(1.0, np.radians(10.0))])
    assert across.ahead_s[0] > 0.99
    np.testing.assert_allclose(across.ahead_s[1], 0.0, atol=1e-12)
    turned = followed([pose(0.0, np.radians(350.0) + 3.0 * tau), pose(1.0, np.radians(10.0) - 5.0 * tau)])
    np.testing.assert_allclose(turned.ahead_s, across.ahead_s, atol=1e-12)
    np.testing.assert_allclose(turned.turned, across.turned, atol=1e-12)


def test_a_nose_that_is_down_goes_down_and_less_ahead():
    samples = [pose(k * 0.5, 0.7, pitch_rad=-0.5) for k in range(5)]
    down = followed(samples, dimensions=3)
    np.testing.assert_allclose(down.ahead_s, 2.0 * np.array([cos(0.7) * cos(0.5), sin(0.7) * cos(0.5), sin(0.5)]))
    np.testing.assert_allclose(followed(samples).ahead_s, down.ahead_s[:2])


def test_pitch_that_changes_is_taken_at_its_middle():
    samples = [pose(0.1 * k, 0.0, pitch_rad=0.3 * sin(0.1 * k)) for k in range(51)]
    way = followed(samples, dimensions=3)
    expected = integral(lambda t: (cos(0.3 * sin(t)), 0.0, -sin(0.3 * sin(t))), 5.0)
    np.testing.assert_allclose(way.ahead_s, expected, atol=2e-3)


@pytest.mark.parametrize("interval_s", [0.1, 0.5, 4.0])
def test_the_share_of_the_speed_follows_the_command_as_a_lag(interval_s):
    """From rest to full, on a straight course: 1 - exp(-t / 2 s), at any sampling."""
    samples = [pose(interval_s * k, 0.0) for k in range(round(8.0 / interval_s) + 1)]
    way = Way(2, surge_time_s=2.0)
    way.begin(samples[0], 0.0)
    for sample in samples[1:]:
        way.extend(sample, 1.0)
    assert way.share == pytest.approx(1.0 - np.exp(-4.0), rel=1e-9)
    assert way.ahead_s[0] == pytest.approx(8.0 - 2.0 * (1.0 - np.exp(-4.0)), rel=1e-9)


def test_astern_it_goes_the_other_way():
    samples = [pose(0.5 * k, 0.6) for k in range(9)]
    way = followed(samples, lambda t: -0.5)
    np.testing.assert_allclose(way.ahead_s, -0.5 * 4.0 * np.array([cos(0.6), sin(0.6)]))


def test_thrust_to_the_right_goes_to_the_right():
    samples = [pose(0.1 * k, pi / 2.0, sideways=0.4) for k in range(41)]
    way = followed(samples)
    np.testing.assert_allclose(way.aside_s, [-0.4 * 4.0, 0.0], atol=1e-9)  # heading east, right is south


def test_turning_and_speeding_up_at_once():
    def share(t):
        return 1.0 - np.exp(-t)

    samples = [pose(0.05 * k, 0.5 * 0.05 * k) for k in range(121)]
    way = Way(2, surge_time_s=1.0)
    way.begin(samples[0], 0.0)
    for sample in samples[1:]:
        way.extend(sample, 1.0)
    expected = integral(lambda t: (share(t) * cos(0.5 * t), share(t) * sin(0.5 * t)), 6.0)
    np.testing.assert_allclose(way.ahead_s, expected, atol=1e-3)


def test_restarted_it_counts_from_there_and_keeps_the_speed_it_has():
    samples = [pose(0.5 * k, 0.1 * k) for k in range(9)]
    whole = followed(samples, lambda t: 0.7)
    way = Way(2, 1.0)
    way.begin(samples[0], 0.7)
    parts = []
    for sample in samples[1:]:
        way.extend(sample, 0.7)
        parts.append(way.ahead_s)
        way.restart()
    np.testing.assert_allclose(sum(parts), whole.ahead_s)
    assert way.share == pytest.approx(0.7)


def test_what_it_gave_before_stays_as_it_was():
    """Steps hold its arrays: a later sample must not change them."""
    samples = [pose(0.5 * k, 0.1 * k) for k in range(4)]
    way = Way(2, 1.0)
    way.begin(samples[0], 1.0)
    way.extend(samples[1], 1.0)
    given, copy = way.ahead_s, way.ahead_s.copy()
    way.extend(samples[2], 1.0)
    way.restart()
    way.extend(replace(samples[3], time_s=9.0), 1.0)
    np.testing.assert_array_equal(given, copy)


def test_the_first_sample_of_all_is_a_beginning():
    way = Way(3, 1.0)
    way.extend(pose(5.0, 1.0), 0.5)
    np.testing.assert_array_equal(way.ahead_s, np.zeros(3))
    assert way.share == 0.5
