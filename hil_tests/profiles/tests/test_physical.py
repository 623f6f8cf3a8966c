"""Physical faults of scenarios, in a whole vehicle: each does what its row of the table says."""

from __future__ import annotations

from itertools import pairwise
from math import inf

import numpy as np
import pytest
from dronecan import transport

from hil_tests.profiles.tests.loopback import START_S, fault, run, world
from hil_tests.rig.dronecan_nodes import DroneCanReceiver
from hil_tests.rig.physical import GUST_RAMP_MIN_S, PhysicalFaults, water
from hil_tests.rig.thruster import T200
from hil_tests.rig.water import STILL
from hil_tests.scenario.document import Mission, Step, Sticks, WaterBody
from hil_tests.scenario.failures import PHYSICAL, TABLE, FailureKind

ONSET_S = 4.0
AHEAD = Mission(style="still", steps=(Step(at_s=0.0, sticks=Sticks(forward=0.5), over_s=0.0),))
ROWS = [row for row in TABLE if row.target in PHYSICAL]


def played(*faults, until_s=8.0, mission=AHEAD, vehicle="bench_rov", **parts):
    one = world(vehicle, mission=mission, faults=faults, **parts)
    run(one, until_s)
    return one.truth()


def example(row: FailureKind):
    """A fault of the row, with quantities that its bounds allow."""
    values = {
        quantity.name: quantity.default if quantity.default is not None else max(quantity.minimum, 0.0) + 0.5
        for quantity in row.quantities
    }
    return fault("thruster 1" if row.target == "thruster" else str(row.target), row.failure, ONSET_S, **values)


@pytest.mark.parametrize("row", ROWS, ids=lambda row: f"{row.target}-{row.failure}")
def test_every_row_of_the_table_is_known_and_changes_what_happens(row):
    healthy, faulty = PhysicalFaults([]), PhysicalFaults([example(row)])
    names = ("thrusters", "resets", "hull", "sags", "gusts", "reboots")
    assert sum(getattr(healthy, name) != getattr(faulty, name) for name in names) == 1


def test_faults_on_wires_are_left_to_the_wires():
    faults = PhysicalFaults([fault("thruster 1 rpm", "stuck"), fault("can0", "bus_off"), fault("dvl", "off")])
    assert not (faults.thrusters or faults.hull or faults.gusts or faults.reboots or faults.resets or faults.sags)


def lost(truth, until_s=7.9) -> float:
    """Share of the speed of thruster 1 that is gone; its twin, thruster 2, is healthy."""
    assert truth.speed_rpm[:, 1] == pytest.approx(truth.healthy_rpm[:, 1])
    place = round(until_s / 0.1)
    return float(1.0 - truth.speed_rpm[place, 0] / truth.healthy_rpm[place, 0])


@pytest.mark.parametrize(
    ("failure", "values", "least", "most"),
    [
        ("entangled", {"share": 0.3}, 0.1, 0.35),
        ("blocked", {}, 1.0, 1.0),
        ("propeller_lost", {}, -1.0, -0.05),
        ("worn", {"share": 0.3}, 0.2, 0.35),
        ("off", {}, 0.999, 1.0),
        ("reverse", {}, 1.9, 2.0),
    ],
)
def test_a_faulty_thruster_turns_as_it_should_and_the_others_as_ever(failure, values, least, most):
    truth = played(fault("thruster 1", failure, ONSET_S, **values))
    assert lost(truth, ONSET_S - 0.1) == pytest.approx(0.0)
    assert least - 1e-9 <= lost(truth) <= most + 1e-9


def test_a_fault_grows_over_its_ramp_and_is_gone_at_its_end():
    truth = played(fault("thruster 1", "entangled", ONSET_S, ramp_s=2.0, until_s=6.5, share=0.5))
    shares = [lost(truth, since_s) for since_s in (4.5, 5.2, 5.9, 7.9)]
    assert shares[0] < shares[1] < shares[2]
    assert shares[3] == pytest.approx(0.0, abs=1e-3)


