"""The speed at each level, with the current taken out, is right within what the fit says of its error."""

from dataclasses import replace

import numpy as np
import pytest

from detectors.speed.tests.dives import Dive, circling, every, straight, zig_zag
from gateway.commissioning.speed_course import Course, Levels, Track
from gateway.commissioning.speed_fit import fit_speed


def levels_of_thrust(t):
    return (0.25, 0.5, 0.8)[int(t // 100) % 3]


def fitted(*dives, seconds=300.0, interval_s=0.5, change=lambda poses: poses):
    tracks = [Track.of(change(dive.poses(every(interval_s, seconds), seed))) for seed, dive in enumerate(dives)]
    levels = Levels.driven(tracks)
    return fit_speed([Course.of(track, levels) for track in tracks], levels, 0.5)


def test_speeds_and_the_hulls_lag_are_found_in_a_current():
    fit = fitted(Dive(heading=zig_zag(), command=levels_of_thrust, surge_s=2.5, speed_mps=1.4))
    assert fit.speed_mps == pytest.approx((0.35, 0.7, 1.12), rel=0.05)
    assert fit.surge_time_s == 2.5
    assert (np.abs(fit.speed_mps - (0.35, 0.7, 1.12)) < 3.0 * fit.error_mps).all()


def test_on_a_straight_course_it_knows_that_it_does_not_know():
    fit = fitted(Dive(heading=straight(), command=levels_of_thrust))
    assert (fit.error > 0.15).all()


def test_two_dives_in_opposite_directions_do_not_teach_what_one_cannot():
    """The current may be another one."""
    fit = fitted(Dive(heading=straight(0.4)), Dive(heading=straight(0.4 + np.pi)))
    assert (fit.error > 0.15).all()


def test_a_current_that_turns_is_no_speed():
    def tide(t):
        return 0.3 * np.cos(t / 150.0), 0.3 * np.sin(t / 150.0), 0.0

    fit = fitted(Dive(heading=circling(60.0), flow=tide))
    assert fit.speed_mps == pytest.approx((1.0,), rel=0.05)


def test_outliers_and_a_jump_of_the_track_cost_nothing():
    def wrong(poses):
        rng = np.random.default_rng(5)
        found = [replace(one, north_m=one.north_m + (500.0 if rng.random() < 0.01 else 0.0)) for one in poses]
        return [replace(one, east_m=one.east_m + (80.0 if one.time_s > 150.0 else 0.0)) for one in found]

    clean, fit = fitted(Dive(heading=zig_zag())), fitted(Dive(heading=zig_zag()), change=wrong)
    assert fit.speed_mps == pytest.approx(clean.speed_mps, rel=0.03)
    assert fit.refused > 0


def test_more_dives_are_surer_than_one():
    dive = Dive(heading=zig_zag(), noise_m=3.0)
    assert fitted(dive, dive, dive).error_mps[0] < fitted(dive).error_mps[0]


def test_nothing_driven_is_refused():
    nothing = Levels(np.empty(0), np.empty(0))
    with pytest.raises(ValueError, match="0 levels"):
        fit_speed([], nothing, 1.0)
