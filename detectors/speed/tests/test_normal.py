import pickle
from dataclasses import replace

import pytest

from detectors.speed.config import SpeedConfig
from detectors.speed.curve import SpeedCurve
from detectors.speed.normal import LEARNT_S, USUAL_S, NormalSpeed

FIXED = SpeedConfig(speed_min_mps=0.8, speed_max_mps=1.2)
STEP_S = 0.5


def driven(normal, command, seconds, speed_mps=None):
    """Holds a command; where a speed is given, it is as well known as can be. Returns all factors multiplied."""
    factor = 1.0
    for _ in range(round(seconds / STEP_S)):
        normal.follow(command, STEP_S)
        if speed_mps is not None:
            ratio = speed_mps / (normal.share() * normal.reference_mps)
            factor *= normal.learn(ratio, STEP_S)
    return factor


def limits(normal):
    said = normal.range()
    return None if said is None else said.limits_mps


def test_without_commands_a_fixed_range_holds_from_the_start():
    normal = NormalSpeed(FIXED)
    normal.follow(None, 0.0)
    assert limits(normal) == pytest.approx((0.8, 1.2))
    assert normal.share() == 1.0
    assert not normal.stopped


def test_a_fixed_range_belongs_to_the_command_that_is_usual_at_first():
    normal = NormalSpeed(FIXED)
    driven(normal, 0.6, USUAL_S - STEP_S)
    assert limits(normal) is None
    driven(normal, 0.6, 5.0)
    assert limits(normal) == pytest.approx((0.8, 1.2))
    driven(normal, 0.66, 20.0)
    assert limits(normal) == pytest.approx((0.88, 1.32), rel=1e-6)
    driven(normal, 1.0, 20.0)  # too far from what is known: between in proportion to the command and to its root
    assert limits(normal) == pytest.approx((0.8 * (1.0 / 0.6) ** 0.5, 1.2 / 0.6), rel=1e-6)
    assert not normal.learnt


def test_a_fixed_range_may_name_its_command():
    normal = NormalSpeed(replace(FIXED, range_command=0.6))
    driven(normal, 0.3, 5.0)
    assert limits(normal) is None  # slower than that: nothing is known yet
    driven(normal, 0.6, 20.0)
    assert limits(normal) == pytest.approx((0.8, 1.2), rel=1e-6)


def test_the_first_command_makes_what_was_assumed_without_any_of_no_use():
    normal = NormalSpeed(FIXED)
    normal.follow(None, 0.0)
    assert normal.learnt
    driven(normal, 0.5, USUAL_S + 5.0)
    assert normal.curve == SpeedCurve((0.5,), (1.0,))


def test_a_given_curve_says_nothing_without_a_command():
    normal = NormalSpeed(SpeedConfig(speed_curve=SpeedCurve((0.5,), (2.0,))))
    normal.follow(None, 0.0)
    assert limits(normal) is None
    assert normal.command_lost


def test_the_usual_command_is_the_mean_under_way_and_stops_do_not_count():
    normal = NormalSpeed(FIXED)
    for _ in range(10):
        driven(normal, 0.5, 1.0)
        driven(normal, 0.0, 3.0)
        driven(normal, 0.7, 1.0)
    assert normal.curve.commands == pytest.approx((0.6,))


def test_without_a_range_the_speed_that_is_driven_is_learnt():
    normal = NormalSpeed(SpeedConfig(tolerance=0.25))
    normal.follow(None, 0.0)
    assert limits(normal) is None
    factor = driven(normal, None, USUAL_S + LEARNT_S + 2.0, speed_mps=1.6)
    assert limits(normal) == pytest.approx((1.2, 2.0))
    assert factor * 1.6 == pytest.approx(1.0)  # speed at the reference, from now on


def test_every_command_is_learnt_by_itself_and_between_near_ones_too():
    normal = NormalSpeed(FIXED)
    driven(normal, 0.6, USUAL_S + 1.0)
    driven(normal, 0.85, LEARNT_S + 5.0, speed_mps=1.25)
    assert limits(normal) == pytest.approx((0.8 * 1.25, 1.2 * 1.25))
    driven(normal, 0.72, 10.0)
    assert limits(normal) == pytest.approx((0.8 * 1.12, 1.2 * 1.12), rel=1e-2)


def test_an_estimate_means_the_same_speed_before_and_after_learning():
    normal = NormalSpeed(FIXED)
    driven(normal, 0.6, USUAL_S + 1.0)
    driven(normal, 0.9, 10.0)
    at_reference_mps = 1.4 / normal.share()  # what the estimator must have learnt for the speed to be 1.4 m/s
    factor = driven(normal, 0.9, LEARNT_S + 5.0, speed_mps=1.4)
    assert factor != 1.0
    assert at_reference_mps * factor * normal.share() == pytest.approx(1.4)