STEPPING = Mission(style="still", steps=(Step(at_s=ONSET_S + 1.0, sticks=Sticks(forward=0.5), over_s=0.0),))


def rises_s(truth, thruster: int) -> float:
    """When the speed has made half of its way."""
    speed_rpm = truth.speed_rpm[:, thruster]
    return float(np.interp(0.5 * speed_rpm[-1], speed_rpm, truth.time_s - START_S))


def test_one_that_is_delayed_obeys_later_and_one_that_is_slow_takes_longer():
    delayed = played(fault("thruster 1", "delayed", ONSET_S, delay_s=0.5), mission=STEPPING)
    assert rises_s(delayed, 0) - rises_s(delayed, 1) == pytest.approx(0.5, abs=0.02)
    slow = played(fault("thruster 1", "slow", ONSET_S, factor=4.0), mission=STEPPING)
    assert rises_s(slow, 0) - rises_s(slow, 1) == pytest.approx(3.0 * np.log(2.0) * T200.spin_up_s, abs=0.08)
    assert lost(slow) == pytest.approx(0.0, abs=0.01)


RESETS = fault("thruster 1", "reset", ONSET_S, silent_s=1.0, every_s=3.0, until_s=8.0)


def test_an_esc_that_restarts_lets_its_motor_coast_again_and_again():
    truth = played(RESETS, until_s=12.0)
    shares = [lost(truth, since_s) for since_s in (3.9, 4.9, 6.9, 7.9, 9.9, 11.9)]
    assert shares == pytest.approx([0.0, 1.0, 0.0, 1.0, 0.0, 0.0], abs=0.01)


def test_an_esc_that_restarts_is_silent_then_counts_from_zero():
    receiver, node = DroneCanReceiver(), 11
    frames = [
        frame for frame in run(world(mission=AHEAD, faults=[RESETS]), 12.0).reports if frame.identifier & 0x7F == node
    ]
    transfers = []
    for frame in frames:
        transfer = receiver.take(frame.identifier, frame.data)
        if transfer is not None:
            transfers.append((frame.time_s - START_S, transfer))
    statuses = [(time_s, one) for time_s, one in transfers if _name(one).endswith("esc.Status")]
    silences = [(before, after) for (before, _), (after, _) in pairwise(statuses)]
    longest = sorted(silences, key=lambda pair: pair[0] - pair[1])[:2]
    assert sorted(longest) == [pytest.approx((4.0, 5.0), abs=0.15), pytest.approx((7.0, 8.0), abs=0.15)]
    firsts = [one.transfer_id for time_s, one in statuses if any(time_s == after for _, after in longest)]
    assert firsts == [0, 0]
    uptimes = [one.payload.uptime_sec for _, one in transfers if _name(one).endswith("NodeStatus")]
    assert uptimes == [0, 1, 2, 3, 0, 1, 0, 1, 2, 3, 4][: len(uptimes)]
    assert len(uptimes) >= 10


def _name(transfer) -> str:
    return transport.get_dronecan_data_type(transfer.payload).full_name


def test_a_supply_that_sags_slows_all_and_is_no_fault_of_theirs():
    truth = played(fault("battery", "sag", ONSET_S, sag_v=3.0))
    assert truth.supply_v[-1] - truth.supply_v[round(ONSET_S / 0.1) - 1] == pytest.approx(-3.0, abs=0.3)
    assert truth.speed_rpm[-1, 0] < 0.9 * truth.speed_rpm[round(ONSET_S / 0.1) - 1, 0]
    assert truth.speed_rpm == pytest.approx(truth.healthy_rpm)


def test_a_net_halves_the_speed_and_no_thruster_shows_it():
    truth = played(fault("hull", "net", 10.0), until_s=20.0)
    assert truth.through_water_mps[-1] == pytest.approx(0.5 * truth.through_water_mps[99], rel=0.1)
    assert truth.speed_rpm == pytest.approx(truth.healthy_rpm)


