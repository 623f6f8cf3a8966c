"""Situations as a pilot would name them."""

import pickle
from dataclasses import replace
from math import cos, nan, pi, sin, tau

import numpy as np
import pytest

from detectors.speed import PoseSample, SpeedConfig, SpeedCurve, SpeedDetector
from detectors.speed.flow_models import ConstantFlow
from detectors.speed.tests.dives import (
    Dive,
    circling,
    every,
    irregular,
    step_at,
    straight,
    turning,
    zig_zag,
)
from detectors.verdict import Level

RANGE = {"speed_min_mps": 0.8, "speed_max_mps": 1.2}
FIXED = SpeedConfig(**RANGE)
LEARNT = SpeedConfig()
COURSE_RAD = 0.4
SEEDS = pytest.mark.parametrize("seed", [1, 2])
# turns that tell speed from flow, a straight leg, and another turn
LEG_S = (80.0, 126.0)
LEGS = turning((20.0, 1.4), (40.0, 0.0), (60.0, 1.4), (LEG_S[0], COURSE_RAD), (LEG_S[1], 1.7), first_rad=COURSE_RAD)


def watched(samples, config=FIXED, curve=None):
    detector = SpeedDetector(config, curve)
    return detector, [detector.update(sample) for sample in samples]


def verdicts_of(samples, config=FIXED, curve=None):
    return watched(samples, config, curve)[1]


def levels(verdicts, since_s=-1.0, until_s=1e99):
    return {verdict.level for verdict in verdicts if since_s <= verdict.time_s < until_s}


def fault_at(verdicts):
    """Time of the first FAULT; NaN without one."""
    return next((verdict.time_s for verdict in verdicts if verdict.level is Level.FAULT), nan)


def near(verdicts, time_s):
    return min(verdicts, key=lambda verdict: abs(verdict.time_s - time_s))


def assert_learnt(verdict, speed_mps, flow_mps, within=0.1):
    assert verdict.speed_mps == pytest.approx(speed_mps, abs=within)
    np.testing.assert_allclose(verdict.flow_mps, flow_mps, atol=within)


# --- a loss, and what is none ---------------------------------------------------------------------------------------


@SEEDS
@pytest.mark.parametrize("config", [FIXED, LEARNT], ids=["range given", "range learnt"])
def test_a_net_that_takes_a_third_of_the_speed(seed, config):
    dive = Dive(heading=zig_zag(), power=step_at(100.0, 1.0, 0.65))
    verdicts = verdicts_of(dive.poses(every(0.2, 150.0), seed), config)
    assert Level.NORMAL in levels(verdicts, 60.0, 100.0) <= {Level.UNKNOWN, Level.NORMAL}
    assert 100.0 < fault_at(verdicts) < 130.0
    last = verdicts[-1]
    assert (last.level, last.flag, last.reason) == (Level.FAULT, 1, "too slow")
    assert last.speed_mps < last.speed_min_mps < last.speed_max_mps
    assert last.score >= 1.0
    assert_learnt(last, 0.65, [0.3, -0.2])


@SEEDS
def test_a_pilot_who_pushes_harder_against_a_net_does_not_teach_it_as_normal(seed):
    dive = Dive(heading=zig_zag(), power=step_at(110.0, 1.0, 0.5), command=step_at(120.0, 0.5, 0.8), speed_mps=2.0)
    _, verdicts = watched(dive.poses(every(0.2, 240.0), seed), LEARNT)
    assert 110.0 < fault_at(verdicts) < 160.0
    assert Level.NORMAL not in levels(verdicts, 130.0)


def test_after_a_restart_an_earlier_clock_is_no_trouble_and_an_old_fault_no_news():
    samples = Dive(heading=zig_zag(), power=step_at(90.0, 1.0, 0.6)).poses(every(0.2, 140.0), 1)
    detector, verdicts = watched(samples)
    assert verdicts[-1].level is Level.FAULT
    detector.resume()
    again = [detector.update(replace(sample, time_s=sample.time_s - 3600.0)) for sample in samples[:400]]
    assert again[0].level is Level.UNKNOWN
    assert Level.FAULT not in levels(again)
    assert again[-1].level is Level.NORMAL


