"""HIL tests of a vehicle of your own, as you would write them: copy this file, and put your own profile in.

pytest test_my_vehicle.py                      minutes of diving in seconds
pytest test_my_vehicle.py --hil-can vcan0      in real time, on a bus of the kernel
"""

import pytest

VEHICLE = "bench_rov"  # or the path of your own profile, relative to this file
LEARNT_S = 40  # when its thrusters and its speed are known


@pytest.mark.parametrize("thruster", [1, 2])
def test_weeds_are_told_and_named(gateway_rig, thruster):
    outcome = gateway_rig.play(
        vehicle=VEHICLE,
        duration_s=LEARNT_S + 6,
        faults=[{"at_s": LEARNT_S, "subject": f"thruster {thruster}", "failure": "entangled", "share": 0.4}],
    )
    faults = [one for one in outcome.findings if one.level.name == "FAULT"]
    assert [one.subject for one in faults] == [f"thruster {thruster}"]
    assert LEARNT_S < faults[0].time_s - outcome.start_s < LEARNT_S + 4


def test_nothing_is_asked_of_the_autopilot_on_a_healthy_dive(gateway_rig):
    outcome = gateway_rig.play(
        vehicle=VEHICLE,
        duration_s=LEARNT_S,
        gateway={"settings": {"failsafe": {"thruster_fault": "hold"}}},
        never=[{"finding": {"at_least": "FAULT"}}, {"command": "*"}],
    )
    gateway_rig.require(outcome)


@pytest.mark.scenario("weeds_in_a_small_rov", seed=7)
def test_a_scenario_that_ships_with_another_seed(gateway_rig, scenario):
    gateway_rig.require(gateway_rig.play(scenario))