def test_a_pull_at_the_hull_takes_it_along_where_it_pulls_to():
    truth = played(
        fault("hull", "pull", ONSET_S, force_n=15.0, towards_deg=90.0), until_s=20.0, mission=STILL_MISSION
    )
    assert truth.east_m[round(ONSET_S / 0.1) - 1] == pytest.approx(0.0, abs=1e-9)
    assert truth.east_m[-1] > 5.0
    assert abs(truth.north_m[-1]) < 0.1 * truth.east_m[-1]


STILL_MISSION = Mission(style="still")


def test_a_gust_carries_the_vehicle_off_and_comes_and_goes():
    gust = fault("water", "gust", ONSET_S, until_s=8.0, speed_mps=0.5, towards_deg=180.0, ramp_s=2.0)
    truth = played(gust, until_s=12.0)
    at = {since_s: truth.current_north_mps[round(since_s / 0.1)] for since_s in (3.9, 5.0, 6.5, 9.0, 10.5)}
    assert list(at.values()) == pytest.approx([0.0, -0.25, -0.5, -0.25, 0.0], abs=0.02)
    assert truth.through_water_mps[65] - truth.over_ground_mps[65] == pytest.approx(0.5, abs=0.01)


def test_water_never_moves_all_at_once():
    moving = water(WaterBody(), PhysicalFaults([fault("water", "gust", 1.0, speed_mps=0.5)]).gusts)
    velocities = [moving.velocity_mps(1.0 + 0.1 * step, (0.0, 0.0, 5.0))[0] for step in range(20)]
    assert max(np.diff(velocities)) < 0.5 / GUST_RAMP_MIN_S * 0.1 * 2.0
    assert velocities[-1] == 0.5


def test_an_autopilot_that_reboots_is_silent_and_then_disarmed():
    one = world(mission=AHEAD, faults=[fault("autopilot", "reboot", ONSET_S, silent_s=2.0)])
    heard = run(one, 8.0)
    for stamps in ([frame.time_s for frame in heard.commands], [time_s for time_s, _ in heard.datagrams]):
        silent = [stamp - START_S for stamp in stamps if ONSET_S < stamp - START_S < ONSET_S + 1.99]
        assert not silent
        assert any(stamp - START_S > ONSET_S + 2.0 for stamp in stamps)
    assert [(change.time_s - START_S, change.armed) for change in one.modes] == [(0.0, True), (ONSET_S, False)]
    assert one.truth().speed_rpm[-1] == pytest.approx([0.0] * 3, abs=1.0)


def test_currents_tide_and_shear_add_up():
    body = WaterBody(
        currents=(
            {"speed_mps": 0.2, "towards_deg": 0.0},
            {"speed_mps": 0.4, "towards_deg": 90.0, "at_s": 10.0, "over_s": 4.0},
        ),
        tide={"speed_mps": 0.3, "towards_deg": 180.0, "period_s": 100.0, "phase_deg": 90.0},
        shear={"surface_mps": 0.1, "per_m_mps": 0.01, "towards_deg": 0.0},
    )
    moving = water(body, ())
    assert moving.velocity_mps(0.0, (0.0, 0.0, 20.0)) == pytest.approx((0.2 + 0.3, 0.0, 0.0), abs=1e-9)
    # a quarter of a period later the tide is at its greatest, ebbing; the second current has set in
    assert moving.velocity_mps(25.0, (0.0, 0.0, 0.0)) == pytest.approx((0.2 + 0.3 + 0.1, 0.4, 0.0), abs=1e-9)
    assert water(WaterBody(), ()).velocity_mps(0.0, (0.0, 0.0, 0.0)) == STILL.velocity_mps(0.0, (0.0, 0.0, 0.0))


def test_several_faults_of_one_thruster_act_together():
    both = played(
        fault("thruster 1", "worn", ONSET_S, share=0.2), fault("thruster 1", "entangled", ONSET_S, share=0.3)
    )
    one = played(fault("thruster 1", "worn", ONSET_S, share=0.2))
    assert lost(both) > lost(one) + 0.05


def test_a_fault_without_end_lasts():
    assert PhysicalFaults([fault("thruster 1", "off")]).thrusters[1][0].end_s == inf
