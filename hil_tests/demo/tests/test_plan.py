"""What there is time for in a demonstration."""

from __future__ import annotations

from math import hypot, nan

import pytest

from detectors.navigation import Sensor
from hil_tests.demo.plan import CURRENT_MPS, ENTANGLED, plan
from hil_tests.demo.record import DVL, SPEED
from hil_tests.rig.embedded import Surroundings
from hil_tests.rig.instruments import Equipment


def test_a_long_one_shows_all_three_acts():
    script = plan(110.0)
    assert script.left_out() == ()
    times_s = (script.weeds_s, script.freed_s, script.current_s, script.net_s, script.net_freed_s, script.drift_s)
    assert sorted(times_s) == list(times_s)
    assert script.drift_s < 110.0
    surroundings = script.surroundings()
    assert hypot(*surroundings.water.velocity_mps(script.net_s, (0.0, 0.0, 0.0))) == pytest.approx(CURRENT_MPS)
    [net] = surroundings.hull_faults
    assert (net.onset_s, net.end_s) == (script.net_s, script.net_freed_s)
    [drift] = surroundings.equipment.faults
    assert (drift.sensor, drift.onset_s) == (Sensor.DVL, script.drift_s)
    [weeds] = script.faults()[ENTANGLED]
    assert (weeds.onset_s, weeds.end_s) == (script.weeds_s, script.freed_s)
    truth = script.truth(0.0, nan, nan)
    assert [trouble.subject for trouble in truth.troubles] == ["thruster 3", SPEED, DVL]
    assert {script.freed_s, script.current_s, script.net_freed_s} == {time_s for time_s, _ in truth.events}


def test_the_net_stays_where_nothing_follows():
    assert plan(85.0).net_s < 85.0 < plan(85.0).net_freed_s


@pytest.mark.parametrize(
    ("seconds", "left"), [(5.0, 3), (54.9, 3), (55.0, 2), (79.9, 2), (80.0, 1), (109.9, 1), (110.0, 0)]
)
def test_what_does_not_fit_is_left_out_and_said(seconds, left):
    assert len(plan(seconds).left_out()) == left


def test_a_short_one_is_the_first_act_in_still_water():
    script = plan(5.0)
    assert script.weeds_s == pytest.approx(3.0)
    assert script.surroundings() == Surroundings(equipment=Equipment())
    assert [trouble.subject for trouble in script.truth(0.0, nan, nan).troubles] == ["thruster 3"]


def test_the_weeds_come_when_they_are_told_to():
    assert plan(85.0, weeds_s=31.0).weeds_s == 31.0
