"""What the autopilot and an acoustic system know of the vehicle's place: as wrong as asked for."""

from __future__ import annotations

from dataclasses import replace
from math import radians

import numpy as np
import pytest

from hil_tests.rig.acoustic import AcousticErrors, AcousticSystem
from hil_tests.rig.geodesy import place_m
from hil_tests.rig.navigation import EXACT, NavigationErrors, NavigationFilter, PositionReset
from hil_tests.rig.vehicle import Motion

MOTION = Motion(north_m=100.0, east_m=-50.0, down_m=7.0, yaw_rad=1.0, forward_mps=1.0, water_mps=(0.1, 0.2, 0.0))


def estimates(errors, count=4000, interval_s=0.05, seed=3) -> np.ndarray:
    navigation = NavigationFilter(errors, seed)
    rows = []
    for index in range(count):
        navigation.advance(index * interval_s)
        seen = navigation.seen(MOTION)
        rows.append((seen.north_m - MOTION.north_m, seen.east_m - MOTION.east_m, seen.yaw_rad - MOTION.yaw_rad))
    return np.array(rows)


def test_without_errors_it_is_the_truth():
    navigation = NavigationFilter(EXACT, 1)
    navigation.advance(5.0)
    assert navigation.seen(MOTION) == MOTION


def test_white_noise_is_as_large_as_asked_for():
    off = estimates(NavigationErrors(white_m=0.5, wandering_m=0.0, heading_rad=radians(2.0)))
    assert off.std(axis=0) == pytest.approx([0.5, 0.5, radians(2.0)], rel=0.05)
    assert abs(np.corrcoef(off[1:, 0], off[:-1, 0])[0, 1]) < 0.05


def test_roll_and_pitch_are_as_unsure_as_asked_for():
    navigation = NavigationFilter(NavigationErrors(tilt_rad=radians(1.0)), seed=2)
    off = []
    for index in range(4000):
        navigation.advance(0.05 * index)
        seen = navigation.seen(replace(MOTION, roll_rad=0.1, pitch_rad=-0.2))
        off.append((seen.roll_rad - 0.1, seen.pitch_rad + 0.2))
    assert np.std(off, axis=0) == pytest.approx([radians(1.0)] * 2, rel=0.05)


@pytest.mark.parametrize("interval_s", [0.05, 2.0])
def test_the_wandering_part_keeps_its_pace_at_any_interval(interval_s):
    off = estimates(NavigationErrors(white_m=0.0, wandering_m=1.0, wandering_s=10.0), 20_000, interval_s)
    assert off[:, :2].std() == pytest.approx(1.0, rel=0.2)
    together = np.corrcoef(off[1:, 0], off[:-1, 0])[0, 1]
    assert together == pytest.approx(np.exp(-interval_s / 10.0), abs=0.03)


def test_a_reset_moves_the_position_for_good():
    reset = PositionReset(onset_s=1.0, north_m=5.0, east_m=-3.0)
    errors = NavigationErrors(white_m=0.0, wandering_m=0.0, heading_rad=0.0, resets=[reset])
    off = estimates(errors, count=40)
    assert np.array_equal(off[:20], np.zeros((20, 3)))
    assert off[20:] == pytest.approx(np.tile([5.0, -3.0, 0.0], (20, 1)))


def fixes(errors, seconds=2000, seed=5) -> np.ndarray:
    system = AcousticSystem(errors, seed)
    told = [system.due(0.1 * step, 1.7e9 + 0.1 * step, MOTION) for step in range(10 * seconds)]
    places_m = [place_m(radians(fix.lat * 1e-7), radians(fix.lon * 1e-7)) for fix in told if fix is not None]
    return np.array(places_m) - (MOTION.north_m, MOTION.east_m)


def test_acoustic_fixes_come_in_time_with_echoes_and_repeats():
    off = fixes(AcousticErrors(interval_s=0.5, noise_m=0.4, outlier_share=0.05, outlier_m=40.0, repeat_share=0.2))
    assert len(off) == 4000
    repeated = np.all(off[1:] == off[:-1], axis=1)
    assert repeated.mean() == pytest.approx(0.2, abs=0.03)
    fresh = off[1:][~repeated]
    far = np.hypot(*fresh.T) > 4.0
    assert far.mean() == pytest.approx(0.05, abs=0.015)
    assert fresh[~far].std() == pytest.approx(0.4, rel=0.1)


def test_a_fix_says_its_time_and_depth():
    fix = AcousticSystem(AcousticErrors(), 1).due(0.0, 1_700_000_000.0, MOTION)
    assert fix.alt == -7.0
    assert (fix.time_week, fix.time_week_ms) == (2288, 252_818_000)  # 14 November 2023, 22:13:20 UTC
    assert fix.horiz_accuracy == 0.5


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: NavigationErrors(white_m=-1.0), "white_m = -1.0: want a standard deviation"),
        (lambda: NavigationErrors(wandering_s=0.0), "wandering_s = 0.0: want seconds above 0"),
        (lambda: PositionReset(1.0, float("nan"), 0.0), "north_m = nan: want a finite number"),
        (lambda: AcousticErrors(interval_s=0.0), "interval_s = 0.0: want seconds above 0"),
        (lambda: AcousticErrors(outlier_m=-1.0), "outlier_m = -1.0"),
        (lambda: AcousticErrors(repeat_share=1.0), "repeat_share = 1.0: want a probability"),
    ],
)
def test_impossible_errors_are_refused(make, says):
    with pytest.raises(ValueError, match=says):
        make()
