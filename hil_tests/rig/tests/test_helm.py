"""The helmsman steers what was asked for, with a hull that slips and thrusters that lag."""

from __future__ import annotations

from math import cos, degrees, pi, radians

import pytest

from hil_tests.rig.faults import HullFault
from hil_tests.rig.helm import Course, box, steer, zigzag
from hil_tests.rig.pilot import SURVEYING, Pilot
from hil_tests.rig.vehicle import Vehicle, mix

PERIOD_S = 0.01


@pytest.mark.parametrize("faults", [(), (HullFault(drag_factor=3.5, onset_s=0.0),)])
@pytest.mark.parametrize("course", [box(12.0), zigzag(pi, radians(60.0), 14.0)])
def test_every_leg_comes_to_its_heading(course, faults):
    vehicle, pilot = Vehicle(PERIOD_S, seed=1, hull_faults=faults), Pilot(1, SURVEYING)
    motion, off_deg = vehicle.hull.motion, []
    for index in range(round(5 * course.leg_s / PERIOD_S)):
        time_s = index * PERIOD_S
        motion = vehicle.step(time_s, mix(steer(course, time_s, pilot.sticks(time_s), motion)))
        if course.leg_s - time_s % course.leg_s < 1.5 * PERIOD_S:
            off_deg.append(degrees(1.0 - cos(course.heading_rad(time_s) - motion.yaw_rad)))
    assert len(off_deg) >= 5
    assert max(off_deg[1:]) < 1.0


def test_a_course_goes_round():
    course = box(8.0)
    assert [round(degrees(course.heading_rad(8.0 * leg + 0.1))) for leg in range(5)] == [0, 90, 180, 270, 0]


@pytest.mark.parametrize(("headings", "leg_s", "says"), [((), 8.0, "at least one"), ((0.0,), 0.0, "leg_s = 0.0")])
def test_an_impossible_course_is_refused(headings, leg_s, says):
    with pytest.raises(ValueError, match=says):
        Course(headings, leg_s)