@SEEDS
def test_a_vehicle_that_is_too_fast_is_not_as_it_should_be_either(seed):
    dive = Dive(heading=zig_zag(), power=step_at(90.0, 1.0, 1.45))
    last = verdicts_of(dive.poses(every(0.2, 150.0), seed))[-1]
    assert (last.level, last.reason) == (Level.FAULT, "too fast")


@SEEDS
@pytest.mark.parametrize("over_s", [0.2, 15.0], ids=["at once", "in 15 s"])
@pytest.mark.parametrize("set_mps", [-0.5, -0.9, 0.6], ids=["from ahead", "hard from ahead", "from astern"])
def test_a_current_that_sets_in_along_a_straight_leg_is_no_fault(seed, over_s, set_mps):
    bow = np.array((cos(COURSE_RAD), sin(COURSE_RAD), 0.0))

    def flow(t):
        return np.array((0.3, -0.2, 0.0)) + min(max((t - 95.0) / over_s, 0.0), 1.0) * set_mps * bow

    verdicts = verdicts_of(Dive(heading=LEGS, flow=flow).poses(every(0.5, 160.0), seed))
    assert levels(verdicts) <= {Level.UNKNOWN, Level.NORMAL}
    before, during = near(verdicts, 94.0), near(verdicts, 122.0)
    assert during.speed_error_mps > 3.0 * before.speed_error_mps  # it carries its doubt
    assert verdicts[-1].level is Level.NORMAL
    assert_learnt(verdicts[-1], 1.0, flow(1e9)[:2])


@SEEDS
def test_a_loss_on_a_straight_leg_is_left_open_and_told_by_the_turn(seed):
    verdicts = verdicts_of(Dive(heading=LEGS, power=step_at(95.0, 1.0, 0.5)).poses(every(0.2, 160.0), seed))
    assert levels(verdicts, *LEG_S) <= {Level.UNKNOWN, Level.NORMAL}
    during = near(verdicts, 122.0)
    assert during.level is Level.UNKNOWN
    assert during.reason == "no turn yet to tell speed from flow"
    assert LEG_S[1] < fault_at(verdicts) < LEG_S[1] + 15.0


@SEEDS
def test_on_a_course_without_any_turn_nothing_is_known(seed):
    dive = Dive(heading=straight(), power=lambda t: 0.5)
    verdicts = verdicts_of(dive.poses(every(0.5, 200.0), seed))
    assert levels(verdicts) == {Level.UNKNOWN}
    assert verdicts[-1].speed_error_mps > 0.2


@SEEDS
def test_the_tide_turns_and_nothing_is_said(seed):
    def flow(t):
        return 0.9 * cos(tau * t / 900.0), 0.9 * sin(tau * t / 900.0), 0.0

    dive = Dive(heading=zig_zag(20.0), flow=flow)
    verdicts = verdicts_of(dive.poses(every(1.0, 900.0), seed))
    assert levels(verdicts) <= {Level.UNKNOWN, Level.NORMAL}
    assert_learnt(verdicts[-1], 1.0, flow(900.0)[:2], within=0.2)


@SEEDS
def test_a_vehicle_that_is_thrust_aside_is_not_judged_by_its_way_ahead(seed):
    """The two motions brake each other: what comes of the one says nothing while there is the other."""
    dive = Dive(
        heading=zig_zag(), power=lambda t: 0.3 if 70.0 <= t < 85.0 else 1.0, speed_mps=2.0, command=lambda t: 0.5
    )
    poses = dive.poses(every(0.2, 150.0), seed)
    assert 70.0 < fault_at(verdicts_of(poses)) < 90.0  # what is judged where nobody thrusts it aside
    aside = [replace(pose, sideways=0.5 if 70.0 <= pose.time_s < 85.0 else 0.0) for pose in poses]
    verdicts = verdicts_of(aside)
    assert levels(verdicts) == {Level.UNKNOWN, Level.NORMAL}
    assert near(verdicts, 80.0).reason == "driven sideways"
    assert levels(verdicts, 110.0) == {Level.NORMAL}


