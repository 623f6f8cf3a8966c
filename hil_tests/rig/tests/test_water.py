"""Currents over time and place."""

from __future__ import annotations

from math import inf, nan, pi

import pytest

from hil_tests.rig.water import AT_REST, STILL, Current, SettingIn, Shear, Tide, Together

HERE = (10.0, -20.0, 5.0)


def test_still_water_is_at_rest():
    assert STILL.velocity_mps(1e6, HERE) == AT_REST


def test_a_current_sets_in_smoothly():
    water = SettingIn(Current(0.2, -0.4, 0.1), onset_s=30.0, ramp_s=8.0)
    east_mps = [water.velocity_mps(time_s, HERE)[1] for time_s in (0.0, 30.0, 32.0, 34.0, 38.0, 100.0)]
    assert east_mps == pytest.approx([0.0, 0.0, -0.4 * (0.5 - 0.5**1.5), -0.2, -0.4, -0.4])
    assert SettingIn(Current(0.2), onset_s=30.0).velocity_mps(30.01, HERE) == (0.2, 0.0, 0.0)


def test_the_tide_turns_about():
    tide = Tide(0.3, 0.1, period_s=44714.0, east_phase_rad=-0.5 * pi)
    assert tide.velocity_mps(0.0, HERE) == pytest.approx((0.3, 0.0, 0.0))
    assert tide.velocity_mps(0.25 * 44714.0, HERE) == pytest.approx((0.0, 0.1, 0.0))
    assert tide.velocity_mps(0.5 * 44714.0, HERE) == pytest.approx((-0.3, 0.0, 0.0))


def test_shear_grows_with_depth_or_across():
    assert Shear((0.5, 0.0, 0.0), (-0.02, 0.0, 0.0)).velocity_mps(0.0, HERE) == pytest.approx((0.4, 0.0, 0.0))
    across = Shear((0.5, 0.0, 0.0), (0.01, 0.0, 0.0), across=(0.0, 2.0, 0.0))
    assert across.velocity_mps(0.0, HERE) == pytest.approx((0.3, 0.0, 0.0))


def test_currents_add_up():
    both = Together((Current(0.1, 0.2, 0.3), SettingIn(Current(1.0), onset_s=5.0)))
    assert both.velocity_mps(4.0, HERE) == (0.1, 0.2, 0.3)
    assert both.velocity_mps(6.0, HERE) == (1.1, 0.2, 0.3)


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: Current(east_mps=nan), "east_mps = nan: want a finite velocity"),
        (lambda: SettingIn(STILL, onset_s=inf), "onset_s = inf: want a finite time"),
        (lambda: SettingIn(STILL, onset_s=0.0, ramp_s=-1.0), "ramp_s = -1.0: want 0 or more seconds"),
        (lambda: Tide(1.0, 1.0, period_s=0.0), "period_s = 0.0: want seconds above 0"),
        (lambda: Shear(AT_REST, AT_REST, across=AT_REST), "want a direction"),
    ],
)
def test_impossible_water_is_refused(make, says):
    with pytest.raises(ValueError, match=says):
        make()
