"""What there is time for in a demonstration."""

from __future__ import annotations

from math import hypot, nan

import pytest

from hil_tests.demo.plan import CURRENT_MPS, ENTANGLED, plan
from hil_tests.demo.record import SPEED
from hil_tests.rig.embedded import Surroundings


def test_a_long_one_shows_both_acts():
    script = plan(85.0)
    assert script.left_out() == ()
    assert script.weeds_s < script.freed_s < script.current_s < script.net_s < 85.0
    surroundings = script.surroundings()
    assert hypot(*surroundings.water.velocity_mps(script.net_s, (0.0, 0.0, 0.0))) == pytest.approx(CURRENT_MPS)
    [net] = surroundings.hull_faults
    assert net.onset_s == script.net_s
    [weeds] = script.faults()[ENTANGLED]
    assert (weeds.onset_s, weeds.end_s) == (script.weeds_s, script.freed_s)
    assert [trouble.subject for trouble in script.truth(0.0, nan, nan).troubles] == ["thruster 3", SPEED]


@pytest.mark.parametrize(("seconds", "left"), [(5.0, 2), (45.0, 2), (54.9, 2), (55.0, 1), (79.9, 1), (80.0, 0)])
def test_what_does_not_fit_is_left_out_and_said(seconds, left):
    assert len(plan(seconds).left_out()) == left


def test_a_short_one_is_the_first_act_in_still_water():
    script = plan(5.0)
    assert script.weeds_s == pytest.approx(3.0)
    assert script.surroundings() == Surroundings()
    assert [trouble.subject for trouble in script.truth(0.0, nan, nan).troubles] == ["thruster 3"]


def test_the_weeds_come_when_they_are_told_to():
    assert plan(85.0, weeds_s=31.0).weeds_s == 31.0