@SEEDS
def test_the_net_is_cut(seed):
    dive = Dive(heading=zig_zag(), power=lambda t: 0.5 if 80.0 <= t < 140.0 else 1.0)
    verdicts = verdicts_of(dive.poses(every(0.2, 220.0), seed))
    assert levels(verdicts, 115.0, 140.0) == {Level.FAULT}
    assert levels(verdicts, 190.0) == {Level.NORMAL}
    assert verdicts[-1].score == 0.0
    assert verdicts[-1].reason == ""


@pytest.mark.parametrize("estimator", ["kalman", "adaptive"])
def test_the_other_estimators_find_a_loss_too(estimator):
    config = SpeedConfig(estimator=estimator, flow_error_max=0.3, **RANGE)
    healthy, lame = Dive(heading=zig_zag()), Dive(heading=zig_zag(), power=step_at(90.0, 1.0, 0.6))
    assert levels(verdicts_of(healthy.poses(every(0.2, 150.0)), config)) <= {Level.UNKNOWN, Level.NORMAL}
    assert 90.0 < fault_at(verdicts_of(lame.poses(every(0.2, 150.0)), config)) < 115.0


# --- commands -------------------------------------------------------------------------------------------------------


def slower(t):
    return 0.5 if 80.0 <= t < 150.0 else 0.9


@SEEDS
@pytest.mark.parametrize("config", [FIXED, LEARNT], ids=["range given", "range learnt"])
def test_slowing_down_on_purpose_is_no_fault_where_the_command_is_told(seed, config):
    poses = Dive(heading=zig_zag(), command=slower, speed_mps=1.1).poses(every(0.2, 200.0), seed)
    verdicts = verdicts_of(poses, config)
    assert levels(verdicts) <= {Level.UNKNOWN, Level.NORMAL}
    slow = near(verdicts, 148.0)
    assert slow.level is Level.NORMAL  # the slower command was learnt, too
    assert slow.speed_min_mps < slow.speed_mps == pytest.approx(0.55, abs=0.07)
    assert verdicts[-1].speed_mps == pytest.approx(0.99, abs=0.07)
    untold = [replace(pose, command=None) for pose in poses]
    assert 80.0 < fault_at(verdicts_of(untold, config)) < 120.0


@SEEDS
def test_a_net_caught_after_slowing_down_is_found(seed):
    dive = Dive(heading=zig_zag(), command=slower, speed_mps=1.1, power=step_at(125.0, 1.0, 0.5))
    verdicts = verdicts_of(dive.poses(every(0.2, 200.0), seed))
    assert 125.0 < fault_at(verdicts) < 160.0


@SEEDS
def test_a_hull_that_follows_its_commands_later_than_expected_is_no_fault(seed):
    config = SpeedConfig(speed_curve=SpeedCurve((0.4, 0.6, 0.8), (0.6, 0.9, 1.2)), surge_time_s=1.0)
    dive = Dive(heading=zig_zag(), command=lambda t: 0.8 if t % 40.0 < 20.0 else 0.4, speed_mps=1.5, surge_s=2.5)
    verdicts = verdicts_of(dive.poses(every(0.2, 200.0), seed), config)
    assert Level.FAULT not in levels(verdicts)
    assert verdicts[-1].level is Level.NORMAL


@SEEDS
def test_stopping_the_thrusters_is_no_fault(seed):
    dive = Dive(heading=zig_zag(), command=lambda t: 0.0 if 80.0 <= t < 120.0 else 0.9, speed_mps=1.1, surge_s=2.0)
    verdicts = verdicts_of(dive.poses(every(0.2, 200.0), seed))
    assert Level.FAULT not in levels(verdicts)
    stopped = near(verdicts, 115.0)
    assert (stopped.level, stopped.reason) == (Level.UNKNOWN, "thrusters stopped")
    assert stopped.speed_mps == pytest.approx(0.0, abs=0.05)
    assert verdicts[-1].level is Level.NORMAL


