"""The speed watch's part: settings that the detector takes and is calm with, or what is missing and the way out."""

from dataclasses import replace

import pytest

from detectors.speed import SpeedConfig, SpeedCurve, SpeedDetector
from detectors.speed.tests.dives import Dive, every, step_at, straight, zig_zag
from detectors.verdict import Level
from gateway.commissioning.speed import commission_speed
from gateway.commissioning.speed_tolerance import TOLERANCE_MIN
from gateway.commissioning.tests.made_dives import fault, speed_config, speed_dive


def thrust(t):
    return (0.5, 0.25, 0.8)[int(t // 60) % 3]


DRIVEN = Dive(heading=zig_zag(), command=thrust, surge_s=2.5)


def poses(dive, seconds=480.0, seed=1):
    return dive.poses(every(1.0, seconds), seed)


def learnt(*dives, config=None, vouched=False, findings=()):
    made = [speed_dive(one, findings=findings) for one in dives]
    return commission_speed(config or speed_config(), made, 0.1, vouched)


def value(part, key):
    return next(one.value for one in part.settings if one.key == key)


@pytest.fixture(scope="module")
def part():
    return learnt(poses(DRIVEN))


def test_the_curve_and_the_hulls_lag_go_into_the_file(part):
    curve = value(part, "speed.curve")
    assert [one[0] for one in curve] == pytest.approx([0.25, 0.5, 0.8], abs=0.01)
    assert [one[1] for one in curve] == pytest.approx([0.25, 0.5, 0.8], rel=0.05)
    assert value(part, "detector.speed.surge_time_s") == 2.5
    assert TOLERANCE_MIN <= value(part, "speed.tolerance") <= 0.2
    assert set(part.removed) >= {"speed.minimum_mps", "speed.maximum_mps", "speed.command"}
    assert not part.missing


def test_what_was_learnt_finds_a_loss_and_is_calm_without(part):
    curve = SpeedCurve(*zip(*map(tuple, value(part, "speed.curve")), strict=True))
    settings = SpeedConfig(
        speed_curve=curve,
        tolerance=value(part, "speed.tolerance"),
        surge_time_s=value(part, "detector.speed.surge_time_s"),
    )
    for power, wanted in ((None, False), (step_at(240.0, 1.0, 0.7), True)):
        dive = DRIVEN if power is None else replace(DRIVEN, power=power)
        detector = SpeedDetector(settings)
        faults = [one.time_s for one in poses(dive, 360.0, seed=9) if detector.update(one).level is Level.FAULT]
        assert bool(faults) is wanted
        assert not faults or faults[0] > 240.0


def test_it_says_how_sure_it_is_and_shows_what_it_saw(part):
    names = [one.name for one in part.quantities]
    assert names[:3] == ["speed at 25 % thrust", "speed at 50 % thrust", "speed at 80 % thrust"]
    assert part.quantities[1].sureness == "+-0.02 m/s, of 179 s"
    assert "tolerance" in names and "false alarms where nothing was learnt" in names
    assert [one.name for one in part.figures] == ["speed-over-thrust", "speed-headings", "speed-off"]


def test_a_vehicle_that_tells_no_thrust_gets_a_range():
    part = learnt(poses(replace(DRIVEN, command=None), 300.0))
    assert value(part, "speed.minimum_mps") < 0.95 < 1.05 < value(part, "speed.maximum_mps")
    assert set(part.removed) == {"speed.curve", "speed.command"}
    assert any("`ahead`" in one for one in part.remarks)


def test_without_turns_the_manoeuvre_is_named():
    part = learnt(poses(replace(DRIVEN, heading=straight()), 300.0))
    assert not part.settings
    assert "too few turns" in part.missing[0]
    assert "drive a square at" in part.missing[0] and "30 s a side" in part.missing[0]


def test_a_thrust_that_was_only_driven_straight_is_missing():
    """In another dive than the one with turns, whose current says nothing of this one's."""
    turning = replace(DRIVEN, command=step_at(0.0, 0.2, 0.2))
    onward = replace(DRIVEN, command=step_at(0.0, 0.9, 0.9), heading=straight())
    part = learnt(poses(turning, 200.0), poses(onward, 200.0))
    assert "at 90 % thrust ahead" in part.missing[0]


def test_too_short_is_refused():
    part = learnt(poses(DRIVEN, 100.0))
    assert part.missing == ("100 s under way: want 180 s: drive a square at the usual thrust, 30 s a side",)


def test_no_positions_are_refused():
    assert learnt([]).missing[0].startswith("no position that moves was heard")


def test_a_vehicle_that_goes_backwards_is_wired_wrongly():
    turned = [replace(one, heading_rad=one.heading_rad + 3.1416) for one in poses(DRIVEN, 300.0)]
    assert "the wrong way round" in learnt(turned).missing[0]


def test_a_dive_with_a_fault_is_no_healthy_one_but_the_user_may_know_better():
    findings = [fault("speed", "vehicle"), fault("thruster", "thruster 1")]
    (line,) = learnt(poses(DRIVEN, 300.0), findings=findings).missing
    assert line == "dive is not healthy: 0:01:05 Speed 40 % low. Leave it out; or say --healthy, if you know better"
    assert not learnt(poses(DRIVEN, 300.0), findings=findings, vouched=True).missing


def test_a_wish_that_makes_no_sense_is_refused():
    with pytest.raises(ValueError, match="false_alarms_per_hour"):
        commission_speed(speed_config(), [], 0.0)
