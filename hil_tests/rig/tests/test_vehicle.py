"""Pilot, mixer, battery and hull."""

from __future__ import annotations

import numpy as np
import pytest

from hil_tests.rig.faults import FaultType, HullFault, InjectedFault
from hil_tests.rig.pilot import CRUISING, DrivingStyle, Pilot, Sticks
from hil_tests.rig.vehicle import THRUSTERS, Battery, Hull, Motion, Vehicle, mix
from hil_tests.rig.water import Current, SettingIn

PERIOD_S = 0.01


def drive(sticks, seconds=5.0, vehicle=None) -> tuple[Vehicle, Motion]:
    vehicle = vehicle or Vehicle(PERIOD_S, seed=1)
    for index in range(round(seconds / PERIOD_S)):
        motion = vehicle.step(index * PERIOD_S, mix(sticks))
    return vehicle, motion


@pytest.mark.parametrize(
    ("sticks", "grows"),
    [
        (Sticks(forward=0.5), "forward_mps"),
        (Sticks(right=0.5), "right_mps"),
        (Sticks(down=0.5), "down_mps"),
        (Sticks(yaw=0.5), "yaw_rate_radps"),
    ],
)
def test_each_stick_moves_its_own_axis_most(sticks, grows):
    _, motion = drive(sticks)
    speeds = {name: getattr(motion, name) for name in ("forward_mps", "right_mps", "down_mps", "yaw_rate_radps")}
    assert speeds.pop(grows) > 0.3
    # The thrusters are weaker astern, so a pure demand leaks a little into the other axes; buoyancy lifts.
    assert all(abs(speed) < 0.25 for speed in speeds.values()), speeds


def test_top_speed_is_that_of_a_bluerov2():
    _, motion = drive(Sticks(forward=1.0), seconds=20.0)
    assert 1.2 < motion.forward_mps < 3.0


def test_the_hull_coasts_to_rest_and_floats_up():
    hull = Hull(motion=Motion(forward_mps=1.5, right_mps=-1.0, yaw_rate_radps=2.0))
    for _ in range(6000):
        motion = hull.step([0.0] * THRUSTERS, PERIOD_S)
    assert abs(motion.forward_mps) < 0.01 > abs(motion.right_mps)
    assert motion.down_m == 0.0


def test_a_long_step_does_not_blow_up():
    hull = Hull()
    for _ in range(100):
        motion = hull.step([50.0] * THRUSTERS, 2.0)
    assert np.isfinite(motion.down_mps)
    assert abs(motion.yaw_rate_radps) < 10.0


def test_mixing_scales_all_commands_down_together():
    commands = mix(Sticks(forward=1.0, right=1.0, yaw=1.0))
    assert max(map(abs, commands)) == 1.0
    assert commands[:4] == pytest.approx([1.0 / 3.0, -1.0, 1.0 / 3.0, 1.0 / 3.0])


def test_battery_sags_with_load_and_empties_with_charge():
    battery = Battery()
    fresh_v = battery.voltage_v
    assert battery.step(60.0, 1e-9) == pytest.approx(fresh_v - 1.5)
    battery.step(18.0, 3600.0)
    assert battery.step(0.0, 1.0) == pytest.approx(12.0)
    assert battery.step(1e4, 1.0) == 0.0


def test_thrusters_share_the_battery():
    vehicle, _ = drive(Sticks(forward=0.8))
    alone = drive(Sticks(forward=0.8, down=0.8))[0]
    assert alone.battery.voltage_v < vehicle.battery.voltage_v < Battery().voltage_v


def test_a_fault_hits_its_own_thruster_only():
    faults = {3: [InjectedFault(type=FaultType.ENTANGLED, onset_s=1.0, severity=0.3)]}
    vehicle, _ = drive(Sticks(forward=0.6), vehicle=Vehicle(PERIOD_S, seed=1, faults=faults))
    off = [thruster.state.speed_rpm != thruster.state.healthy_rpm for thruster in vehicle.thrusters]
    assert off == [number == 3 for number in range(1, THRUSTERS + 1)]


def test_a_fault_on_a_thruster_that_is_not_there_is_refused():
    with pytest.raises(ValueError, match=r"\[9\]: want numbers from 1 to 8"):
        Vehicle(PERIOD_S, seed=1, faults={9: []})


