"""Missions of scenarios, driven by a whole vehicle."""

from __future__ import annotations

from math import degrees

import numpy as np
import pytest

from hil_tests.profiles.tests.loopback import START_S, profile, run, world
from hil_tests.rig.ardusub import ArduSub
from hil_tests.rig.mission_pilot import BAND_M, STYLES, MissionPilot
from hil_tests.rig.truth import Truth, TruthLog
from hil_tests.rig.vehicle import Motion, Vehicle
from hil_tests.scenario.document import Course, Mission, Step, Sticks


def driven(until_s, *steps, vehicle="bench_rov", **mission):
    """A whole world."""
    one = world(vehicle, mission=Mission(**({"style": "still"} | mission), steps=steps))
    run(one, until_s)
    return one, one.truth()


def steered(until_s, *steps, vehicle="bench_rov", **mission) -> Truth:
    """Pilot, autopilot and vehicle, without bus and link."""
    what, plan = profile(vehicle), Mission(**({"style": "still"} | mission), steps=steps)
    moving = Vehicle(what.step_s, 1, build=what.build(), motion=Motion(down_m=plan.depth_m))
    pilot, commander, log = MissionPilot(plan, 1, what.helm), ArduSub(), TruthLog(len(moving.thrusters))
    for step in range(round(until_s / what.step_s) + 1):
        since_s = step * what.step_s
        motion = moving.hull.motion
        commands = moving.layout.mix(commander.demand(pilot.sticks(since_s, motion, commander), motion))
        moving.step(since_s, commands)
        if step % round(0.1 / what.step_s) == 0:
            log.note(since_s, commands, moving)
    return log.truth()


def heading_deg(truth, since_s) -> float:
    return degrees(truth.yaw_rad[round(since_s / 0.1)]) % 360.0


def test_still_is_still():
    truth = steered(3.0)
    assert not truth.command.any()


@pytest.mark.parametrize("style", sorted(set(STYLES) - {"still"}))
def test_hands_that_play_excite_every_thruster(style):
    truth = steered(20.0, style=style, vehicle="bluerov2_heavy")
    assert (np.ptp(truth.command, axis=0) > 0.2).all()


def test_sticks_are_moved_in_time_and_held_and_others_left_where_they_are():
    ahead = Step(at_s=1.0, sticks=Sticks(forward=0.5), over_s=1.0)
    down = Step(at_s=3.0, sticks=Sticks(down=0.4), over_s=0.0)
    truth = steered(4.0, ahead, down)
    at = {since_s: truth.command[round(since_s / 0.1)].tolist() for since_s in (0.9, 1.5, 2.5, 3.5)}
    assert at[0.9] == [0.0, 0.0, 0.0]
    assert at[1.5] == pytest.approx([0.25, 0.25, 0.0], abs=0.01)
    assert at[2.5] == pytest.approx([0.5, 0.5, 0.0])
    assert at[3.5] == pytest.approx([0.5, 0.5, 0.4])


def test_sticks_that_a_step_holds_are_played_with_no_more():
    truth = steered(6.0, Step(at_s=2.0, sticks=Sticks(down=0.3)), style="working")
    assert np.ptp(truth.command[25:, 2]) < 0.02  # but for what mixing takes
    assert np.ptp(truth.command[25:, 0]) > 0.1


@pytest.mark.parametrize(
    ("vehicle", "settles_s"),
    [("bench_rov", 8.0), ("bluerov2_heavy", 8.0), ("paper_saucer_auv", 20.0), ("paper_portable_auv", 20.0),
     ("paper_hov", 60.0)],
)  # fmt: skip
def test_a_heading_is_come_to_and_kept(vehicle, settles_s):
    truth = steered(settles_s + 10.0, Step(at_s=1.0, heading_deg=70.0), vehicle=vehicle)
    for since_s in (settles_s, settles_s + 5.0, settles_s + 9.9):
        assert heading_deg(truth, since_s) == pytest.approx(70.0, abs=5.0)


def test_a_course_is_steered_until_a_step_wants_another_heading():
    course = Course(headings_deg=(0.0, 90.0), leg_s=8.0)
    truth = steered(32.0, Step(at_s=24.0, heading_deg=300.0), course=course)
    found = [heading_deg(truth, since_s) for since_s in (7.9, 15.9, 23.9, 31.9)]
    assert np.abs((np.array(found) - [0.0, 90.0, 0.0, 300.0] + 180.0) % 360.0 - 180.0).max() < 5.0


def test_a_depth_is_gone_to_and_kept_against_the_buoyancy():
    truth = steered(40.0, Step(at_s=1.0, depth_m=9.0), depth_m=3.0)
    assert truth.down_m[0] == 3.0
    assert truth.down_m[250:] == pytest.approx(9.0, abs=0.4)


def test_a_speed_is_kept_whatever_it_takes():
    truth = steered(30.0, Step(at_s=1.0, speed_mps=0.8), Step(at_s=20.0, speed_mps=0.4))
    assert truth.through_water_mps[150:195] == pytest.approx(0.8, abs=0.04)
    assert truth.through_water_mps[-20:] == pytest.approx(0.4, abs=0.06)


def test_modes_and_arming_are_the_autopilots():
    one, truth = driven(
        6.0,
        Step(at_s=0.0, sticks=Sticks(forward=0.5), over_s=0.0),
        Step(at_s=1.0, mode="ALT_HOLD"),
        Step(at_s=2.0, armed=False),
        Step(at_s=4.0, armed=True, mode="POSHOLD"),
        mode="STABILIZE",
    )
    assert [(round(change.time_s - START_S, 2), change.mode, change.armed) for change in one.modes] == [
        (0.0, "STABILIZE", True),
        (1.0, "ALT_HOLD", True),
        (2.0, "ALT_HOLD", False),
        (4.0, "POSHOLD", True),
    ]
    assert truth.command[15, 0] == pytest.approx(0.5)
    assert not truth.command[25:39].any()


@pytest.mark.parametrize("vehicle", ["bluerov2_heavy_px4"])
def test_a_px4_is_disarmed_by_its_pilot_wherever_it_is(vehicle):
    one, _ = driven(3.0, Step(at_s=1.0, armed=False), Step(at_s=2.0, armed=True, mode="ALTCTL"), vehicle=vehicle)
    assert [(change.mode, change.armed) for change in one.modes] == [
        ("MANUAL", True),
        ("MANUAL", False),
        ("ALTCTL", True),
    ]


def test_a_mode_that_there_is_not_is_said():
    one = world(mission=Mission(steps=(Step(at_s=1.0, mode="HOVER"),)))
    with pytest.raises(ValueError, match="mode = 'HOVER': want one of STABILIZE, ACRO"):
        run(one, 2.0)


def test_an_unarmed_vehicle_does_nothing():
    one, truth = driven(3.0, armed=False, style="surveying")
    assert not truth.command.any()
    assert not one.modes[0].armed


def test_a_long_mission_stays_within_a_band_of_depths():
    pilot, commander = MissionPilot(Mission(style="cruising", depth_m=10.0), 1), ArduSub()
    depths_m = [10.0, 10.0 + BAND_M - 0.1, 10.0 + BAND_M + 0.1, 10.1 + 0.5 * BAND_M, 10.1, 9.9, 10.1 + 0.5 * BAND_M]
    down = [
        pilot.sticks(30.0 + time_s, Motion(down_m=depth_m), commander).down for time_s, depth_m in enumerate(depths_m)
    ]
    assert [value > 0.0 for value in down] == [True, True, False, False, False, True, True]