def test_what_was_learnt_is_not_learnt_again():
    normal = NormalSpeed(FIXED)
    driven(normal, 0.6, USUAL_S + 1.0)
    curve = normal.curve
    assert driven(normal, 0.6, 100.0, speed_mps=0.5) == 1.0
    assert normal.curve is curve


def test_astern_both_limits_are_negative_and_the_slower_one_is_still_the_first():
    normal = NormalSpeed(FIXED)
    driven(normal, 0.6, USUAL_S + 1.0)
    driven(normal, -0.6, 10.0)
    assert limits(normal) is None
    assert normal.share() == pytest.approx(-1.0)
    driven(normal, -0.6, LEARNT_S + 5.0, speed_mps=-0.5)
    assert limits(normal) == pytest.approx((-0.4, -0.6))


def test_a_speed_ahead_is_not_learnt_as_one_astern():
    normal = NormalSpeed(FIXED)
    driven(normal, 0.6, USUAL_S + 1.0)
    assert driven(normal, -0.6, 10.0 + 2.0 * LEARNT_S, speed_mps=0.5) == 1.0
    assert normal.curve.commands == (0.6,)


@pytest.mark.parametrize("command", [1e-9, -0.03, 0.1])
def test_next_to_no_thrust_is_stopped_and_nothing_is_learnt_there(command):
    normal = NormalSpeed(FIXED)
    driven(normal, 0.6, USUAL_S + 1.0)
    assert not normal.stopped
    assert driven(normal, command, 10.0 + 2.0 * LEARNT_S, speed_mps=0.15) == 1.0
    assert normal.stopped
    assert normal.curve.commands == (0.6,)


def test_the_range_follows_a_command_as_the_hull_does():
    normal = NormalSpeed(SpeedConfig(surge_time_s=4.0), SpeedCurve((0.5, 0.75), (0.8, 1.2)))
    driven(normal, 0.5, 60.0)
    assert limits(normal) == pytest.approx((0.64, 0.96))
    driven(normal, 0.75, 4.0)
    assert limits(normal)[0] == pytest.approx(0.8 * (1.2 - 0.4 * 0.368), rel=1e-2)
    driven(normal, 0.75, 60.0)
    assert limits(normal) == pytest.approx((0.96, 1.44))


def test_while_commands_are_missing_nothing_is_held_against_a_range():
    normal = NormalSpeed(FIXED)
    driven(normal, 0.6, USUAL_S + 1.0)
    driven(normal, None, 2.0)
    assert limits(normal) is None
    assert driven(normal, None, 2.0 * LEARNT_S, speed_mps=0.3) == 1.0
    driven(normal, 0.6, 2.0)
    assert limits(normal) == pytest.approx((0.8, 1.2))


def test_a_curve_of_an_earlier_dive_holds_at_once_and_goes_before_the_configured_one():
    configured = SpeedConfig(speed_curve=SpeedCurve((0.6,), (2.0,)))
    for normal, usual_mps in (
        (NormalSpeed(configured), 2.0),
        (NormalSpeed(configured, SpeedCurve((0.6,), (1.5,))), 1.5),
    ):
        normal.follow(0.6, 0.0)
        assert normal.range().usual_mps == usual_mps


def test_accepted_the_whole_curve_is_that_much_slower():
    normal = NormalSpeed(FIXED, SpeedCurve((0.5, 0.75), (0.8, 1.2)))
    driven(normal, 0.5, 5.0)
    normal.accept(0.7)
    assert limits(normal) == pytest.approx((0.7 * 0.64, 0.7 * 0.96))
    driven(normal, 0.75, 30.0)
    assert limits(normal) == pytest.approx((0.7 * 0.96, 0.7 * 1.44))


def test_forgotten_the_speed_is_learnt_even_where_a_range_was_configured():
    normal = NormalSpeed(FIXED)
    driven(normal, 0.6, USUAL_S + 1.0)
    normal.forget()
    assert limits(normal) is None
    driven(normal, 0.6, USUAL_S + LEARNT_S + 5.0, speed_mps=0.5)
    assert limits(normal) == pytest.approx((0.4, 0.6))


def test_pickled_it_learns_on():
    one = NormalSpeed(FIXED)
    driven(one, 0.6, USUAL_S + 1.0)
    driven(one, 0.9, 15.0, speed_mps=1.3)
    other = pickle.loads(pickle.dumps(one))  # noqa: S301
    factors = [driven(normal, 0.9, 15.0, speed_mps=1.3) for normal in (one, other)]
    assert factors[0] == factors[1] != 1.0
    assert limits(one) == limits(other) is not None