@SEEDS
def test_going_astern_is_no_fault_and_its_normal_speed_is_learnt(seed):
    def command(t):
        return -0.6 if 80.0 <= t < 160.0 else 0.9

    dive = Dive(heading=zig_zag(), command=command, speed_mps=1.1)
    verdicts = verdicts_of(dive.poses(every(0.2, 220.0), seed))
    assert levels(verdicts) <= {Level.UNKNOWN, Level.NORMAL}
    astern = near(verdicts, 158.0)
    assert astern.level is Level.NORMAL
    assert astern.speed_mps == pytest.approx(-0.66, abs=0.07)
    assert astern.speed_max_mps < astern.speed_mps < astern.speed_min_mps < 0.0


def test_a_curve_of_the_last_dive_serves_the_next():
    poses = Dive(heading=zig_zag(), command=lambda t: 0.8, speed_mps=1.5).poses(every(0.2, 100.0))
    detector, verdicts = watched(poses, LEARNT)
    lame = Dive(heading=zig_zag(), command=lambda t: 0.8, speed_mps=0.9).poses(every(0.2, 60.0), seed=4)
    assert verdicts[-1].level is Level.NORMAL
    assert fault_at(verdicts_of(lame, LEARNT, detector.curve)) < 60.0
    assert Level.FAULT not in levels(verdicts_of(lame, LEARNT))  # without it, the lame speed is what is normal


def test_a_configured_curve_serves_at_once():
    config = SpeedConfig(speed_curve=SpeedCurve((0.4, 0.8), (0.6, 1.2)))
    dive = Dive(heading=zig_zag(), command=lambda t: 0.8, speed_mps=1.5)
    verdicts = verdicts_of(dive.poses(every(0.2, 60.0)), config)
    assert verdicts[-1].level is Level.NORMAL
    assert verdicts[-1].speed_max_mps == pytest.approx(1.44)
    lame = replace(dive, speed_mps=0.9)
    assert fault_at(verdicts_of(lame.poses(every(0.2, 60.0)), config)) < 60.0


def test_commands_out_of_their_range_are_clipped_and_none_are_unknown():
    poses = Dive(heading=zig_zag(), command=lambda t: 1.0).poses(every(0.2, 80.0))
    plain = verdicts_of(poses)
    for wild in (1e9, 1.7):
        assert verdicts_of([replace(pose, command=wild) for pose in poses]) == plain
    untold = repr(verdicts_of([replace(pose, command=None) for pose in poses]))
    assert repr(verdicts_of([replace(pose, command=nan, sideways=nan) for pose in poses])) == untold


# --- positions ------------------------------------------------------------------------------------------------------


def displaced(poses, which, north_m):
    return [
        replace(pose, north_m=pose.north_m + north_m) if number in which else pose
        for number, pose in enumerate(poses)
    ]


def stale(poses, times):
    """Each position stands for so many samples."""
    return [
        replace(pose, north_m=poses[number - number % times].north_m, east_m=poses[number - number % times].east_m)
        for number, pose in enumerate(poses)
    ]


SPOILT = {
    "outliers": (lambda poses: displaced(poses, range(100, 800, 37), 25.0), {"position outlier": 19}),
    "positions that repeat": (lambda poses: stale(poses, 5), {"position repeated": 640}),
    "a reset by 30 m": (lambda poses: displaced(poses, range(400, 801), 30.0), {"position jumped": 1}),
}