def test_the_pilot_is_lively_steady_handed_and_the_same_for_the_same_seed():
    def sticks(seed):
        pilot = Pilot(seed)
        return np.array([[s.forward, s.right, s.down, s.yaw] for s in map(pilot.sticks, np.arange(0.0, 30.0, 0.02))])

    first = sticks(4)
    assert np.array_equal(first, sticks(4))
    assert not np.array_equal(first, sticks(5))
    assert np.abs(first).max() <= 0.5
    assert np.all(first.std(axis=0) > 0.1)
    assert np.abs(np.diff(first, axis=0)).max() < 0.2


def test_under_way_the_pilot_keeps_ahead():
    pilot = Pilot(4, CRUISING)
    forward = np.array([pilot.sticks(time_s).forward for time_s in np.arange(0.0, 30.0, 0.02)])
    assert np.all(forward[200:] > 0.2)
    assert forward.std() > 0.05


def test_a_stick_beyond_its_end_is_refused():
    with pytest.raises(ValueError, match=r"right: centre 0\.6 with gain 0\.5: want a stick within -1 to 1"):
        DrivingStyle(Sticks(right=0.6), Sticks(0.1, 0.5, 0.1, 0.1))


def test_what_is_caught_on_the_hull_halves_the_speed_and_leaves_the_rpm():
    net = HullFault(drag_factor=3.5, onset_s=15.0, ramp_s=1.0)
    vehicle = Vehicle(PERIOD_S, seed=1, hull_faults=[net])
    _, clean = drive(Sticks(forward=0.45, down=0.3), seconds=14.9, vehicle=vehicle)
    for index in range(1490, 3000):
        fouled = vehicle.step(index * PERIOD_S, mix(Sticks(forward=0.45, down=0.3)))
    assert fouled.forward_mps == pytest.approx(0.5 * clean.forward_mps, rel=0.05)
    assert vehicle.clean_hull.motion.forward_mps == pytest.approx(clean.forward_mps, rel=0.02)
    assert all(thruster.state.speed_rpm == thruster.state.healthy_rpm for thruster in vehicle.thrusters)


def test_a_net_comes_off_again():
    net = HullFault(drag_factor=3.5, onset_s=2.0, ramp_s=2.0, end_s=10.0)
    assert [net.factor(time_s) for time_s in (1.9, 3.0, 4.0, 9.9, 10.0)] == [1.0, 2.25, 3.5, 3.5, 1.0]


@pytest.mark.parametrize(
    ("settings", "says"), [({"drag_factor": 1.0}, "want a number above 1"), ({"ramp_s": -1.0}, "ramp_s")]
)
def test_an_impossible_hull_fault_is_refused(settings, says):
    with pytest.raises(ValueError, match=says):
        HullFault(**({"drag_factor": 2.0, "onset_s": 1.0} | settings))


def test_a_current_carries_the_vehicle_along_and_changes_nothing_else():
    current = SettingIn(Current(0.1, 0.4), onset_s=3.0, ramp_s=4.0)
    _, carried = drive(Sticks(forward=0.45, yaw=0.01), seconds=20.0, vehicle=Vehicle(PERIOD_S, seed=1, water=current))
    _, calm = drive(Sticks(forward=0.45, yaw=0.01), seconds=20.0)
    assert (carried.forward_mps, carried.right_mps) == (calm.forward_mps, calm.right_mps)
    assert carried.north_m - calm.north_m == pytest.approx(0.1 * 15.0, rel=0.01)
    assert carried.east_m - calm.east_m == pytest.approx(0.4 * 15.0, rel=0.01)
    drift = np.subtract(carried.velocity_ned_mps(), calm.velocity_ned_mps())
    assert drift == pytest.approx((0.1, 0.4, 0.0))


def test_velocity_over_ground_is_the_same_in_both_frames():
    motion = Motion(yaw_rad=0.5 * np.pi, forward_mps=1.0, right_mps=0.2, water_mps=(0.3, 0.4, 0.1))
    assert motion.velocity_ned_mps() == pytest.approx((0.1, 1.4, 0.1))
    assert motion.over_ground_mps() == pytest.approx((1.4, -0.1, 0.1))


def test_a_turn_slips_outwards_and_costs_speed():
    _, straight = drive(Sticks(forward=0.45), seconds=10.0)
    _, turning = drive(Sticks(forward=0.45, yaw=0.01), seconds=10.0)
    assert turning.yaw_rate_radps > 0.2
    assert turning.right_mps < -0.1
    assert turning.forward_mps < straight.forward_mps
