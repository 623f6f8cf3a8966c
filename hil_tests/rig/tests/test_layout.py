"""Thrusters on a hull: what a demand makes of them, and what they make of the hull."""

from __future__ import annotations

from dataclasses import astuple

import pytest

from hil_tests.rig.layout import Layout, Mount
from hil_tests.rig.pilot import Sticks
from hil_tests.rig.thruster import T200
from hil_tests.rig.vehicle import BLUEROV2_HEAVY, Build, Hull, Motion

TWIN = Layout((Mount(ahead=1.0, yaw_arm_m=0.3), Mount(ahead=1.0, yaw_arm_m=-0.3), Mount(down=1.0, reversible=False)))


def test_a_heavy_is_mixed_as_ardusub_does():
    # AP_Motors6DOF.cpp, "vectored 6DOF": forward, lateral, yaw of motors 1 to 4
    rows = [(row[0], row[1], row[3]) for row in BLUEROV2_HEAVY.mixer[:4]]
    assert rows == [(-1.0, 1.0, 1.0), (-1.0, -1.0, -1.0), (1.0, 1.0, -1.0), (1.0, -1.0, 1.0)]


@pytest.mark.parametrize("layout", [BLUEROV2_HEAVY, TWIN])
@pytest.mark.parametrize("axis", ["forward", "right", "down", "yaw"])
def test_a_demand_moves_what_it_is_of_and_nothing_else(layout, axis):
    commands = layout.mix(Sticks(**{axis: 0.5}))
    forces = dict(zip(("forward", "right", "down", "yaw"), layout.forces(commands), strict=True))
    assert forces.pop(axis) > 0.0 or (axis == "right" and layout is TWIN)
    assert list(forces.values()) == pytest.approx([0.0] * 3, abs=1e-12)


def test_too_much_is_scaled_down_together():
    assert TWIN.mix(Sticks(forward=1.0, yaw=1.0)) == pytest.approx([1.0, 0.0, 0.0])
    assert TWIN.mix(Sticks(forward=0.6, yaw=-0.6, down=0.3)) == pytest.approx([0.0, 1.0, 0.25])


def test_what_cannot_turn_astern_does_not():
    assert TWIN.mix(Sticks(down=-0.5)) == [0.0, 0.0, 0.0]


def test_a_hull_follows_its_own_layout():
    hull = Hull(motion=Motion(), layout=TWIN)
    for _ in range(200):
        motion = hull.step([5.0, -5.0, 0.0], 0.01)
    assert motion.yaw_rate_radps > 0.5
    assert abs(motion.forward_mps) < 0.01


def test_wrong_layouts_are_refused():
    with pytest.raises(ValueError, match=r"ahead = 1\.5: want a part of the thrust, -1 to 1"):
        Mount(ahead=1.5)
    with pytest.raises(ValueError, match=r"yaw_arm_m = inf: want metres"):
        Mount(yaw_arm_m=float("inf"))
    with pytest.raises(ValueError, match="want at least one thruster"):
        Layout(())
    with pytest.raises(ValueError, match="2 thrusters: want one for each of 3 places, or one"):
        Build(layout=TWIN, thrusters=(T200, T200))
    assert astuple(TWIN.mounts[0]) == (1.0, 0.0, 0.0, 0.3, True)