@SEEDS
@pytest.mark.parametrize("name", SPOILT)
def test_positions_are_refused_and_counted_and_nothing_else_happens(name, seed):
    spoil, refused = SPOILT[name]
    healthy, lame = Dive(heading=zig_zag()), Dive(heading=zig_zag(), power=step_at(100.0, 1.0, 0.6))
    detector, verdicts = watched(spoil(healthy.poses(every(0.2, 160.0), seed)))
    assert levels(verdicts) <= {Level.UNKNOWN, Level.NORMAL}
    assert refused.items() <= detector.refused.items()
    assert_learnt(verdicts[-1], 1.0, [0.3, -0.2], within=0.07)
    assert 100.0 < fault_at(verdicts_of(spoil(lame.poses(every(0.2, 160.0), seed)))) < 130.0


@SEEDS
def test_positions_that_stand_still_for_long_are_no_caught_hull(seed):
    """A receiver that hangs: the vehicle drives on, and comes back into view far away."""
    poses = Dive(heading=zig_zag()).poses(every(0.2, 200.0), seed)
    frozen = [
        replace(pose, north_m=poses[500].north_m, east_m=poses[500].east_m) if 100.0 < pose.time_s < 140.0 else pose
        for pose in poses
    ]
    verdicts = verdicts_of(frozen)
    assert levels(verdicts) <= {Level.UNKNOWN, Level.NORMAL}
    assert near(verdicts, 138.0).level is Level.UNKNOWN
    assert verdicts[-1].level is Level.NORMAL
    assert_learnt(verdicts[-1], 1.0, [0.3, -0.2])


def gapped(dive, seed):
    return dive.poses([t for t in every(0.2, 220.0) if not 100.0 < t < 160.0], seed)


@SEEDS
def test_a_minute_without_samples(seed):
    healthy = verdicts_of(gapped(Dive(heading=zig_zag()), seed))
    assert levels(healthy) <= {Level.UNKNOWN, Level.NORMAL}
    assert near(healthy, 99.0).level is Level.NORMAL
    assert Level.UNKNOWN in levels(healthy, 160.0, 162.0)
    assert healthy[-1].level is Level.NORMAL
    caught_meanwhile = verdicts_of(gapped(Dive(heading=zig_zag(), power=step_at(120.0, 1.0, 0.6)), seed))
    assert 160.0 <= fault_at(caught_meanwhile) < 190.0
    caught_before = verdicts_of(gapped(Dive(heading=zig_zag(), power=step_at(50.0, 1.0, 0.6)), seed))
    assert levels(caught_before, 90.0) == {Level.FAULT}


SAMPLINGS = {
    "50 Hz": (every(0.02, 80.0), 10.0),
    "10 Hz": (every(0.1, 150.0), 15.0),
    "1 Hz": (every(1.0, 300.0), 25.0),
    "0.2 Hz": (every(5.0, 720.0), 60.0),
    "0.02 s to 5 s": (irregular(300.0, seed=3), 15.0),
}


@pytest.mark.parametrize("name", SAMPLINGS)
def test_any_sampling(name):
    times, leg_s = SAMPLINGS[name]
    onset_s = 0.6 * times[-1]
    healthy, lame = Dive(heading=zig_zag(leg_s)), Dive(heading=zig_zag(leg_s), power=step_at(onset_s, 1.0, 0.6))
    verdicts = verdicts_of(healthy.poses(times))
    assert levels(verdicts) <= {Level.UNKNOWN, Level.NORMAL}
    assert verdicts[-1].level is Level.NORMAL
    assert_learnt(verdicts[-1], 1.0, [0.3, -0.2])
    assert onset_s < fault_at(verdicts_of(lame.poses(times))) < onset_s + 20.0 + 1.5 * leg_s


def test_headings_across_north_as_a_compass_gives_them():
    poses = Dive(heading=zig_zag(about_rad=0.0), power=step_at(100.0, 1.0, 0.6)).poses(every(0.2, 150.0))
    compass = [replace(pose, heading_rad=pose.heading_rad % tau) for pose in poses]
    signed = [replace(pose, heading_rad=(pose.heading_rad + pi) % tau - pi) for pose in poses]
    assert max(pose.heading_rad for pose in compass) > 6.0
    expected = [verdict.level for verdict in verdicts_of(poses)]
    for others in (compass, signed):
        assert [verdict.level for verdict in verdicts_of(others)] == expected
    assert expected[-1] is Level.FAULT


