import pytest
from hypothesis import given
from hypothesis import strategies as st

from detectors.speed.curve import SpeedCurve

CURVE = SpeedCurve((-0.8, -0.4, 0.5, 0.9), (-0.9, -0.5, 0.8, 1.3))


@pytest.mark.parametrize(
    ("command", "speed_mps"),
    [
        (0.5, 0.8), (0.9, 1.3), (0.7, 1.05), (0.25, 0.4), (0.0, 0.0), (1.0, 1.3 / 0.9),
        (-0.4, -0.5), (-0.6, -0.7), (-0.1, -0.125), (-1.0, -0.9 / 0.8),
    ],
)  # fmt: skip
def test_straight_from_point_to_point_to_zero_and_beyond_in_proportion(command, speed_mps):
    assert CURVE.speed_mps(command) == pytest.approx(speed_mps)


def test_where_only_one_way_was_driven_the_nearest_command_stands_for_the_other():
    assert SpeedCurve((0.5, 0.9), (0.8, 1.3)).speed_mps(-0.3) == pytest.approx(-0.3 * 0.8 / 0.5)
    assert SpeedCurve((-0.9, -0.5), (-1.3, -0.8)).speed_mps(0.3) == pytest.approx(0.3 * 0.8 / 0.5)


@pytest.mark.parametrize(
    ("command", "covered"), [(0.5, True), (0.58, True), (0.42, True), (0.3, False), (0.97, True), (-0.6, False)]
)
def test_it_covers_what_is_near_a_point(command, covered):
    assert SpeedCurve((0.5, 0.9), (0.8, 1.3)).covers(command) is covered


def test_it_covers_what_is_between_two_points_that_are_not_far_apart():
    assert SpeedCurve((0.5, 0.75), (0.8, 1.1)).covers(0.62)
    assert not SpeedCurve((0.3, 0.9), (0.5, 1.3)).covers(0.6)
    assert not SpeedCurve((-0.5, 0.5), (-0.5, 0.5)).covers(0.0)


def test_scaled_and_extended():
    assert CURVE.scaled(0.5).speed_mps(0.7) == pytest.approx(0.5 * CURVE.speed_mps(0.7))
    more = CURVE.with_point(0.7, 1.2)
    assert more.commands == (-0.8, -0.4, 0.5, 0.7, 0.9)
    assert more.speed_mps(0.7) == 1.2
    assert more.with_point(0.7, 1.1).speed_mps(0.7) == 1.1
    assert CURVE.commands == (-0.8, -0.4, 0.5, 0.9)


@pytest.mark.parametrize(
    ("commands", "speeds_mps"),
    [
        ((), ()),
        ((0.5,), (0.8, 0.9)),
        ((0.0,), (0.8,)),
        ((0.5,), (0.0,)),
        ((0.5,), (-0.8,)),
        ((1.5,), (0.8,)),
        ((0.5,), (float("nan"),)),
        ((float("nan"),), (0.5,)),
        ((0.9, 0.5), (1.3, 0.8)),
        ((0.5, 0.5), (0.8, 0.8)),
    ],
)
def test_what_is_no_curve_is_named(commands, speeds_mps):
    with pytest.raises(ValueError, match=r"speed curve.*want"):
        SpeedCurve(commands, speeds_mps)


commands = st.lists(st.floats(0.01, 1.0), min_size=1, max_size=5, unique=True).map(sorted)


@given(commands, st.floats(-1.0, 1.0), st.data())
def test_the_speed_has_the_sign_of_the_command_and_goes_through_the_points(known, command, data):
    speeds = data.draw(st.lists(st.floats(0.05, 3.0), min_size=len(known), max_size=len(known)))
    curve = SpeedCurve(tuple(known), tuple(speeds))
    assert curve.speed_mps(command) * command >= 0.0
    for point, speed_mps in zip(known, speeds, strict=True):
        assert curve.speed_mps(point) == pytest.approx(speed_mps)
        assert curve.covers(point)
