"""Speed and current enter a position linearly: the ways that belong to each level of thrust, and to nothing else."""

from math import pi

import numpy as np
import pytest

from detectors.speed import PoseSample, SpeedCurve
from detectors.speed.tests.dives import Dive, circling, every, irregular, step_at, straight
from gateway.commissioning.speed_course import BLOCK_S, SETTLING_S, SURGE_S, Course, Levels, Track

SPEEDS = {-0.6: -0.5, -0.3: -0.4, 0.2: 0.3, 0.5: 0.9, 0.8: 1.1}


def levels(*commands):
    return Levels(np.array(commands), np.full(len(commands), 60.0))


@pytest.mark.parametrize("commands", [(0.5,), (0.2, 0.5, 0.8), (-0.6, -0.3, 0.2, 0.5), (-0.6, -0.3)])
def test_between_levels_the_speed_is_that_of_the_detectors_curve(commands):
    asked = np.linspace(-1.0, 1.0, 81)
    speeds = np.array([SPEEDS[one] for one in commands])
    curve = SpeedCurve(commands, tuple(speeds.tolist()))
    expected = [curve.speed_mps(one) if one else 0.0 for one in asked.tolist()]
    assert levels(*commands).shares(asked) @ speeds == pytest.approx(expected, abs=1e-12)


def test_a_level_is_what_was_driven_for_a_while():
    def command(t):
        return 0.0 if t < 100 else 0.31 if t < 140 else -0.5 if t < 150 else 0.5 + 0.01 * np.sin(t)

    track = Track.of(Dive(heading=straight(), command=command).poses(every(0.5, 200)))
    driven = Levels.driven([track])
    assert driven.commands == pytest.approx((0.31, 0.5), abs=0.005)
    assert driven.seconds == pytest.approx((40.0, 50.0), abs=1.0)


def test_without_commands_there_is_one_level():
    track = Track.of(Dive(heading=straight()).poses(every(1.0, 60)))
    assert not track.told
    assert Levels.driven([track]).commands.tolist() == [1.0]


@pytest.mark.parametrize(
    ("times", "command"),
    [(every(0.2, 120), step_at(60.1, 0.3, 0.8)), (irregular(120, seed=3), lambda t: 0.5)],
    ids=["even", "uneven"],
)
def test_the_way_is_what_the_vehicle_made_through_still_water(times, command):
    dive = Dive(
        heading=circling(40.0), flow=lambda t: (0.0, 0.0, 0.0), noise_m=0.0, surge_s=SURGE_S[2], command=command,
        speed_mps=1.5,
    )  # fmt: skip
    track = Track.of(dive.poses(times))
    found = Levels.driven([track])
    course = Course.of(track, found)
    speeds = np.concatenate((1.5 * found.commands, np.zeros(4)))
    made = np.diff(course.position_m, axis=0)[~course.begins[1:]]
    expected = (course.ways[:, 2] @ speeds)[1:][~course.begins[1:]]
    assert made == pytest.approx(expected, abs=0.07)


def test_nothing_is_known_of_the_way_through_a_gap_nor_right_after_it():
    dive = Dive(heading=straight(), command=lambda t: 0.5)
    before, after = dive.poses(every(0.5, 60)), dive.poses(every(0.5, 180, since_s=120))
    track = Track.of([*before, *after])
    course = Course.of(track, Levels.driven([track]))
    known = course.time_s[~course.begins]
    for begin_s in (0.0, 120.0):
        assert not ((known >= begin_s) & (known < begin_s + SETTLING_S)).any()
    assert ((known > SETTLING_S + BLOCK_S) & (known < 60.0)).sum() >= 20


def test_an_interval_without_a_command_is_not_known():
    poses = [PoseSample(float(t), 0.1 * t, 0.0, 0.0, command=None if 50 <= t < 53 else 0.5) for t in range(100)]
    track = Track.of(poses)
    course = Course.of(track, Levels.driven([track]))
    assert course.begins[(course.time_s > 50) & (course.time_s < 60)].all()
    assert not course.begins[course.time_s > 65].any()


def test_a_heading_that_goes_through_north_goes_the_short_way():
    poses = [PoseSample(0.5 * k, 0.5 * k, 0.0, (0.02 * (-1) ** k) % (2 * pi), command=0.5) for k in range(100)]
    track = Track.of(poses)
    course = Course.of(track, Levels.driven([track]))
    way = course.ways[~course.begins][5, 0, :, 0]
    assert way == pytest.approx((BLOCK_S, 0.0), abs=0.05)


def test_a_sample_that_is_not_finite_is_left_out():
    poses = [PoseSample(float(t), float("nan") if t == 5 else 0.1 * t, 0.0, 0.0, command=0.5) for t in range(30)]
    assert Track.of(poses).time_s.tolist() == [*range(5), *range(6, 30)]


def test_without_samples_there_is_nothing():
    track = Track.of([])
    assert len(Levels.driven([track]).commands) == 0
    assert len(Course.of(track, levels(0.5)).time_s) == 0