def test_centimetres_per_second():
    """A blimp: the same dive, a hundred times smaller."""
    config = SpeedConfig(speed_min_mps=0.008, speed_max_mps=0.012)
    dive = Dive(heading=zig_zag(), flow=lambda t: (0.003, -0.002, 0.0), speed_mps=0.01, noise_m=0.001)
    assert levels(verdicts_of(dive.poses(every(0.2, 150.0)), config)) <= {Level.UNKNOWN, Level.NORMAL}
    lame = replace(dive, power=step_at(90.0, 1.0, 0.6))
    verdicts = verdicts_of(lame.poses(every(0.2, 150.0)), config)
    assert 90.0 < fault_at(verdicts) < 115.0
    assert_learnt(verdicts[-1], 0.006, [0.003, -0.002], within=0.001)


# --- three dimensions, and water that is known from elsewhere -------------------------------------------------------


@SEEDS
def test_upwelling_is_told_from_a_nose_that_is_down(seed):
    flow = (0.2, -0.1, -0.25)
    config = SpeedConfig(dimensions=3, **RANGE)
    dive = Dive(heading=circling(50.0), flow=lambda t: flow, pitch_rad=-0.3)
    last = verdicts_of(dive.poses(every(0.2, 120.0), seed), config)[-1]
    assert last.level is Level.NORMAL
    assert len(last.flow_mps) == 3
    assert_learnt(last, 1.0, flow)


def test_in_two_dimensions_a_nose_that_is_down_is_no_loss_of_speed():
    dive = Dive(heading=zig_zag(), pitch_rad=-0.8)
    verdicts = verdicts_of(dive.poses(every(0.2, 120.0)))
    assert levels(verdicts) <= {Level.UNKNOWN, Level.NORMAL}
    assert_learnt(verdicts[-1], 1.0, [0.3, -0.2])
    level = [replace(pose, pitch_rad=0.0) for pose in dive.poses(every(0.2, 120.0))]
    assert Level.FAULT in levels(verdicts_of(level))


KNOWN = SpeedConfig(flow_model=ConstantFlow(0.3, -0.2), flow_model_error_mps=0.05, **RANGE)


@SEEDS
def test_with_a_model_of_the_current_a_straight_run_can_be_judged(seed):
    healthy, lame = Dive(heading=straight()), Dive(heading=straight(), power=step_at(60.0, 1.0, 0.5))
    verdicts = verdicts_of(healthy.poses(every(0.2, 120.0), seed), KNOWN)
    assert levels(verdicts, 40.0) == {Level.NORMAL}
    assert 60.0 < fault_at(verdicts_of(lame.poses(every(0.2, 120.0), seed), KNOWN)) < 90.0
    assert levels(verdicts_of(healthy.poses(every(0.2, 120.0), seed))) == {Level.UNKNOWN}  # without it: not


@SEEDS
def test_a_model_that_is_wrong_by_what_it_says_is_no_fault(seed):
    off = ConstantFlow(0.3 + 0.15 * cos(COURSE_RAD), -0.2 + 0.15 * sin(COURSE_RAD))
    config = SpeedConfig(flow_model=off, flow_model_error_mps=0.15, **RANGE)
    for heading in (straight(COURSE_RAD), zig_zag()):
        verdicts = verdicts_of(Dive(heading=heading).poses(every(0.2, 120.0), seed), config)
        assert levels(verdicts) <= {Level.UNKNOWN, Level.NORMAL}
    assert_learnt(verdicts[-1], 1.0, [0.3, -0.2])  # the whole flow, not what the model lacks


# --- the operator ---------------------------------------------------------------------------------------------------


@SEEDS
@pytest.mark.parametrize("command", [None, 0.8])
def test_what_an_operator_accepts_is_normal_and_a_further_loss_is_a_fault_again(seed, command):
    def power(t):
        return 1.0 if t < 90.0 else 0.6 if t < 180.0 else 0.3

    dive = Dive(heading=zig_zag(), power=power, speed_mps=1.0 if command is None else 1.25)
    poses = replace(dive, command=None if command is None else lambda t: command).poses(every(0.2, 240.0), seed)
    detector = SpeedDetector(FIXED)
    first = [detector.update(pose) for pose in poses if pose.time_s < 150.0]
    assert first[-1].level is Level.FAULT
    detector.accept()
    then = [detector.update(pose) for pose in poses if pose.time_s >= 150.0]
    assert levels(then, 151.0, 180.0) <= {Level.UNKNOWN, Level.NORMAL}
    accepted = near(then, 178.0)
    assert accepted.level is Level.NORMAL
    assert (accepted.speed_min_mps, accepted.speed_max_mps) == pytest.approx((0.48, 0.72), rel=0.15)
    assert accepted.speed_mps == pytest.approx(0.6, abs=0.05)
    assert 180.0 < fault_at([one for one in then if one.time_s > 151.0]) < 210.0


def test_a_speed_that_is_not_known_is_accepted_by_learning_anew():
    poses = Dive(heading=zig_zag(), speed_mps=2.0).poses(every(0.2, 140.0))
    detector = SpeedDetector(FIXED)
    detector.update(poses[0])
    detector.accept()
    verdicts = [detector.update(pose) for pose in poses[1:]]
    assert levels(verdicts) <= {Level.UNKNOWN, Level.NORMAL}
    assert verdicts[-1].speed_min_mps < 2.0 < verdicts[-1].speed_max_mps


# --- samples --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("wrong", "cause"),
    [
        ({"north_m": nan}, "not finite"),
        ({"pitch_rad": float("inf")}, "not finite"),
        ({"east_m": 1e12}, "out of range"),
        ({"heading_rad": 1e9}, "out of range"),
        ({"time_s": 1e15}, "out of range"),
        ({"time_s": 0.0}, "late or repeated"),
        ({"time_s": -5.0}, "late or repeated"),
    ],
)
def test_why_a_sample_is_refused(wrong, cause):
    detector = SpeedDetector(FIXED)
    first = detector.update(PoseSample(0.0, 1.0, 2.0, 0.5))
    assert detector.update(replace(PoseSample(1.0, 1.5, 2.5, 0.5), **wrong)) == first
    assert detector.refused == {cause: 1}


def test_before_the_first_sample_a_refused_one_is_unknown():
    verdict = SpeedDetector().update(PoseSample(nan, 0.0, 0.0, 0.0))
    assert (verdict.level, verdict.flag, verdict.reason) == (Level.UNKNOWN, 2, "learning")


def test_the_learnt_curve_is_there_to_be_kept():
    detector = SpeedDetector(LEARNT)
    assert detector.curve is None
    for pose in Dive(heading=zig_zag(), command=lambda t: 0.8, speed_mps=1.5).poses(every(0.2, 100.0)):
        detector.update(pose)
    assert detector.curve.commands == pytest.approx((0.8,))
    assert detector.curve.speed_mps(0.8) == pytest.approx(1.2, abs=0.05)
    assert pickle.loads(pickle.dumps(detector)).curve == detector.curve  # noqa: S301


@pytest.mark.parametrize("across_mps", [-0.6, 0.6])
def test_a_model_of_the_flow_that_is_wrong_is_no_fault_of_the_vehicle(across_mps):
    flow = (-across_mps * sin(COURSE_RAD), across_mps * cos(COURSE_RAD), 0.0)
    config = replace(FIXED, flow_model=ConstantFlow(0.0, 0.0), flow_model_error_mps=0.1)
    verdicts = verdicts_of(Dive(heading=zig_zag(), flow=lambda t: flow).poses(every(0.2, 120.0), 1), config)
    assert Level.FAULT not in levels(verdicts)
